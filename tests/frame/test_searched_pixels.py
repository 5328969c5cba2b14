"""What pixels see of objects that their rays are searched for in: float64's answer, and in any order and bands."""

import dataclasses

import numpy as np
import pytest

from ldtrefl.device.stats import Stats
from ldtrefl.frame import visibility
from ldtrefl.frame.searched_pixels import CameraSearch
from ldtrefl.frame.visibility import draw_gbuffer, draw_in_bands
from ldtrefl.ldt.options import BINARY_STEPS, TEXEL
from ldtrefl.ldt.scene_maps import MapOptions, SceneMaps
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.scene.mesh import Mesh
from ldtrefl.tracing.scene_bvh import SceneBvh
from ldtrefl.tracing.tracer import SceneTracer
from ldtrefl.world.device_scene import DeviceScene
from tests.frame.brute_force import BruteForce
from tests.frame.flat_mirror import on_device
from tests.frame.test_zbuffer import assert_same

CAMERA = Camera(eye=(0, -5, 1.5), look_at=(0, 0, 0), width=192, height=128, fov_y=30)
KNOT = Object(shape="torus_knot", params={"segments": [400, 40]})


def maps() -> SceneTracer:
    return SceneMaps(MapOptions("exact", "exact", TEXEL, BINARY_STEPS, None))


def searching(scene: DeviceScene, *numbers: int, tracer: SceneTracer | None = None) -> CameraSearch:
    """A search in the objects of these numbers, by default in all."""
    chosen = np.array(numbers or range(len(scene.objects)), np.int64)
    return CameraSearch(chosen, (tracer or maps()).bound(scene, chosen.tolist(), Stats()))


def sheet(count: int) -> Mesh:
    """A square in waves, seen from both sides."""
    x, y = np.meshgrid(np.linspace(-1, 1, count), np.linspace(-1, 1, count))
    vertices = np.stack([x, y, 0.2 * np.sin(7 * x) * np.cos(5 * y)], 2).reshape(-1, 3)
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).reshape(-1)
    faces = np.stack([corner, corner + 1, corner + count, corner + count, corner + 1, corner + count + 1], 1)
    return Mesh(vertices, faces.reshape(-1, 3))


def with_outlier(mesh: Mesh) -> Mesh:
    """A mesh with one triangle a thousand times farther out, before the camera."""
    far = np.array([[900.0, 3000.0, -600.0], [-900.0, 3000.0, -600.0], [0.0, 3000.0, -1400.0]])
    return Mesh(np.concatenate([mesh.vertices, far]), np.concatenate([mesh.faces, [len(mesh.vertices) + np.arange(3)]]))


def moved(camera: Camera, by: tuple[float, float, float]) -> Camera:
    place = lambda p: tuple(np.add(p, by).tolist())  # noqa: E731
    return dataclasses.replace(camera, eye=place(camera.eye), look_at=place(camera.look_at))


SCENES = {
    "a knot": Scene(camera=CAMERA, objects=(KNOT,)),
    "knots that touch, one mesh": Scene(
        camera=CAMERA,
        objects=(KNOT, dataclasses.replace(KNOT, translate=(0.3, -0.2, 0.1)), dataclasses.replace(KNOT, scale=0.5)),
    ),
    "stretched, flat and far off": Scene(
        camera=moved(CAMERA, (1e6, 0, -1e5)),
        objects=(dataclasses.replace(KNOT, scale=(1.2, 1.0, 1e-3), rotate=(1, 2, 0, 40), translate=(1e6, 0, -1e5)),),
    ),
    "a sheet": Scene(camera=CAMERA, objects=(Object(mesh=sheet(120), rotate=(1, 0, 0, 70)),)),
    "a sheet from its edge": Scene(
        camera=dataclasses.replace(CAMERA, eye=(0, -5, 0)), objects=(Object(mesh=sheet(120)),)
    ),
    "from afar": Scene(camera=dataclasses.replace(CAMERA, eye=(0, -5e4, 1.5e4), fov_y=0.003), objects=(KNOT,)),
    "large in the image": Scene(camera=dataclasses.replace(CAMERA, look_at=(0.9, 0.4, 0), fov_y=2.8), objects=(KNOT,)),
    "an outlier": Scene(camera=CAMERA, objects=(Object(mesh=with_outlier(sheet(100))),)),
}


