"""Primary visibility: the z-buffer against the ray caster, cameras in odd places, and images made in bands."""

import numpy as np
import pytest
from stress_cases.inputs import camera_rays

import ldtrefl
from ldtrefl.frame import visibility
from ldtrefl.frame.visibility import draw_gbuffer, draw_in_bands
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Object, Scene
from tests.frame.drawing import gbuffer
from tests.frame.flat_mirror import BOX, on_device, scene

CAMERAS = {
    "outside": Camera(eye=(1.5, -3, 1), look_at=(0, 0, 0), width=120, height=80),
    "inside the ring": Camera(eye=(0.0, 0.05, 0.02), look_at=(1, 0.3, 0.1), fov_y=100, width=120, height=80),
    "wide": Camera(eye=(0.4, -1.5, 0.4), look_at=(0, 0, 0), fov_y=170, width=120, height=80),
    "narrow": Camera(eye=(30, -300, 10), look_at=(0.3, 0, 0), fov_y=0.1, width=120, height=80),
    "flat image": Camera(eye=(1.5, -3, 1), look_at=(0, 0, 0), width=512, height=1),
    "steep image": Camera(eye=(1.5, -3, 1), look_at=(0, 0, 0), width=1, height=512),
    "along up": Camera(eye=(0.1, 0.1, 4), look_at=(0.1, 0.1 + 1e-4, 0), width=120, height=80),
}


@pytest.mark.parametrize("shape", ["torus_knot", "box", "room"])
@pytest.mark.parametrize("name", sorted(CAMERAS))
def test_zbuffer_agrees_with_the_raycaster(name: str, shape: str) -> None:
    camera = CAMERAS[name]
    seen = gbuffer(camera, Object(shape=shape))
    mesh = shapes.make(shape)
    hits = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(*camera_rays(camera))
    wrong = seen.triangles.ravel() != hits.triangle
    # Pixels on an edge may go to either triangle: allow one in 200 of them, which silhouettes and seams stay below.
    assert wrong.sum() <= max(2, wrong.size // 200), f"{name}, {shape}: {wrong.sum()} of {wrong.size} pixels"
    hole = (seen.triangles.ravel() < 0) & (hits.triangle >= 0)
    assert hole.sum() <= max(2, wrong.size // 2000)


def test_no_cracks_in_a_closed_room() -> None:
    for eye in ((0.3, 0.2, 0.1), (0.99, -0.99, 0.5), (0, 0, 0)):
        camera = Camera(eye=eye, look_at=(-0.5, 0.9, -0.2), fov_y=120, width=300, height=200)
        assert (gbuffer(camera, Object(shape="room", params={"segments": 13})).triangles >= 0).all()


def test_nearer_object_hides_the_farther() -> None:
    camera = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=9, height=9, fov_y=5)
    near = Object(shape="plane", rotate=(1, 0, 0, 90), translate=(0, -1, 0))
    far = Object(shape="plane", rotate=(1, 0, 0, 90))
    assert (gbuffer(camera, far, near).objects == 1).all()
    assert (gbuffer(camera, near, far).objects == 0).all()


def test_a_scene_moved_and_scaled_as_a_whole_looks_the_same() -> None:
    def image(scale: float, offset: float) -> np.ndarray:
        move = lambda p: tuple(scale * c + offset for c in p)  # noqa: E731
        camera = Camera(eye=move((1.5, -3, 1)), look_at=move((0, 0, 0)), width=90, height=60)
        ball = Object(shape="sphere", scale=0.8 * scale, translate=move((0, 0, 0)))
        return gbuffer(camera, ball).objects

    base = image(1.0, 0.0)
    for scale in (1e-6, 1e-3, 1e6):
        assert (image(scale, 0.0) != base).sum() <= 2
        assert (image(scale, 1e6 * scale) != base).sum() <= 4


def test_empty_scene() -> None:
    camera = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)
    assert (gbuffer(camera).objects == -1).all()
    assert np.isfinite(ldtrefl.render(Scene(camera=camera)).image).all()


def test_bands_are_parts_of_the_whole_image(monkeypatch: pytest.MonkeyPatch) -> None:
    device_scene = on_device(scene())
    camera = device_scene.scene.camera
    whole = draw_gbuffer(device_scene, camera)
    monkeypatch.setattr(visibility, "BAND_PIXELS", 20 * camera.width)
    bands = list(draw_in_bands(device_scene, camera))
    assert [(band.band.first_row, band.band.rows) for band in bands] == [(0, 16), (16, 16), (32, 16), (48, 4)]
    for name in ("objects", "triangles", "reflector_mask"):
        np.testing.assert_array_equal(np.concatenate([getattr(b, name) for b in bands]), getattr(whole, name))
    for k, surfaces in enumerate(zip(*(band.surfaces for band in bands), strict=True)):
        np.testing.assert_array_equal(np.concatenate([s.numpy() for s in surfaces]), whole.surfaces[k].numpy())


def test_an_object_that_is_left_out_is_not_seen() -> None:
    device_scene = on_device(scene())
    camera = device_scene.scene.camera
    (seen,) = draw_in_bands(device_scene, camera, without=BOX)
    whole = draw_gbuffer(device_scene, camera)
    assert (whole.objects == BOX).sum() > 100 and not (seen.objects == BOX).any()
    np.testing.assert_array_equal(seen.objects[whole.objects != BOX], whole.objects[whole.objects != BOX])
