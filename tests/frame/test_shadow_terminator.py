"""The border between light and shade on coarse smooth meshes: at the shading normal's horizon, or the true shadow's.

Directional light of radiance 1 on white objects, unless a test says otherwise.
"""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.frame.shadow_terminator import rise_to_smooth
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Light, Lighting, Material, Object, Scene
from ldtrefl.world.records import ObjectRecord
from tests.frame import flat_mirror

METHODS = [("bvh", {}), ("ldt", {"quality": "exact"}), ("ldt", {"search": "linear"})]
WHITE = Material(albedo=1.0)
LIGHTS = [(1.0, 0.3, 0.5), (0.2, -0.1, 1.0), (0.9, -0.8, -0.3)]
CAMERAS = [(0.7, -4.5, 1.2), (-1.1, -0.7, 0.8), (0.4, -0.5, -3.0)]
PIXELS = 120


def lit(eye: tuple, *objects: Object, light: Light, look_at: tuple = (0, 0, 0), fov_y: float = 40.0) -> Scene:
    """Objects in one light with shadows."""
    return Scene(
        camera=Camera(eye=eye, look_at=look_at, width=PIXELS, height=PIXELS, fov_y=fov_y),
        lighting=Lighting(ambient=(0, 0, 0), shadows=True),
        lights=(light,),
        objects=objects,
    )


