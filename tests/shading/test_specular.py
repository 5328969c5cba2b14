"""Fresnel reflectance against Schlick's formula; reflected directions against closed forms and a search over angles."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Material, Object, Scene
from ldtrefl.shading.specular import mirror_direction, mirrored, schlick
from tests.shading.facets import NO_LIGHT, SIZES, TURNS, Facet

WHITE = Material(albedo=0.0, mirror=1.0)
ROUNDED = 1e-6
"""How far apart two directions may be by rounding."""


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_fresnel_is_schlicks(turn: tuple, size: object) -> None:
    white = Environment(sky=(1, 1, 1), ground=(1, 1, 1))
    for degrees in (0.0, 30.0, 60.0, 80.0):
        mirror = Material(albedo=(0, 0, 0), mirror=(0.04, 0.5, 1.0), fresnel=True)
        base = np.array([0.04, 0.5, 1.0])
        expected = base + (1 - base) * (1 - np.cos(np.radians(degrees))) ** 5
        for method in ("bvh", "ldt"):
            image = Facet(turn, size, degrees).seen(mirror, method, environment=white)
            np.testing.assert_allclose(image, expected, rtol=2e-4)


def test_schlick_goes_from_the_reflectance_to_1() -> None:
    base = wp.vec3(0.04, 0.5, 1.0)
    np.testing.assert_allclose(schlick(base, 1.0), base)
    np.testing.assert_allclose(schlick(base, 0.0), (1.0, 1.0, 1.0))
    np.testing.assert_allclose(schlick(base, -0.5), (1.0, 1.0, 1.0))
    np.testing.assert_allclose(schlick(base, 0.5)[0], 0.04 + 0.96 * 0.5**5, rtol=1e-6)


@launch.kernel
def mirror_both_ways(
    first: int,
    # In:
    directions: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
    facets: wp.array(dtype=wp.vec3),
    # Out:
    bent_out: wp.array(dtype=wp.vec3),
    plain_out: wp.array(dtype=wp.vec3),
):
    """Mirror one direction, with the facet and without it."""
    i = first + wp.tid()
    bent_out[i] = mirror_direction(directions[i], normals[i], facets[i])
    plain_out[i] = mirrored(directions[i], normals[i])


def reflected(directions: np.ndarray, normals: np.ndarray, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) float32 rays that leave above their facets, and those that the normals alone give."""
    count, device = max(len(each) for each in (directions, normals, facets)), launch.resolve_device(None)
    given = [
        np.ascontiguousarray(np.broadcast_to(each, (count, 3)), np.float32) for each in (directions, normals, facets)
    ]
    made = [wp.empty(count, dtype=wp.vec3, device=device) for _ in range(2)]
    launch.launch(mirror_both_ways, count, [*(wp.array(each, dtype=wp.vec3) for each in given), *made], device)
    return made[0].numpy(), made[1].numpy()


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (np.asarray(a, float) * b).sum(axis=-1)


