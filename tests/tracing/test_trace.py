"""Tracing: the ray caster against Embree, layered depth textures against the ray caster, and rays of any form."""

from collections.abc import Callable

import numpy as np
import pytest
import warp as wp
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.scene import shapes
from tests.conftest import REAL_MESHES

SHAPES = tuple(name for name in shapes.names())

# Wrong hits and wrong misses allowed to the paper's search at 256 with 512 samples, in percent of true hits. Wires are
# thinner than a texel, where a block of a texel is no approximation at all.
LIMITS = dict.fromkeys([*SHAPES, *REAL_MESHES], (2.5, 0.1)) | {"wires": (25.0, 1.0)}

# The same with one sample for each texel passed: the dish's wall is a texel thick, and some rays step over it.
LIMITS_BY_TEXEL = LIMITS | {"dish_with_olives.glb": (2.5, 0.6)}


@pytest.mark.parametrize("name", [*SHAPES, *REAL_MESHES])
def test_raycaster_agrees_with_embree(mesh_or_shape: Callable, name: str) -> None:
    mesh = mesh_or_shape(name)
    vertices, count = mesh.unit_vertices, 200_000
    origins, directions = rays_about(ldtrefl.Mesh(vertices, mesh.faces), count)
    embree = rtcore_scene.EmbreeScene(robust=True)
    TriangleMesh(embree, vertices[mesh.faces])
    truth = embree.run(origins, directions, output=1)
    hits = ldtrefl.Raycaster(vertices, mesh.faces).trace(origins, directions)
    hit, true_hit = hits.triangle >= 0, truth["primID"] >= 0
    # A ray through a vertex at grazing angle may pass one tracer's triangle and meet the next surface: that counts as
    # a disagreement too. The unit cube is 2 wide.
    apart = np.zeros(count, bool)
    both = hit & true_hit
    apart[both] = np.abs(hits.t[both] - truth["tfar"][both]) > 2e-4
    wrong = int(((hit != true_hit) | apart).sum())
    assert wrong <= count // 100_000, f"{name}: {wrong} of {count} rays disagree"


@pytest.mark.parametrize(("linear_steps", "limits"), [(512, LIMITS), ("texel", LIMITS_BY_TEXEL)])
@pytest.mark.parametrize("name", [*SHAPES, *REAL_MESHES])
def test_linear_search_agrees_with_the_raycaster(
    mesh_or_shape: Callable, name: str, linear_steps: int | str, limits: dict[str, tuple[float, float]]
) -> None:
    mesh = mesh_or_shape(name)
    origins, directions = rays_about(mesh, 20_000, seed=2)
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, search="linear")
    hits = maps.trace(origins, directions, search="linear", linear_steps=linear_steps)
    truth = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, directions)
    hit, true_hit = hits.triangle >= 0, truth.triangle >= 0
    wrong_hits, wrong_misses = (100.0 * x.sum() / true_hit.sum() for x in (hit & ~true_hit, true_hit & ~hit))
    errors = np.abs(hits.t[hit & true_hit] - truth.t[hit & true_hit])
    texel = (mesh.bounds[1] - mesh.bounds[0]).max() / 256
    median = np.median(errors) / texel
    found = f"{name}: wrong hits {wrong_hits:.2f}%, wrong misses {wrong_misses:.2f}%, median {median:.3f} texels"
    assert wrong_hits <= limits[name][0] and wrong_misses <= limits[name][1] and median <= 0.75, found


class LinearMaps:
    """A layered depth texture traced by the paper's search."""

    def __init__(self, mesh: ldtrefl.Mesh) -> None:
        self.maps = ldtrefl.peel(mesh.vertices, mesh.faces, search="linear")

    def trace(self, origins: np.ndarray, directions: np.ndarray) -> ldtrefl.Hits:
        return self.maps.trace(origins, directions, search="linear")


def all_tracers(mesh: ldtrefl.Mesh) -> list:
    return [
        LinearMaps(mesh),
        ldtrefl.peel(mesh.vertices, mesh.faces),
        ldtrefl.Raycaster(mesh.vertices, mesh.faces),
    ]


def test_direction_length_scales_t() -> None:
    origins, directions = rays_about(shapes.make("torus"), 2000)
    for tracer in all_tracers(shapes.make("torus")):
        unit = tracer.trace(origins, directions)
        for length in (2.0**-66, 2.0**-10, 4.0, 2.0**60):  # which round no direction
            scaled = tracer.trace(origins, directions * np.float32(length))
            np.testing.assert_array_equal(scaled.triangle, unit.triangle)
            np.testing.assert_array_equal(scaled.t, unit.t / np.float32(length))


