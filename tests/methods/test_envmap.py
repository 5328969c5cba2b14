"""Environment mapping: faces and their axes, what is far away against closed forms, and cube maps that follow moves."""

import dataclasses

import numpy as np
import pytest
import warp as wp
from stress_cases.histories import difference

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.device import launch
from ldtrefl.methods.envmap import reflect_cube
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene
from ldtrefl.tracing.ray_buffers import empty_rays
from tests.frame import flat_mirror
from tests.frame_scenes import scene

FORWARD = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
UP = np.array([[0, 0, 1]] * 4 + [[0, 1, 0]] * 2, float)
"""Of the cameras of the six faces."""

CAMERA = Camera(eye=(0.5, -4.0, 1.0), look_at=(0, 0, 0), width=60, height=40, fov_y=40)
BALL = Object(shape="sphere", material=Material(albedo=0.0, mirror=1.0))


def ball_scene(*others: Object, **changes: object) -> Scene:
    """The mirror ball and other objects."""
    return Scene(camera=CAMERA, objects=(BALL, *others), **changes)


def looked_up(cube: np.ndarray, resolution: int, directions: np.ndarray) -> np.ndarray:
    """(n, 3) what rays of reflector 0 find in a cube map."""
    device, count = launch.resolve_device(None), len(directions)
    rays = empty_rays(count, device)
    rays.direction = wp.array(directions.astype(np.float32), dtype=wp.vec3, device=device)
    rays.source.fill_(0)
    radiance = wp.zeros(count, dtype=wp.vec3, device=device)
    inputs = [rays, 0, wp.array(cube, dtype=wp.vec3, device=device), resolution, radiance]
    launch.launch(reflect_cube, count, inputs, device)
    return radiance.numpy()