def random_surfaces(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n, 3) float32 directions, normals and facets: views down to grazing ones, normals up to 90 degrees away."""
    rng = np.random.default_rng(7)
    facets = unit(rng.normal(size=(count, 3)))
    along = unit(np.cross(facets, unit(rng.normal(size=(count, 3)))))
    height = np.where(np.arange(count) % 2, rng.uniform(0, 1, count), 10 ** rng.uniform(-5, 0, count))
    to_viewer = height[:, None] * facets + np.sqrt(1 - height**2)[:, None] * along
    across = unit(np.cross(facets, unit(rng.normal(size=(count, 3)))))
    angle = rng.uniform(0, np.pi / 2, count)[:, None]
    normals = np.cos(angle) * facets + np.sin(angle) * across
    return tuple(each.astype(np.float32) for each in (-to_viewer, normals, facets))


def least_rise(directions: np.ndarray, facets: np.ndarray) -> np.ndarray:
    return np.minimum(0.9 * -dot(directions, facets), 0.01)


def test_a_valid_ray_keeps_its_bits_and_any_other_rises_just_enough() -> None:
    directions, normals, facets = random_surfaces(200_000)
    bent, plain = reflected(directions, normals, facets)
    least, rise, was = least_rise(directions, facets), dot(bent, facets), dot(plain, facets)
    assert (was < least).sum() > 50_000 and (was > least).sum() > 50_000
    np.testing.assert_array_equal(bent[was > least + ROUNDED], plain[was > least + ROUNDED])
    is_bent = was < least - ROUNDED
    np.testing.assert_allclose(rise[is_bent], least[is_bent], rtol=0, atol=ROUNDED)
    assert rise.min() > 0.0
    np.testing.assert_allclose(np.linalg.norm(bent, axis=1), 1.0, atol=ROUNDED)


def test_no_smaller_bend_would_do() -> None:
    """Of all normals between the facet's and the shading normal the one nearest to the latter is taken whose ray rises
    enough; found by trying 20,001 of them in float64."""
    directions, normals, facets = random_surfaces(300)
    bent, _ = reflected(directions, normals, facets)
    least, changed = least_rise(directions, facets), 0
    for i, (direction, normal) in enumerate(zip(unit(directions.astype(float)), normals.astype(float), strict=True)):
        facet = unit(facets[i].astype(float))
        across = unit(normal - dot(normal, facet) * facet)
        most = np.arctan2(dot(normal, across), dot(normal, facet))
        angles = np.linspace(0.0, most, 20_001)
        tried = np.sin(angles)[:, None] * across + np.cos(angles)[:, None] * facet
        rays = direction - 2 * (tried @ direction)[:, None] * tried
        best = np.flatnonzero(rays @ facet >= least[i])[-1]
        changed += best < 20_000
        # A ray turns at twice the speed of its normal.
        assert np.linalg.norm(rays[best] - bent[i]) < 2 * most / 20_000 + 5 * ROUNDED
    assert changed > 50


@pytest.mark.parametrize("height", [0.7, 0.1, 1e-3, 1e-5])
@pytest.mark.parametrize("turn", [0.0, 50.0, 90.0, 170.0])
def test_the_ray_moves_continuously_with_the_normal(height: float, turn: float) -> None:
    """Normals sweep from the facet's to 89 degrees away, once straight from it and once around it."""
    facet, azimuth = np.array([0.0, 0.0, 1.0]), np.radians(turn)
    across = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    direction = -np.array([np.sqrt(1 - height**2), 0.0, height])
    tilts = np.radians(np.linspace(0.0, 89.0, 100_001))[:, None]
    straight = np.sin(tilts) * across + np.cos(tilts) * facet
    around = np.radians(np.linspace(0.0, 360.0, 100_001))[:, None]
    for tilt in (1e-6, 1e-4, 1e-3, 0.01, 0.1, 0.5, 1.0, 1.5):
        circle = np.cos(around) * [np.sin(tilt), 0, 0] + np.sin(around) * [0, np.sin(tilt), 0] + [0, 0, np.cos(tilt)]
        for normals in (straight, circle):
            bent, plain = reflected(direction, normals, facet)
            step = np.linalg.norm(np.diff(normals, axis=0), axis=1)
            moved, plainly = (np.linalg.norm(np.diff(rays.astype(float), axis=0), axis=1) for rays in (bent, plain))
            assert (plainly <= 2 * step + ROUNDED).all()  # what any mirror does
            assert (moved <= 4 * step + ROUNDED).all(), f"{(moved / step).max()} steps at a tilt of {tilt}"


def test_what_is_not_defined_gives_a_ray_above_the_facet() -> None:
    """Edge on, the eye in the surface, a normal along the facet or on its other side; no facet at all is finite."""
    up, x, y = np.eye(3)[2], np.eye(3)[0], np.eye(3)[1]
    cases = [
        (x, up),  # edge on
        (x, unit(up + x)),
        (x, unit(up - x)),
        (x, unit(up + y)),
        (x, x),
        (x, y),
        (0 * x, up),  # the eye in the surface
        (0 * x, unit(up + x)),
        (0 * x, x),
        (-up, up),  # straight down
        (-up, x),
        (unit(x - up), x),  # along the facet
        (unit(x - up), -x),
        (unit(x - up), unit(-up + 3 * x)),  # beneath it
        (unit(x - up), unit(-up - 3 * x)),
        (unit(x - up), -up),
        (unit(x + 1e-6 * up), up),  # seen from beneath, by rounding
    ]
    for direction, normal in cases:
        bent, _ = reflected(direction[None], normal[None], up[None])
        assert bent[0, 2] > 0.0 and abs(np.linalg.norm(bent) - 1.0) < ROUNDED, (direction, normal, bent)
        assert np.isfinite(reflected(direction[None], normal[None], np.zeros((1, 3)))[0]).all(), (direction, normal)