def test_rays_that_are_none_miss_and_are_counted() -> None:
    odd = np.array([[0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 0], [0, 0, 1]], np.float32)
    origins = np.array([[0, 0, -5]] * 4, np.float32)
    for tracer in all_tracers(shapes.make("box")):
        hits = tracer.trace(origins, odd)
        assert np.isposinf(hits.t[:3]).all() and (hits.triangle[:3] == -1).all()
        assert hits.t[3] == pytest.approx(4.0, abs=1e-3)
        assert hits.invalid == 3
        nowhere = tracer.trace(np.full((1, 3), np.nan, np.float32), odd[3:])
        assert nowhere.triangle[0] == -1 and nowhere.invalid == 1


def test_axis_parallel_rays_with_either_zero() -> None:
    mesh = shapes.make("box")
    for tracer in all_tracers(mesh):
        for zero in (0.0, -0.0):
            for axis in range(3):
                for sign in (1.0, -1.0):
                    direction = np.full(3, zero, np.float32)
                    direction[axis] = sign
                    origin = np.full(3, 0.3, np.float32)
                    origin[axis] = -4 * sign
                    hits = tracer.trace(origin[None], direction[None])
                    assert hits.t[0] == pytest.approx(3.0, abs=1e-3)


def test_from_within_a_room_every_ray_hits_a_wall() -> None:
    rng = np.random.default_rng(0)
    origins = rng.uniform(-0.9, 0.9, (5000, 3)).astype(np.float32)
    directions = rng.normal(size=(5000, 3)).astype(np.float32)
    linear, exact, bvh = (tracer.trace(origins, directions) for tracer in all_tracers(shapes.make("room")))
    assert (bvh.triangle >= 0).all() and (exact.triangle >= 0).all()
    np.testing.assert_allclose(exact.t, bvh.t, rtol=1e-4)
    assert (linear.triangle >= 0).mean() > 0.999
    np.testing.assert_allclose(np.median(np.abs(linear.t - bvh.t)), 0.0, atol=0.01)


def test_open_sheets_are_hit_from_both_sides_and_hollows_stay_hollow() -> None:
    mesh = shapes.make("bowl", {"closed": False})
    origins, directions = rays_about(mesh, 20_000, seed=3)
    linear, exact, bvh = (tracer.trace(origins, directions).triangle >= 0 for tracer in all_tracers(mesh))
    assert (linear != bvh).sum() <= 0.02 * bvh.sum()
    assert (exact != bvh).sum() == 0


def test_warp_arrays_in_warp_arrays_out() -> None:
    origins, directions = rays_about(shapes.make("torus"), 100)
    for tracer in all_tracers(shapes.make("torus")):
        expected = tracer.trace(origins, directions)
        hits = tracer.trace(*(wp.array(x, dtype=wp.vec3, device="cpu") for x in (origins, directions)))
        assert isinstance(hits.t, wp.array)
        np.testing.assert_array_equal(hits.t.numpy(), expected.t)


def test_barycentrics_and_normal_are_the_hit_triangles() -> None:
    mesh = shapes.make("genus3", {"grid": 32})
    origins, directions = rays_about(mesh, 2000)
    hits = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, directions)
    hit = hits.triangle >= 0
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces[hits.triangle[hit]]], 1, 0)
    u, v = hits.barycentrics[hit].T[..., None]
    point = origins[hit] + hits.t[hit, None] * directions[hit]
    np.testing.assert_allclose((1 - u - v) * a + u * b + v * c, point, atol=1e-4)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    np.testing.assert_allclose(hits.normal[hit], normal, atol=1e-3)


def test_wrong_arrays_are_refused() -> None:
    for tracer in all_tracers(shapes.make("box")):
        with pytest.raises(ldtrefl.InputError, match=r"origins must have shape \(\.\.\., 3\)"):
            tracer.trace(np.zeros((3, 2)), np.zeros((3, 2)))
        with pytest.raises(ldtrefl.InputError, match=r"origins of shape \(2, 3\) for directions of shape \(3, 3\)"):
            tracer.trace(np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(ldtrefl.InputError, match="unknown search 'linea'; did you mean 'linear'"):
        all_tracers(shapes.make("box"))[1].trace(np.zeros((1, 3)), np.zeros((1, 3)), search="linea")
