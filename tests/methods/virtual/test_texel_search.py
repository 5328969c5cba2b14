"""The search for a texel against all texels, and neighbours one by one."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.methods.virtual.reflector_texture import ReflectorTexture, texture_of, wider
from ldtrefl.methods.virtual.texel_search import beside, search_texel
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world.device_scene import DeviceScene
from tests.methods.virtual.reflection_on_ball import is_hidden, unit

CAMERA = Camera(eye=(0.0, -5.0, 0.5), look_at=(0.0, 0.0, 0.0), width=120, height=80, fov_y=30.0)


@launch.kernel
def search(
    first: int,
    # In:
    texture: ReflectorTexture,
    eye: wp.vec3d,
    points: wp.array(dtype=wp.vec3d),
    # Out:
    texel_out: wp.array(dtype=wp.int32),
    steps_out: wp.array(dtype=wp.int32),
):
    """Search for one point."""
    i = first + wp.tid()
    found = search_texel(texture, texture.start, eye, points[i])
    texel_out[i] = found.texel
    steps_out[i] = found.steps


@launch.kernel
def list_neighbours(first: int, texture: ReflectorTexture, texels_out: wp.array2d(dtype=wp.int32)):
    """Find one neighbour of an inner texel, and of a corner."""
    number = first + wp.tid()
    texels_out[0, number] = beside(texture, 12, number)
    texels_out[1, number] = beside(texture, 0, number)


def test_neighbours_are_the_eight_those_beside_first() -> None:
    texture = ReflectorTexture()
    texture.width, texture.height = 5, 4
    found = wp.zeros((2, 8), dtype=wp.int32, device=launch.resolve_device(None))
    launch.launch(list_neighbours, 8, [texture, found], found.device)
    inner, corner = found.numpy().tolist()
    assert sorted(inner) == [6, 7, 8, 11, 13, 16, 17, 18] and sorted(inner[:4]) == [7, 11, 13, 17]
    assert corner.count(-1) == 5


def test_on_a_closed_convex_reflector_the_search_finds_the_best_of_all_texels() -> None:
    ball = Object(shape="sphere", params={"segments": [256, 128]}, scale=(1.0, 0.8, 1.2), rotate=(1, 0, 0, 20))
    scene = DeviceScene(Scene(camera=CAMERA, objects=(ball,)), launch.resolve_device(None))
    texture, rng = texture_of(scene, 0, wider(CAMERA, 1.1)), np.random.default_rng(2)
    points = unit(rng.normal(size=(120, 3))) * rng.uniform(1.5, 5.0, (120, 1))
    points = points[~is_hidden(np.array(CAMERA.eye) / 1.2, points / 1.2)]
    matrix = scene.device_from_world
    eye, points = (values @ matrix[:3, :3].T + matrix[:3, 3] for values in (np.array(CAMERA.eye), points))
    found, steps = (wp.zeros(len(points), dtype=wp.int32, device=scene.device) for _ in range(2))
    given = wp.array(points, dtype=wp.vec3d, device=scene.device)
    launch.launch(search, len(points), [texture, wp.vec3d(*eye), given, found, steps], scene.device)
    seen = np.flatnonzero(texture.object.numpy() >= 0)
    at, normal = texture.position.numpy()[seen], texture.normal.numpy()[seen].astype(float)
    best = []
    for point in points:
        bisector = unit(unit(eye - at) + unit(point - at))
        best.append(seen[(bisector * normal).sum(axis=1).argmax()])
    np.testing.assert_array_equal(found.numpy(), best)
    assert steps.numpy().max() <= texture.width + texture.height