CAMERAS = {
    "from the side": ((0.0, -4.0, 0.0), (0.0, 0.0, 0.0)),
    "from above": ((0.4, -1.0, 3.0), (0.0, 0.0, 0.0)),
    "grazing": ((0.98, -0.6, 0.05), (0.9, 0.3, 0.0)),
    "grazing from above": ((-0.8, -0.5, 0.96), (0.1, 0.3, 0.93)),
}


@pytest.mark.parametrize("method", ["bvh", "ldt"])
@pytest.mark.parametrize("camera", CAMERAS)
def test_no_ray_of_a_coarse_mirror_sphere_starts_into_its_own_facet(camera: str, method: str) -> None:
    """Ten segments around, five from pole to pole. The facets are the mesh's in float64."""
    mesh = shapes.make("sphere", {"segments": [10, 5]})
    eye, look_at = CAMERAS[camera]
    scene = Scene(
        camera=Camera(eye=eye, look_at=look_at, width=160, height=120, fov_y=50),
        objects=(Object(mesh=mesh, material=WHITE), Object(shape="box", translate=(0, 0, 9))),
    )
    rays = ldtrefl.render(scene, method).hits.rays
    facets, to_eye = facets_of(mesh, np.array(eye))
    triangle, direction = rays.source_triangle.numpy(), rays.direction.numpy()
    assert len(triangle) > 2000 and len(np.unique(triangle)) > 1 and (rays.source.numpy() == 0).all()
    rise = dot(direction, facets[triangle])
    assert rise.min() > 0.0, f"{(rise <= 0.0).sum()} of {len(rise)} rays"
    assert (to_eye[triangle] > 0.0).all()


def facets_of(mesh: ldtrefl.Mesh, eye: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(m, 3) unit normals of a mesh's triangles on the side of the eye, and (m,) its height above their planes."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normals = unit(np.cross(b - a, c - a))
    height = dot(normals, eye - a)
    return np.sign(height)[:, None] * normals, np.abs(height)


@pytest.mark.parametrize("method", ["bvh", "ldt"])
@pytest.mark.parametrize("bounces", [0, 1, 2])
def test_a_floor_with_tilted_normals_mirrors_what_is_just_above_it(bounces: int, method: str) -> None:
    """It is seen from 20 degrees above, or in a wall (1: the last bounce). Normals that are tilted away by 15 degrees
    would mirror that 10 degrees into the floor."""
    tilt, height = np.radians(15.0), np.radians(20.0)
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    normals = np.tile([np.sin(tilt), 0.0, np.cos(tilt)], (4, 1))
    floor = Object(mesh=ldtrefl.Mesh(corners, [[0, 1, 2], [0, 2, 3]], normals=normals), material=WHITE)
    wall = Object(shape="plane", scale=4.0, rotate=(0, 1, 0, 90), translate=(-3, 0, 0), material=WHITE)
    way = np.array([np.cos(height), 0.0, -np.sin(height)])
    look_at, eye = np.zeros(3), -2.5 * way
    if bounces:
        look_at = -3 / np.cos(height) * way
        eye = look_at + 2.0 * way * [1, 1, -1]
    scene = Scene(
        camera=Camera(eye=tuple(eye.tolist()), look_at=tuple(look_at.tolist()), width=1, height=1, fov_y=0.01),
        environment=Environment(sky=(1, 1, 1), ground=(0, 0, 0)),
        lighting=NO_LIGHT,
        objects=(floor, wall),
    )
    image = ldtrefl.render(scene, method, max_bounces=max(bounces, 1)).image
    np.testing.assert_allclose(image, 0.5 + 0.5 * 0.01, rtol=1e-5)
