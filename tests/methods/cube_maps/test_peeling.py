"""The second layer of a cube map: nested balls, the reflector left out, and few objects or many."""

import numpy as np
import pytest

from ldtrefl.device.stats import Stats
from ldtrefl.frame.regions import FEW_OBJECTS
from ldtrefl.frame.visibility import draw_in_bands
from ldtrefl.methods.cube_maps.faces import face_camera, texel_points
from ldtrefl.methods.cube_maps.peeling import seen_behind
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.tracing.scene_bvh import SceneBvh
from tests.frame.flat_mirror import on_device
from tests.methods.cube_maps.rooms import unit

RESOLUTION = 24
RING, BALL, ROOM, PLATE = range(4)
"""Numbers of the objects: a ring about a ball, both in a room, and a plate in it."""


def nested(more: int) -> Scene:
    """The ring is the reflector; ``more`` balls stand outside the room."""
    outside = [
        Object(shape="sphere", params={"segments": [12, 6]}, scale=0.1, translate=(6.0 + k, 0.0, 0.0))
        for k in range(more)
    ]
    return Scene(
        camera=Camera(eye=(0, 0, 0.1), look_at=(1, 0, 0), width=8, height=8, fov_y=40),
        objects=(
            Object(shape="torus"),
            Object(shape="sphere", scale=0.3),
            Object(shape="sphere", scale=3.0),
            Object(shape="plane", scale=0.5, translate=(0.0, 0.0, 2.0)),
            *outside,
        ),
    )


@pytest.mark.parametrize("by_bounds", [True, False])
@pytest.mark.parametrize("more", [0, FEW_OBJECTS])
@pytest.mark.parametrize("face", [0, 4])
def test_what_stands_behind_is_the_next_surface(face: int, more: int, by_bounds: bool) -> None:
    """From the middle of the ball: behind it stands the room, but where the plate does, and never the ring."""
    scene = on_device(nested(more))
    tracer = SceneBvh().bound(scene, range(len(scene.objects)), Stats())
    (front,) = draw_in_bands(scene, face_camera(face, np.zeros(3), 1.0, RESOLUTION), without=RING)
    assert (front.objects == BALL).all()
    behind = seen_behind(front, tracer, RING, by_bounds=by_bounds)
    points = texel_points(face, RESOLUTION)
    is_plate = np.abs(points[:, :2]).max(axis=1) < 0.25 if face == 4 else np.zeros(len(points), bool)
    np.testing.assert_array_equal(behind.objects.ravel(), np.where(is_plate, PLATE, ROOM))
    distance = np.linalg.norm(behind.surfaces[0].numpy() / scene.device_units_per_world_unit, axis=1)
    if more == 0:
        expected = np.where(is_plate, 2.0 / unit(points)[:, 2], 3.0) if face == 4 else np.full(len(points), 3.0)
        np.testing.assert_allclose(distance, expected, rtol=5e-3)
    assert not behind.view.reflector.numpy().any(), "none of these is a mirror"


def test_behind_the_environment_is_nothing() -> None:
    scene = on_device(nested(0).with_objects({ROOM: Object(shape="sphere", scale=0.01, translate=(0, 0, -5))}))
    tracer = SceneBvh().bound(scene, range(len(scene.objects)), Stats())
    (front,) = draw_in_bands(scene, face_camera(0, np.array([1.0, 0.0, 0.0]), 1.0, RESOLUTION), without=RING)
    assert (front.objects == -1).all()
    assert (seen_behind(front, tracer, RING, by_bounds=True).objects == -1).all()
