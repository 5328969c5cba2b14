"""The environment seen straight through surfaces is left out of cutouts, in closed form."""

from dataclasses import replace

import numpy as np
import pytest

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.frame.camera_shading import first_rays
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.see_through import goes_straight_on, places_of
from ldtrefl.frame.visibility import draw_gbuffer, draw_in_bands
from ldtrefl.scene.description import Camera, Environment, Lighting, Object, Scene
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.surface_material import SurfaceMaterial, Texture
from ldtrefl.world.device_scene import DeviceScene
from tests import frame_scenes

AROUND = np.array([0.5, 0.25, 0.75])
ALPHA = 0.25
CLEAR = SurfaceMaterial(base_color=(0.2, 0.6, 0.4), specular=0.0, alpha=ALPHA, alpha_mode="blend", double_sided=True)
"""Scatters light, mirrors none, and lets three quarters through."""


def sheet(name: str, left: float, right: float, distance: float, material: SurfaceMaterial = CLEAR) -> Object:
    """An upright rectangle across the view, ``distance`` behind the middle."""
    corners = [[left, distance, -1], [right, distance, -1], [right, distance, 1], [left, distance, 1]]
    uvs = [[0, 0], [1, 0], [1, 1], [0, 1]]
    faces = [[0, 1, 2], [0, 2, 3]]
    return Object(name=name, mesh=Mesh(corners, faces, uvs=uvs, parts=(Part(0, material),)))


def scene(*objects: Object, bounces: int = 4) -> Scene:
    return Scene(
        camera=Camera(eye=(0.1, -6.0, 0.1), look_at=(0.0, 0.0, 0.0), width=64, height=40, fov_y=30.0),
        environment=Environment(sky=tuple(AROUND.tolist()), ground=tuple(AROUND.tolist())),
        lighting=Lighting(ambient=0.7),
        objects=objects,
        reflection=ldtrefl.Reflection(max_bounces=bounces, least_weight=0.0),
    )


def sheets() -> tuple[Object, ...]:
    """Two clear sheets that overlap in the middle, and a wall behind the right one."""
    solid = replace(CLEAR, alpha=1.0, alpha_mode="opaque")
    return sheet("left", -1.2, 0.3, 0.0), sheet("right", -0.3, 1.0, 0.5), sheet("wall", 0.6, 1.2, 1.0, solid)


def straight_on(gbuffer: GBuffer) -> np.ndarray:
    """(n,) bool: of the first rays of a G-buffer, those that go straight on."""
    rays = first_rays(gbuffer)
    return goes_straight_on(gbuffer.view.camera, places_of(gbuffer, rays.pixel.numpy()), rays)


@pytest.mark.parametrize("method", ["bvh", "ldt"])
def test_sheets_cover_as_much_as_their_alphas_say(method: str) -> None:
    frame = ldtrefl.render(scene(*sheets()), method)
    found = np.unique(frame.alpha.round(5))
    np.testing.assert_allclose(found, [0.0, ALPHA, 1 - (1 - ALPHA) ** 2, 1.0], atol=1e-5)
    # What is left out is the environment's share, and nothing else.
    left_out = frame.image - frame.cutout[..., :3]
    np.testing.assert_allclose(left_out, (1.0 - frame.alpha[..., None]) * AROUND, atol=1e-5)
    assert (frame.alpha == 1.0).mean() > 0.02 and frame.cutout.min() >= 0.0


@pytest.mark.parametrize("samples", [4, 16])
def test_samples_cover_by_their_share(samples: int) -> None:
    """A cutout before what it was rendered before is the image, but for pixels that only one of them samples again."""
    frame = ldtrefl.render(scene(*sheets()), "bvh", samples=samples)
    difference = np.abs(frame.cutout[..., :3] + (1.0 - frame.alpha[..., None]) * AROUND - frame.image)
    assert difference.max() < 0.1 and (difference < 1e-5).mean() > 0.8
    assert len(np.unique(frame.alpha.round(5))) > 20 and frame.alpha.min() >= -1e-6 and frame.alpha.max() <= 1 + 1e-6


@pytest.mark.parametrize("samples", [1, 4])
def test_layers_of_a_cutout_add_up_to_it(samples: int) -> None:
    frame = ldtrefl.render(scene(*sheets()), "bvh", samples=samples)
    layers = frame.layers(cutout=True)
    np.testing.assert_allclose(layers["beauty"], frame.cutout[..., :3], atol=1e-6)
    np.testing.assert_array_equal(layers["alpha"], frame.alpha)
    together = layers["direct"] + sum(layer for name, layer in layers.items() if name.startswith("reflection_"))
    np.testing.assert_allclose(together, layers["beauty"], atol=1e-6)
    if samples == 1:
        np.testing.assert_array_equal(frame.layers()["alpha"], frame.alpha)


def test_edges_of_a_cutout_are_smooth_though_the_image_shows_none() -> None:
    """A sheet that is as bright as what is behind it: the image needs no samples there."""
    same = replace(CLEAR, base_color=tuple((AROUND / 0.7).tolist()), alpha=1.0, alpha_mode="opaque")
    tilted = replace(sheet("sheet", -0.8, 0.8, 0.0, same), rotate=(0.0, 1.0, 0.0, 20.0))
    frame = ldtrefl.render(scene(tilted), "bvh", samples=16)
    assert frame.sample_counts.max() == 1
    edge = frame.alpha[(frame.alpha > 0.0) & (frame.alpha < 1.0)]
    assert len(np.unique(edge.round(4))) > 40


def test_holes_are_not_covered() -> None:
    holes = np.where(np.indices((4, 4)).sum(axis=0) % 2 == 0, 255, 0).astype(np.uint8)
    white = StoredPicture(np.full((4, 4, 3), 255, np.uint8), holes)
    pierced = replace(CLEAR, alpha=1.0, alpha_mode="mask", base_texture=Texture(white, is_nearest=True))
    frame = ldtrefl.render(scene(sheet("leaf", -1.0, 1.0, 0.0, pierced)), "bvh")
    assert set(np.unique(frame.alpha)) == {0.0, 1.0}
    assert 0.4 < frame.alpha[frame.layers()["object_id"] == 0.0].mean() < 0.6
    assert (frame.cutout[frame.alpha == 0.0] == 0.0).all()


def test_where_bounces_are_used_up_the_last_surface_is_the_end() -> None:
    frame = ldtrefl.render(scene(*sheets(), bounces=1), "bvh")
    np.testing.assert_allclose(np.unique(frame.alpha.round(5)), [0.0, ALPHA, 1.0], atol=1e-5)


def test_mirrors_send_no_ray_straight_on_and_frames_with_them_are_not_rendered_again() -> None:
    given = frame_scenes.scene()
    on_device = DeviceScene(given, launch.resolve_device(None))
    gbuffer = draw_gbuffer(on_device, given.camera)
    assert not straight_on(gbuffer).any()
    frame = ldtrefl.render(given, "bvh")
    np.testing.assert_array_equal(frame.alpha, (gbuffer.objects >= 0).astype(np.float32))
    np.testing.assert_array_equal(frame.cutout[..., :3], frame.image * frame.alpha[..., None])


def test_rays_that_go_straight_on_are_told_in_every_band(monkeypatch: pytest.MonkeyPatch) -> None:
    given = scene(*sheets()[:2])
    monkeypatch.setattr("ldtrefl.frame.visibility.BAND_PIXELS", 8 * 64)
    on_device, told = DeviceScene(given, launch.resolve_device(None)), 0
    for band in draw_in_bands(on_device, given.camera):
        straight = straight_on(band)
        assert straight.all()
        told += len(straight)
    assert told > 500
