"""Shapes of lights: rays that meet them, points that are nearest to rays, and solid angles."""

import dataclasses

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene
from ldtrefl.shading.light_shapes import nearest_in_light, solid_angle
from ldtrefl.world.records import ShapedLightRecord
from ldtrefl.world.shaped_lights import shaped_light

BALL = Light(kind="sphere", position=(0.3, 0.2, 2.0), radius=0.5, radiance=(5, 6, 7))
SHEET = Light(kind="rectangle", position=(0.3, 0.2, 2.0), direction=(0.2, 0.1, -1), width=1.5, height=0.8, radiance=4.0)
DARK = {"environment": Environment(sky=0.0, ground=0.0), "lighting": Lighting(ambient=0.0)}
UP = Camera(eye=(0, 0, 0), look_at=(0, 0, 1), up=(0, 1, 0), width=96, height=80, fov_y=70)


def directions(camera: Camera) -> np.ndarray:
    """(h, w, 3) unit directions through pixel centres of a camera in 0 that looks along z, with y up."""
    half = np.tan(np.radians(camera.fov_y) / 2.0)
    x = -(2.0 * (np.arange(camera.width) + 0.5) / camera.width - 1.0) * half * camera.width / camera.height
    y = (1.0 - 2.0 * (np.arange(camera.height) + 0.5) / camera.height) * half
    way = np.stack([*np.broadcast_arrays(x[None, :], y[:, None]), np.ones((camera.height, camera.width))], axis=-1)
    return way / np.linalg.norm(way, axis=2, keepdims=True)


def meets(light: Light, way: np.ndarray) -> np.ndarray:
    """Whether rays from 0 meet a light."""
    if light.radius is not None:
        return np.linalg.norm(np.cross(way, light.position), axis=-1) < light.radius
    right, up, axis = light.axes
    at = (np.array(light.position) @ axis / (way @ axis))[..., None] * way - light.position
    return (way @ axis < 0) & (np.abs(at @ right) < light.width / 2) & (np.abs(at @ up) < light.height / 2)


@pytest.mark.parametrize("light", [BALL, SHEET], ids=["sphere", "rectangle"])
@pytest.mark.parametrize("method", ["bvh", "envmap"])
def test_the_camera_sees_their_shapes(light: Light, method: str) -> None:
    """Before nothing, before a wall and before a mirror; not behind a wall, from behind, nor if they are not to be."""
    is_seen = meets(light, directions(UP))
    assert 100 < is_seen.sum() < 3000
    expected = np.where(is_seen[..., None], np.array(light.radiance, np.float32), np.float32(0.0))
    wall = Object(shape="box", scale=(9, 9, 0.1), translate=(0, 0, 4), material=Material(albedo=0.0))
    mirror = dataclasses.replace(wall, material=Material(mirror=1.0))
    before = dataclasses.replace(wall, translate=(0, 0, 1.0))
    for objects in ((), (wall,), (mirror,)):
        made = Scene(camera=UP, lights=(light,), objects=objects, **DARK)
        image = ldtrefl.render(made, method).image
        if mirror in objects:  # it shows the other side of a sphere, and nothing of a rectangle
            image, wanted = image[is_seen], expected[is_seen]
            np.testing.assert_array_equal(image, wanted)
        else:
            np.testing.assert_array_equal(image, expected)
    assert not ldtrefl.render(Scene(camera=UP, lights=(light,), objects=(before,), **DARK), method).image.any()
    hidden = dataclasses.replace(light, visible=False)
    assert not ldtrefl.render(Scene(camera=UP, lights=(hidden,), **DARK), method).image.any()
    if light.direction is not None:
        turned = dataclasses.replace(light, direction=tuple(-np.array(light.direction)))
        assert not ldtrefl.render(Scene(camera=UP, lights=(turned,), **DARK), method).image.any()


@pytest.mark.parametrize("light", [BALL, SHEET], ids=["sphere", "rectangle"])
@pytest.mark.parametrize("method", ["ldt", "bvh"])
def test_a_flat_mirror_shows_what_a_mirrored_camera_would_see(light: Light, method: str) -> None:
    """By one bounce and by two; a box in between hides it from both."""
    floor = Object(shape="plane", scale=50.0, material=Material(mirror=0.5))
    camera = Camera(eye=(0.5, -3, 1.0), look_at=(0.3, 0, 0.5), width=96, height=64, fov_y=80)
    post = Object(shape="box", scale=(0.2, 0.1, 9), translate=(0.2, -0.3, 0), material=Material(albedo=0.0))
    image = ldtrefl.render(Scene(camera=camera, lights=(light,), objects=(floor, post), **DARK), method).image
    below = dataclasses.replace(light, position=(*light.position[:2], -light.position[2]))
    if light.direction is not None:
        below = dataclasses.replace(below, direction=(*light.direction[:2], -light.direction[2]))
        up = light.axes[1] * [1, 1, -1]
        below = dataclasses.replace(below, up=tuple(up))
    direct = ldtrefl.render(Scene(camera=camera, lights=(light,), objects=(post,), **DARK), method).image
    mirrored = ldtrefl.render(Scene(camera=camera, lights=(below,), objects=(post,), **DARK), method).image
    # What is above the horizon is seen directly: the mirror fills all below it.
    expected = np.where(direct > 0.0, direct, 0.5 * mirrored)
    assert (mirrored > 0.0).any(axis=2).sum() > 20
    differs = np.abs(image - expected).max(axis=2) > 1e-6
    assert differs.sum() <= 2, differs.sum()  # at edges rounding decides


@launch.kernel
def look_at_light(
    first: int,
    # In:
    light: ShapedLightRecord,
    offset: wp.vec3,
    ways: wp.array(dtype=wp.vec3),
    # Out:
    nearest_out: wp.array(dtype=wp.vec3),
    solid_out: wp.array(dtype=float),
):
    """Each thread looks along one direction."""
    i = first + wp.tid()
    nearest_out[i] = nearest_in_light(light, offset, ways[i])
    solid_out[i] = solid_angle(light, offset)


def looked_at(light: Light, ways: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The nearest directions and the solid angle, from 0."""
    cpu = launch.resolve_device(None)
    found = [wp.zeros(len(ways), dtype=dtype, device=cpu) for dtype in (wp.vec3, float)]
    given = [shaped_light(light, np.eye(4)), wp.vec3(*light.position), wp.array(ways, dtype=wp.vec3, device=cpu)]
    launch.launch(look_at_light, len(ways), [*given, *found], cpu)
    nearest, solid = (array.numpy() for array in found)
    return nearest, solid


@pytest.mark.parametrize("light", [BALL, SHEET], ids=["sphere", "rectangle"])
def test_what_is_nearest_to_a_ray_that_meets_the_light_is_where_it_meets_it(light: Light) -> None:
    camera = dataclasses.replace(UP, width=400, height=400, fov_y=120)
    ways = directions(camera).reshape(-1, 3)
    nearest, solid = looked_at(light, ways)
    inside = meets(light, ways)
    np.testing.assert_allclose(np.linalg.norm(nearest, axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(nearest[inside], ways[inside], atol=1e-6)
    inwards = nearest * (1 - 1e-5) + np.array(light.position) / np.linalg.norm(light.position) * 1e-5
    assert meets(light, inwards / np.linalg.norm(inwards, axis=1, keepdims=True)).all()
    # A pixel covers its cosine cubed of a solid angle.
    pixel = (2.0 * np.tan(np.radians(camera.fov_y) / 2.0) / camera.height) ** 2
    assert solid[0] == pytest.approx(float((pixel * ways[inside, 2] ** 3).sum()), rel=0.01)
