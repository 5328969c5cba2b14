"""Flat mirrors by mirrored objects: exact, plane by plane, and refused where they are not flat."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl.methods.planar import planes_of
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene
from tests.frame import flat_mirror

MIRROR = Material(albedo=0.1, mirror=0.8)


def screen(**changes: object) -> Scene:
    """A mirror box, turned, and things about it, some of them before and some behind its planes, and one across."""
    things = [
        Object(shape="torus", scale=0.5, translate=(-1.6, -1.4, 0.3), rotate=(1, 1, 0, 40)),
        Object(shape="sphere", scale=0.4, translate=(1.2, -1.6, -0.2), material=Material(albedo=(0.8, 0.2, 0.1))),
        Object(shape="plane", scale=6.0, translate=(0.0, 0.0, -0.5), material=Material(albedo=(0.2, 0.5, 0.3))),
    ]
    mirror = Object(name="screen", shape="box", rotate=(0, 0, 1, 35), material=MIRROR, smooth=False)
    camera = Camera(eye=(0.3, -6.0, 2.0), look_at=(0.0, 0.0, 0.0), width=120, height=80, fov_y=40.0)
    lighting = Lighting(ambient=(0.4, 0.4, 0.4), shadows=True)
    sun = ldtrefl.Light(kind="directional", direction=(0.3, 0.5, -1.0), radiance=(1.0, 1.0, 1.0))
    sky = Environment(sky=(0.5, 0.6, 0.9), ground=(0.3, 0.2, 0.1))
    given = {"camera": camera, "lighting": lighting, "lights": (sun,), "environment": sky, "objects": (mirror, *things)}
    return Scene(**{**given, **changes})


def test_the_reflection_in_a_flat_mirror() -> None:
    given = flat_mirror.scene(box_mirror=0.5)
    frame, expected = ldtrefl.render(given, "planar"), flat_mirror.reflection(given, 1)
    np.testing.assert_allclose(frame.reflection.reshape(-1, 3)[expected.pixels], expected.radiance, rtol=2e-5)
    assert frame.hits is not None
    np.testing.assert_allclose(frame.hits.distance.ravel()[expected.pixels], expected.distance, rtol=1e-5)


@pytest.mark.parametrize("samples", [1, 4])
def test_each_plane_of_a_mirror_shows_what_rays_meet(samples: int) -> None:
    """The mirrors' triangles cross what they mirror, and the camera's plane: what is behind them is not shown."""
    for eye in ((0.3, -6.0, 2.0), (-1.2, -2.0, 0.6)):
        given = screen(camera=dataclasses.replace(screen().camera, eye=eye))
        found = ldtrefl.render(given, "planar", samples=samples)
        truth = ldtrefl.render(given, "bvh", samples=samples, max_bounces=1)
        off = np.abs(found.image - truth.image).max(axis=2)
        assert found.reflector_mask.sum() > 1500 and (truth.reflection[found.reflector_mask].std(axis=0) > 0.05).all()
        assert (off > 1e-3).sum() <= 2, "edges by rounding"


def test_bands_of_an_image_are_drawn_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = ldtrefl.render(screen(), "planar", samples=4).image
    monkeypatch.setattr("ldtrefl.renderer.LARGEST_WHOLE", 0)
    monkeypatch.setattr("ldtrefl.frame.visibility.BAND_PIXELS", 120 * 16)
    np.testing.assert_array_equal(ldtrefl.render(screen(), "planar", samples=4).image, whole)


def test_mirrors_that_move_have_other_planes() -> None:
    renderer = ldtrefl.Renderer(screen(), "planar")
    renderer.render()
    renderer.move("screen", rotate=(0, 0, 1, 20))
    other = screen(objects=(screen().objects[0].changed(rotate=(0, 0, 1, 20)), *screen().objects[1:]))
    np.testing.assert_array_equal(renderer.render().image, ldtrefl.render(other, "planar").image)


def test_planes_have_unit_normals_whatever_the_triangles_size() -> None:
    scene = flat_mirror.on_device(screen(objects=(Object(shape="box", scale=(3.0, 0.01, 1.0), material=MIRROR),)))
    planes = planes_of(scene, 0)
    assert len(planes.normals) == 6
    np.testing.assert_allclose(np.linalg.norm(planes.normals, axis=1), 1.0, rtol=1e-12)
    mesh, matrix = scene.meshes[0].mesh, scene.device_from_world @ scene.world_from_unit[0]
    corners = mesh.unit_vertices[mesh.faces] @ matrix[:3, :3].T + matrix[:3, 3]
    of_corner = planes.of_triangle[:, None]
    off = (corners * planes.normals[of_corner]).sum(axis=-1) + planes.offsets[of_corner]
    assert np.abs(off).max() < 1e-6


def test_curved_mirrors_are_refused_by_name() -> None:
    mirror = Object(name="ball", shape="sphere", material=MIRROR)
    with pytest.raises(ldtrefl.InputError, match=r"^object 'ball': method planar .*more than 16 planes.*ldt or bvh"):
        ldtrefl.render(screen(objects=(mirror,)), "planar")


def test_a_smooth_box_is_flat_where_its_normals_are_the_facets() -> None:
    mirror = dataclasses.replace(screen().objects[0], smooth=True)
    others = screen().objects[1:]
    found = ldtrefl.render(screen(objects=(mirror, *others)), "planar").image
    np.testing.assert_allclose(found, ldtrefl.render(screen(), "planar").image, atol=1e-5)


def test_flat_mirrors_with_bent_normals_are_refused() -> None:
    plane = Object(shape="plane").geometry
    bent = plane.with_normals(plane.normals + np.array([0.1, 0.0, 0.0]))
    mirror = Object(name="bent", mesh=bent, material=MIRROR)
    with pytest.raises(ldtrefl.InputError, match=r"^object 'bent': .*shading normals bend; smooth = false"):
        ldtrefl.render(screen(objects=(mirror,)), "planar")
    facets = Object(name="bent", mesh=bent, material=MIRROR, smooth=False)
    ldtrefl.render(screen(objects=(facets,)), "planar")