@pytest.mark.parametrize("name", SCENES)
def test_pixels_see_what_float64_says(name: str) -> None:
    scene, camera = on_device(SCENES[name]), SCENES[name].camera
    right = BruteForce.of(scene, camera)
    assert (right.object >= 0).sum() > 1000
    seen = draw_gbuffer(scene, camera, searching(scene))
    assert len(right.wrong(seen)) == 0
    assert (seen.objects != right.object).sum() + (seen.triangles != right.triangle).sum() < 20


def test_brute_force_tells_a_wrong_pixel() -> None:
    scene = on_device(SCENES["a knot"])
    seen = draw_gbuffer(scene, CAMERA)
    right = BruteForce.of(scene, CAMERA)
    assert len(right.wrong(seen)) == 0
    row, column = np.argwhere(right.object >= 0)[700]
    seen.triangles[row, column] += 1
    np.testing.assert_array_equal(right.wrong(seen), [[row, column]])


@pytest.mark.parametrize("tracer", [maps, SceneBvh])
def test_it_does_not_matter_what_is_drawn_and_what_is_searched(tracer: type) -> None:
    """Objects that pass through each other, some of them drawn."""
    ball, box = Object(shape="sphere", scale=0.5), Object(shape="box", scale=0.3, translate=(0.8, 0.2, 0.3))
    small = dataclasses.replace(KNOT, scale=0.5, translate=(-0.6, -0.5, 0.2))
    objects = (KNOT, dataclasses.replace(KNOT, translate=(0.3, -0.2, 0.1)), small, ball, box)
    scene = on_device(Scene(camera=CAMERA, objects=objects))
    right = BruteForce.of(scene, CAMERA)
    assert len(np.unique(right.object)) == 6
    for numbers in ((0,), (1, 2), (3,), (0, 1, 2, 3, 4)):
        seen = draw_gbuffer(scene, CAMERA, searching(scene, *numbers, tracer=tracer()))
        assert len(right.wrong(seen)) == 0


def test_bands_have_the_bits_of_the_whole_image(monkeypatch: pytest.MonkeyPatch) -> None:
    objects = (*SCENES["knots that touch, one mesh"].objects, Object(shape="sphere", scale=0.7))
    camera = dataclasses.replace(CAMERA, width=181, height=117)
    scene = on_device(Scene(camera=camera, objects=objects))
    search = searching(scene, 0, 1)
    whole = draw_gbuffer(scene, camera, search)
    monkeypatch.setattr(visibility, "BAND_PIXELS", 20 * camera.width)
    bands = list(draw_in_bands(scene, camera, search))
    assert len(bands) == 8
    for name in ("objects", "triangles"):
        np.testing.assert_array_equal(np.concatenate([getattr(band, name) for band in bands]), getattr(whole, name))
    without = np.concatenate([band.objects for band in draw_in_bands(scene, camera, search, without=1)])
    assert not (without == 1).any() and (without == 0).sum() >= (whole.objects == 0).sum()


def test_without_room_for_corners_the_bits_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    objects = (*SCENES["knots that touch, one mesh"].objects, Object(shape="sphere", scale=0.7))
    scene = on_device(Scene(camera=CAMERA, objects=objects))
    expected = draw_gbuffer(scene, CAMERA, searching(scene, 1))
    monkeypatch.setattr("ldtrefl.frame.zbuffer.CORNERS_KEPT", 0)
    assert_same(draw_gbuffer(scene, CAMERA, searching(scene, 1)), expected)