def from_afar(towards: tuple[float, ...]) -> Light:
    """Directional light from unit direction ``towards``."""
    return Light(kind="directional", direction=tuple((-unit(np.array(towards))).tolist()), radiance=(1, 1, 1))


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def seen(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(h, w) object, -1 for none, (h, w, 3) position in the world and (h, w, 3) unit shading normal of what is seen."""
    on_device = flat_mirror.on_device(scene)
    gbuffer = draw_gbuffer(on_device, scene.camera)
    position, normal = (values.numpy() for values in gbuffer.surfaces)
    shape = (*gbuffer.shape, 3)
    return (
        gbuffer.objects,
        flat_mirror.in_world(on_device, position).reshape(shape),
        normal.astype(float).reshape(shape),
    )


def radiance(scene: Scene, method: str, options: dict) -> np.ndarray:
    return ldtrefl.render(scene, method, **options).image[..., 0]


@pytest.mark.parametrize(("method", "options"), METHODS, ids=str)
@pytest.mark.parametrize("segments", [(16, 16), (16, 8), (8, 4)], ids=str)
@pytest.mark.parametrize("stretched", [False, True])
def test_a_coarse_sphere_is_lit_up_to_its_normals_horizon(
    stretched: bool, segments: tuple[int, int], method: str, options: dict
) -> None:
    """The cosine with the interpolated normal at every pixel of it: no facet is dark as a whole, none is left out."""
    place = {"scale": (0.7, 1.2, 0.5), "rotate": (1, 2, 3, 50)} if stretched else {}
    ball = Object(shape="sphere", params={"segments": segments}, material=WHITE, **place)
    in_reach = 0
    for towards, eye in zip(LIGHTS, CAMERAS, strict=True):
        scene = lit(eye, ball, light=from_afar(towards))
        objects, _, normal = seen(scene)
        expected = np.maximum(normal @ unit(np.array(towards)), 0.0)
        in_reach += ((expected > 0) & (expected < 0.2) & (objects == 0)).sum()
        got = radiance(scene, method, options)
        np.testing.assert_allclose(got[objects == 0], expected[objects == 0], atol=2e-6)
    assert in_reach > 500


@pytest.mark.parametrize(("method", "options"), METHODS, ids=str)
def test_a_point_light_meets_its_horizon_too(method: str, options: dict) -> None:
    ball = Object(shape="sphere", params={"segments": (16, 8)}, material=WHITE)
    place = np.array([1.5, 0.4, 0.9])
    scene = lit(CAMERAS[0], ball, light=Light(kind="point", position=tuple(place.tolist()), intensity=(1, 1, 1)))
    objects, position, normal = seen(scene)
    way = place - position
    distance = np.linalg.norm(way, axis=-1)
    cosine = (normal * way).sum(axis=-1) / distance
    expected = np.maximum(cosine, 0.0) / distance**2
    assert ((expected > 0) & (cosine < 0.2) & (objects == 0)).sum() > 200
    got = radiance(scene, method, options)
    np.testing.assert_allclose(got[objects == 0], expected[objects == 0], atol=2e-6)


@pytest.mark.parametrize(("method", "options"), METHODS, ids=str)
def test_a_coarse_torus_is_lit_outside(method: str, options: dict) -> None:
    """Its outer half is convex; light along its axis meets the whole upper half."""
    torus = Object(shape="torus", params={"segments": (16, 12)}, material=WHITE)
    along, side, edge, below = (0.0, 0.0, 1.0), (0.7, -4.5, 1.2), (3.5, -1.0, 0.2), (0.4, -2.5, -3.0)
    for towards, eye in [*zip(LIGHTS, (side, edge, below), strict=True), (along, side), (along, edge)]:
        scene = lit(eye, torus, light=from_afar(towards))
        objects, position, normal = seen(scene)
        cosine = normal @ unit(np.array(towards))
        is_free = objects == 0
        if towards != along:
            is_free &= np.hypot(position[..., 0], position[..., 1]) > 1.0
        assert (is_free & (cosine > 0.0)).sum() > 300 and (is_free & (cosine > 0.0) & (cosine < 0.2)).sum() > 30
        got = radiance(scene, method, options)
        np.testing.assert_allclose(got[is_free], np.maximum(cosine, 0.0)[is_free], atol=2e-6)


@pytest.mark.parametrize(("method", "options"), METHODS[:2], ids=str)
def test_the_inside_of_a_coarse_bowl_lies_in_its_true_shadow(method: str, options: dict) -> None:
    """Half a sphere, open above. From a point p inside the way to the light, l, leaves the sphere at p - 2 (p . l) l:
    above the rim the light is free. Points whose way passes within 0.1 of it are left out: 0.05 is as far as the facets
    lie beneath the sphere."""
    ball = shapes.make("sphere", {"segments": (32, 16)})
    is_lower = ball.vertices[ball.faces][..., 2].max(axis=1) < 1e-9
    bowl = Object(mesh=ldtrefl.Mesh(ball.vertices, ball.faces[is_lower], normals=ball.normals), material=WHITE)
    for towards in ((0.9, 0.2, 0.3), (0.3, -0.5, 0.8), (0.95, 0.1, 0.1)):
        way = unit(np.array(towards))
        scene = lit((0.3, -1.2, 3.0), bowl, light=from_afar(towards), look_at=(0, 0, -0.4))
        objects, position, normal = seen(scene)
        is_inside = (objects == 0) & ((normal * position).sum(axis=-1) < 0.0)
        leaves = position - 2 * (position @ way)[..., None] * way
        cosine = normal @ way
        is_light = is_inside & (cosine > 0.0) & (leaves[..., 2] > 0.1)
        is_dark = is_inside & (leaves[..., 2] < -0.1)
        assert is_dark.sum() > 300 and (is_dark & (cosine > 0.0)).sum() > 100
        got = radiance(scene, method, options)
        assert (got[is_dark] == 0.0).all()
        np.testing.assert_allclose(got[is_light], cosine[is_light], atol=2e-6)


@pytest.mark.parametrize(("method", "options"), METHODS[:2], ids=str)
def test_no_light_leaks_over_the_ring_into_a_coarse_torus(method: str, options: dict) -> None:
    """Light along x, which the near half of the ring, 0.35 high, keeps from the inner side of the far half."""
    torus = Object(shape="torus", params={"segments": (16, 12)}, material=WHITE)
    scene = lit((1.5, 0.2, 2.5), torus, light=from_afar((1.0, 0.0, 0.0)), look_at=(-0.7, 0, 0.2), fov_y=25.0)
    objects, position, normal = seen(scene)
    x, y, z = np.moveaxis(position, -1, 0)
    is_dark = (objects == 0) & (x < 0.0) & (np.abs(y) < 0.8) & (np.abs(z) < 0.35 - 1e-3) & (np.hypot(x, y) < 1.0)
    assert (is_dark & (normal[..., 0] > 0.0)).sum() > 1000 and (is_dark & (z > 0.33)).sum() > 30
    np.testing.assert_array_equal(radiance(scene, method, options)[is_dark], 0.0)


def on_floor(ball: ldtrefl.Mesh, half: float, *, in_one_mesh: bool) -> tuple[Object, ...]:
    """A ball of radius 1 that rests on a square floor of half side ``half``."""
    corners = half * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    sides = np.array([[0, 1, 2], [0, 2, 3]])
    raised = ball.vertices + np.array([0, 0, 1])
    if not in_one_mesh:
        return Object(mesh=ldtrefl.Mesh(corners, sides), material=WHITE), Object(
            mesh=ldtrefl.Mesh(raised, ball.faces, normals=ball.normals), material=WHITE
        )
    normals = np.vstack([ball.normals, np.tile([0.0, 0.0, 1.0], (4, 1))])
    vertices, faces = np.vstack([raised, corners]), np.vstack([ball.faces, sides + len(raised)])
    return (Object(mesh=ldtrefl.Mesh(vertices, faces, normals=normals), material=WHITE),)


@pytest.mark.parametrize(("method", "options"), METHODS[:2], ids=str)
@pytest.mark.parametrize("in_one_mesh", [False, True])
def test_no_light_leaks_in_where_a_coarse_ball_touches_its_floor(in_one_mesh: bool, method: str, options: dict) -> None:
    """Light from beneath the floor, which shades all of the ball."""
    objects = on_floor(shapes.make("sphere", {"segments": (8, 4)}), 12.0, in_one_mesh=in_one_mesh)
    for towards in ((1.0, 0.0, -0.3), (0.5, 1.0, -0.2), (0.0, -1.0, -0.4), (0.0, 0.0, -1.0)):
        scene = lit((-3.0, -1.0, 0.1), *objects, light=from_afar(towards), look_at=(0, 0, 0.3), fov_y=20.0)
        numbers, position, _ = seen(scene)
        is_ball = (numbers >= 0) & (position[..., 2] > 1e-4)
        assert is_ball.sum() > 1000
        np.testing.assert_array_equal(radiance(scene, method, options)[is_ball], 0.0)


@pytest.mark.parametrize(("method", "options"), METHODS[:2], ids=str)
@pytest.mark.parametrize("in_one_mesh", [False, True])
def test_the_shadow_of_a_coarse_ball_begins_where_it_touches_its_floor(
    in_one_mesh: bool, method: str, options: dict
) -> None:
    """Light at 45 degrees: the floor is dark where the way to the light comes within 0.9 of the ball's middle, nearer
    than any facet, and lit where it keeps out of the ball's radius."""
    objects = on_floor(shapes.make("sphere", {"segments": (16, 16)}), 12.0, in_one_mesh=in_one_mesh)
    way = unit(np.array([1.0, 0.0, 1.0]))
    scene = lit((-0.5, -3.0, 0.25), *objects, light=from_afar((1.0, 0.0, 1.0)), look_at=(-0.4, 0, 0), fov_y=30.0)
    numbers, position, _ = seen(scene)
    is_floor = (numbers >= 0) & (np.abs(position[..., 2]) < 1e-4)
    offset = position - [0, 0, 1]
    distance = np.linalg.norm(offset - (offset @ way)[..., None] * way, axis=-1)
    is_dark, is_light = is_floor & (distance < 0.9), is_floor & (distance > 1.0 + 1e-6)
    at_contact = is_dark & (np.hypot(position[..., 0], position[..., 1]) < 0.2)
    assert is_dark.sum() > 300 and is_light.sum() > 300 and at_contact.sum() > 10
    got = radiance(scene, method, options)
    assert (got[is_dark] == 0.0).all()
    np.testing.assert_allclose(got[is_light], way[2], rtol=1e-6)


@launch.kernel
def rise_from(
    first: int,
    # In:
    objects: wp.array(dtype=ObjectRecord),
    starts: wp.array(dtype=wp.vec3d),
    outwards: wp.vec3,
    # Out:
    rises_out: wp.array(dtype=wp.vec3),
):
    """Find how far one point of triangle 0 rises."""
    i = first + wp.tid()
    rises_out[i] = rise_to_smooth(objects[0], 0, starts[i], outwards)


def rises(vertices: np.ndarray, normals: np.ndarray, starts: np.ndarray, side: float = 1.0) -> np.ndarray:
    """(n, 3) how far (n, 3) points of a triangle in the plane z = 0 rise, seen from ``side``."""
    mesh = ldtrefl.Mesh(vertices, [[0, 1, 2]], normals=normals)
    scene = flat_mirror.on_device(
        Scene(
            camera=Camera(eye=(0, 0, 9), look_at=(0, 0, 0), up=(0, 1, 0)), objects=(Object(mesh=mesh, material=WHITE),)
        )
    )
    centre, half = mesh.unit_frame
    taken = wp.array((starts - centre) / half, dtype=wp.vec3d)
    found = wp.empty(len(starts), dtype=wp.vec3)
    inputs = [scene.records, taken, wp.vec3(0.0, 0.0, side), found]
    launch.launch(rise_from, len(starts), inputs, scene.device)
    return half * found.numpy()


CORNERS = np.array([[-1.0, -0.6, 0.0], [1.0, -0.6, 0.0], [0.0, 0.6, 0.0]])
POINTS = np.array([[0.0, -0.6, 0.0], [0.5, -0.6, 0.0], [0.0, 0.6, 0.0], [0.0, 0.0, 0.0], [0.2, -0.3, 0.0]])


def tilted(angle: float) -> np.ndarray:
    """(3, 3) normals of the corners, tilted away from the triangle's axis by an angle to the sides of x."""
    x = np.sign(CORNERS[:, 0])
    return np.stack([np.sin(angle) * x, 0 * x, np.where(x == 0, 1.0, np.cos(angle))], 1)


def test_points_rise_to_the_mean_of_the_corners_planes() -> None:
    """On the edge between corners at -1 and 1 whose normals lean out by an angle: by (1 - x^2) sin(angle) cos(angle)
    along z. In the triangle the third corner, whose plane is the triangle's, takes its part."""
    angle = 0.4
    expected = (1 - POINTS[:2, 0] ** 2) * np.sin(angle) * np.cos(angle)
    found = rises(CORNERS, tilted(angle), POINTS)
    np.testing.assert_allclose(found[:2, 2], expected, atol=1e-6)
    np.testing.assert_allclose(found[0, :2], 0.0, atol=1e-6)
    np.testing.assert_allclose(found[2], 0.0, atol=1e-6)
    # At the middle each of the two others has a quarter, and lies 1 away along x.
    np.testing.assert_allclose(found[3], [0, 0, 0.5 * np.sin(angle) * np.cos(angle)], atol=1e-6)
    assert (found[[0, 1, 3, 4], 2] > 0.05).all()


def test_only_the_direction_of_a_corners_normal_counts() -> None:
    """Its length and its sign do not. Seen from the hollow side nothing rises, nor where no normal is known."""
    normals = tilted(0.4)
    expected = rises(CORNERS, normals, POINTS)
    np.testing.assert_allclose(rises(CORNERS, [[3.0], [0.01], [1.0]] * normals, POINTS), expected, atol=1e-6)
    np.testing.assert_allclose(rises(CORNERS, -normals, POINTS), expected, atol=1e-6)
    np.testing.assert_array_equal(rises(CORNERS, normals, POINTS, side=-1.0), 0.0)
    np.testing.assert_array_equal(rises(CORNERS, tilted(-0.4), POINTS), 0.0)
    np.testing.assert_array_equal(rises(CORNERS, np.zeros((3, 3)), POINTS), 0.0)
    np.testing.assert_array_equal(rises(CORNERS, tilted(0.0), POINTS), 0.0)