def test_a_cube_map_is_read_where_its_cameras_looked() -> None:
    """Every pixel holds its own direction, at depth 1: bilinear reading is exact but at a face's border."""
    resolution = 16
    y, x = (np.mgrid[:resolution, :resolution] + 0.5) / resolution * 2 - 1
    right = np.cross(FORWARD, UP)
    cube = FORWARD[:, None, None] + x[..., None] * right[:, None, None] - y[..., None] * UP[:, None, None]
    directions = np.random.default_rng(4).normal(size=(2000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    at_depth_1 = directions / np.abs(directions).max(axis=1, keepdims=True)
    inner = np.sort(np.abs(at_depth_1), axis=1)[:, 1] < 1 - 1 / resolution
    found = looked_up(cube.reshape(-1, 3).astype(np.float32), resolution, directions)
    assert inner.sum() > 1000
    np.testing.assert_allclose(found[inner], at_depth_1[inner], atol=1e-5)
    # Beyond the outermost centres the border's pixel is taken: half a pixel off at most.
    np.testing.assert_allclose(found, at_depth_1, atol=1.001 / resolution)


def test_rays_of_other_reflectors_are_left_alone() -> None:
    device = launch.resolve_device(None)
    rays, cube = empty_rays(2, device), wp.array(np.ones((6, 3), np.float32), dtype=wp.vec3, device=device)
    rays.direction = wp.array([(1, 0, 0), (1, 0, 0)], dtype=wp.vec3, device=device)
    rays.source = wp.array([3, 5], dtype=wp.int32, device=device)
    radiance = wp.array([(7, 7, 7), (7, 7, 7)], dtype=wp.vec3, device=device)
    launch.launch(reflect_cube, 2, [rays, 5, cube, 1, radiance], device)
    assert radiance.numpy().tolist() == [[7, 7, 7], [1, 1, 1]]


def test_what_is_infinitely_far_is_right() -> None:
    """A flat mirror alone under the environment: a blend by height, which bilinear reading is a pixel off at most."""
    given = flat_mirror.scene()
    alone = dataclasses.replace(given, objects=given.objects[:1])
    frame = ldtrefl.render(alone, "envmap", resolution=256)
    rays = flat_mirror.reflection(flat_mirror.scene(place=(0.0, 0.0, 90.0)))
    expected = flat_mirror.environment(rays.direction)
    np.testing.assert_allclose(frame.reflection.reshape(-1, 3)[rays.pixels], expected, atol=1.0 / 256)
    assert frame.hits is None and "cubemap" in frame.stats.seconds


def test_a_wall_is_reflected_by_direction_alone() -> None:
    """The wall at x = 3 fills a cone about +x from the mirror's centre, wherever on the mirror it is looked at from."""
    given = flat_mirror.scene(environment=Environment(sky=(0, 0, 0), ground=(0, 0, 0)))
    glow = Material(albedo=0.0, emission=(1.0, 2.0, 3.0))
    wall = Object(shape="plane", rotate=(0, 1, 0, -90), translate=(3, 0, 0), material=glow)
    camera = dataclasses.replace(given.camera, eye=(-5.0, 0.1, 1.0), look_at=(0.0, 0.0, 0.0))
    frame = ldtrefl.render(dataclasses.replace(given, camera=camera, objects=(given.objects[0], wall)), "envmap")
    rays = flat_mirror.reflection(flat_mirror.scene(place=(0.0, 0.0, 90.0), camera=camera))
    at_wall = 3.0 * rays.direction / rays.direction[:, :1]
    aside = np.abs(at_wall[:, 1:]).max(axis=1)
    seen = frame.reflection.reshape(-1, 3)[rays.pixels]
    inside, outside = (rays.direction[:, 0] > 0) & (aside < 0.97), (rays.direction[:, 0] < 0) | (aside > 1.03)
    assert inside.sum() > 50 and outside.sum() > 50
    np.testing.assert_allclose(seen[inside], np.tile([1.0, 2.0, 3.0], (inside.sum(), 1)), rtol=1e-6)
    assert (seen[outside] == 0.0).all()


def test_cube_maps_that_need_too_much_memory_are_refused() -> None:
    renderer = ldtrefl.Renderer(flat_mirror.scene(), "envmap", resolution=4096)
    budget.set_memory_limit(1 << 30)
    with pytest.raises(ldtrefl.InputError, match=r"^1 cube maps of 6 x 4096 x 4096 pixels needs? .*resolution"):
        renderer.render()


def test_environment_maps_follow_a_move() -> None:
    renderer = ldtrefl.Renderer(scene(), "envmap")
    renderer.render()
    renderer.move("torus", translate=(-1.2, -1.4, 0.4))
    np.testing.assert_array_equal(renderer.render().image, ldtrefl.render(renderer.scene, "envmap").image)


def test_environment_maps_turn_with_the_camera() -> None:
    given_scene = scene()
    renderer = ldtrefl.Renderer(given_scene, "envmap", resolution=64)
    renderer.render()
    turned = dataclasses.replace(given_scene.camera, up=(1.0, 0.0, 0.5))
    assert (
        difference(renderer.render(turned), ldtrefl.Renderer(given_scene, "envmap", resolution=64).render(turned)) == ""
    )


def test_a_far_object_is_reflected_in_its_place_and_a_near_one_is_not() -> None:
    """A glowing ball as large from the mirror's centre, a thousand sizes away and next to the mirror."""
    dark = {"environment": Environment(sky=(0, 0, 0), ground=(0, 0, 0)), "lighting": Lighting(ambient=0.0)}
    wrong = []
    for distance in (1000.0, 1.6):
        glow = Material(albedo=0.0, emission=1.0)
        lamp = Object(shape="sphere", scale=0.3 * distance, translate=(distance, 0.0, 0.0), material=glow)
        truth, mapped = (ldtrefl.render(ball_scene(lamp, **dark), method) for method in ("bvh", "envmap"))
        shown = truth.reflection[..., 0] > 0.5
        assert shown.sum() > 5
        wrong.append((shown != (mapped.reflection[..., 0] > 0.5)).sum() / shown.sum())
    assert wrong[0] < 0.15 < 0.5 < wrong[1], wrong


@pytest.mark.parametrize("resolution", [0, 4097, 12.5])
def test_a_resolution_that_is_none_is_refused(resolution: object) -> None:
    with pytest.raises(ldtrefl.InputError, match=r"^method envmap: resolution: "):
        ldtrefl.Renderer(ball_scene(), "envmap", resolution=resolution)
