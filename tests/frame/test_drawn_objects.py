"""Which objects may be seen: all that are, and few that are not."""

import numpy as np
import pytest

from ldtrefl.device import launch
from ldtrefl.frame.drawn_objects import DrawnObjects
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world.camera import pixels_from_world
from ldtrefl.world.device_scene import DeviceScene

CAMERAS = {
    "outside": Camera(eye=(0, -6, 1), look_at=(0, 0, 0), width=60, height=40),
    "among them": Camera(eye=(0.1, 0.2, 0.3), look_at=(1, 0.5, 0), fov_y=100, width=60, height=40),
    "narrow": Camera(eye=(0, -400, 3), look_at=(0.4, 0, 0.2), fov_y=0.2, width=40, height=60),
    "far": Camera(eye=(0, -4000, 1), look_at=(0, 0, 0), width=60, height=40),
}


@pytest.fixture(scope="module")
def scene() -> DeviceScene:
    """Balls of many sizes."""
    rng = np.random.default_rng(4)
    balls = tuple(
        Object(
            shape="sphere", params={"segments": [24, 12]}, scale=10.0 ** rng.uniform(-3, -0.5), translate=tuple(place)
        )
        for place in rng.uniform(-2, 2, (300, 3)).tolist()
    )
    return DeviceScene(Scene(camera=CAMERAS["outside"], objects=balls), launch.resolve_device(None))


@pytest.mark.parametrize("name", CAMERAS)
def test_whatever_a_pixel_sees_is_among_them(name: str, scene: DeviceScene) -> None:
    """Each ball is drawn alone, which shows it wherever it covers a pixel."""
    camera = CAMERAS[name]
    kept = set(DrawnObjects.of(scene, camera, np.arange(len(scene.objects))).numbers.tolist())
    seen = set()
    for number, source in enumerate(scene.scene.objects):
        alone = draw_gbuffer(DeviceScene(Scene(camera=camera, objects=(source,)), scene.device), camera)
        if (alone.objects >= 0).any():
            seen.add(number)
    assert seen <= kept
    # A ball of a pixel's size may lie between centres all the same.
    assert len(kept - seen) <= 0.35 * len(scene.objects)
    assert 0 < len(seen) or name == "far"


def test_those_left_out_lie_behind_beside_or_between_pixels() -> None:
    camera = Camera(eye=(0, 0, 0), look_at=(0, 1, 0), fov_y=90, width=10, height=10)
    pixel = 2.0 / 10  # at distance 1

    def ball(x: float, depth: float, z: float, radius: float) -> Object:
        return Object(shape="sphere", params={"segments": [24, 12]}, scale=radius, translate=(x, depth, z))

    balls = {
        "before": ball(0.0, 5.0, 0.0, 1.0),
        "behind": ball(0.0, -5.0, 0.0, 1.0),
        "about the eye": ball(0.0, -0.5, 0.0, 1.0),
        "beside": ball(7.0, 5.0, 0.0, 1.0),
        "half beside": ball(5.5, 5.0, 0.0, 1.0),
        "below": ball(0.0, 5.0, -7.0, 1.0),
        "on a pixel's centre": ball(0.5 * pixel, 1.0, 0.5 * pixel, 0.01 * pixel),
        "between centres": ball(0.0, 1.0, 0.5 * pixel, 0.4 * pixel),
        "between rows": ball(0.5 * pixel, 1.0, 0.0, 0.4 * pixel),
        "over a centre": ball(0.0, 1.0, 0.5 * pixel, 0.6 * pixel),
    }
    scene = DeviceScene(Scene(camera=camera, objects=tuple(balls.values())), launch.resolve_device(None))
    drawn = DrawnObjects.of(scene, camera, np.arange(len(balls)))
    expected = ["before", "about the eye", "half beside", "on a pixel's centre", "over a centre"]
    assert [list(balls)[number] for number in drawn.numbers] == expected
    np.testing.assert_allclose(drawn.depths[0], 5.0 * scene.device_units_per_world_unit)


def test_they_go_to_the_device_with_their_projections() -> None:
    camera = CAMERAS["outside"]
    boxes = tuple(Object(shape="box", scale=0.3, translate=(x, 0, 0)) for x in (-1.0, 90.0, 1.0))
    scene = DeviceScene(Scene(camera=camera, objects=boxes), launch.resolve_device(None))
    drawn = DrawnObjects.of(scene, camera, np.arange(3))
    assert drawn.numbers.tolist() == [0, 2] and drawn.some(slice(1, 2)).numbers.tolist() == [2]
    rows = drawn.on_device(np.array([0, 48]), scene.device).numpy()
    assert rows["object"].tolist() == [0, 2] and rows["first_corner"].tolist() == [0, 48]
    x, y, depth = (rows[name][1] @ [0.0, 0.0, 0.0, 1.0] for name in ("row_x", "row_y", "row_z"))
    np.testing.assert_allclose([x, y, depth], pixels_from_world(camera) @ [1.0, 0.0, 0.0, 1.0], rtol=1e-12, atol=1e-12)
    both = DrawnObjects.joined([drawn.some(slice(1, 2)), drawn.some(slice(0, 1))])
    assert both.numbers.tolist() == [2, 0] and both.projections.shape == (2, 3, 4)
    none = DrawnObjects.of(scene, camera, np.arange(0))
    assert len(none.on_device(np.arange(0), scene.device)) == 0
