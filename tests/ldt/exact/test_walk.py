"""The exact search: every quality against the ray caster, and what lies at its limits."""

from collections.abc import Callable

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes
from tests.conftest import REAL_MESHES

from .differences import DENSE_KNOT, differences, rays_from_outside


@pytest.mark.parametrize("name", [*shapes.names(), *REAL_MESHES])
def test_exact_finds_what_the_raycaster_finds(mesh_or_shape: Callable, name: str) -> None:
    mesh = mesh_or_shape(name)
    found = differences(mesh, ldtrefl.peel(mesh.vertices, mesh.faces, quality="exact"), 60_000, 5)
    assert found["wrong_hits"] + found["wrong_misses"] <= 0.01, f"{name}: {found}"
    coincident = name == "cycloidal_drive.ply"  # faces that lie in each other: either is right
    assert found["same"] >= (99.0 if coincident else 99.9) and found["p99"] < 0.01, f"{name}: {found}"


@pytest.mark.parametrize("resolution", [16, 17, 64, 1024])
def test_any_resolution_gives_the_same_hits(resolution: int) -> None:
    mesh = shapes.make("genus3", {"grid": 32})
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution=resolution, quality="exact")
    found = differences(mesh, maps, 20_000, 3)
    assert found["wrong_hits"] == found["wrong_misses"] == 0.0


def test_axis_parallel_rays_with_either_zero_and_tiny_components() -> None:
    mesh = shapes.make("box")
    maps = ldtrefl.peel(mesh.vertices, mesh.faces)
    for small in (0.0, -0.0, 1e-30, -1e-20, 1e-42):
        for axis in range(3):
            for sign in (1.0, -1.0):
                direction, origin = np.full(3, small, np.float32), np.full(3, 0.3, np.float32)
                direction[axis], origin[axis] = sign, -4 * sign
                assert maps.trace(origin[None], direction[None]).t[0] == pytest.approx(3.0, abs=1e-4)


def test_origins_within_on_and_behind_the_object() -> None:
    mesh = shapes.make("sphere")
    maps, caster = ldtrefl.peel(mesh.vertices, mesh.faces), ldtrefl.Raycaster(mesh.vertices, mesh.faces)
    rng = np.random.default_rng(2)
    directions = rng.normal(size=(3000, 3)).astype(np.float32)
    for origins in (
        rng.uniform(-0.5, 0.5, (3000, 3)).astype(np.float32),  # inside
        (1e5 * rng.normal(size=(3000, 3))).astype(np.float32),  # far away
        (3 * directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32),  # looking away
    ):
        ours, truth = maps.trace(origins, directions), caster.trace(origins, directions)
        assert ((ours.triangle >= 0) == (truth.triangle >= 0)).all()
        hit = truth.triangle >= 0
        np.testing.assert_allclose(ours.t[hit], truth.t[hit], rtol=1e-4, atol=1e-5)


def rays_at_a_plane(origin_heights: np.ndarray, dives: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) float32 origins above the plane z = 0, on its diagonal or near it, and directions that go down or up."""
    rng = np.random.default_rng(seed)
    count = len(dives)
    turn, x = rng.uniform(0, 2 * np.pi, count), rng.uniform(-0.5, 0.5, count)
    directions = np.stack([np.cos(turn), np.sin(turn), dives], axis=1).astype(np.float32)
    met = np.stack([x, x + rng.uniform(-2e-7, 2e-7, count), np.zeros(count)], axis=1)
    return (met + (origin_heights / dives)[:, None] * directions).astype(np.float32), directions


@pytest.mark.parametrize("by", ["ldt", "bvh"])
def test_a_ray_meets_two_triangles_of_one_plane_at_one_t(by: str) -> None:
    """Grazing rays that pass their common edge by less than rounding: which triangle it is may be chance, t is not."""
    plane, rng = shapes.make("plane"), np.random.default_rng(0)
    dives = -(10 ** rng.uniform(-3, -0.5, 20_000))
    origins, directions = rays_at_a_plane(-dives * rng.uniform(0.05, 0.3, 20_000), dives, 1)
    tracer = (ldtrefl.peel if by == "ldt" else ldtrefl.Raycaster)(plane.vertices, plane.faces)
    expected = -origins[:, 2].astype(float) / directions[:, 2]
    np.testing.assert_allclose(tracer.trace(origins, directions).t, expected, rtol=2e-7)


@pytest.mark.parametrize("by", ["ldt", "bvh"])
def test_a_ray_meets_nothing_behind_its_start_however_near(by: str) -> None:
    """A plane a million times larger than what stands on it must not be met from a hundredth of that above it."""
    plane, rng = shapes.make("plane"), np.random.default_rng(0)
    heights, climbs = 10 ** rng.uniform(-12, -7.6, 2000), 10 ** rng.uniform(-3, -0.5, 2000)
    origins, directions = rays_at_a_plane(heights, climbs, 2)
    assert (origins[:, 2] > 0).all()
    tracer = (ldtrefl.peel if by == "ldt" else ldtrefl.Raycaster)(plane.vertices, plane.faces)
    assert np.isinf(tracer.trace(origins, directions).t).all()
    assert not tracer.occluded(origins, directions).any()


@pytest.mark.parametrize("wound", ["outwards", "inwards", "open"])
def test_patches_show_their_front(wound: str) -> None:
    """From outside a closed object no ray may end on the inside of its far wall or behind its horizon."""
    mesh = shapes.make("torus_knot", DENSE_KNOT)
    faces = {"outwards": mesh.faces, "inwards": mesh.faces[:, ::-1], "open": mesh.faces[:-1]}[wound]
    maps = ldtrefl.peel(mesh.vertices, faces)
    assert maps.tree.view.front == {"outwards": 1, "inwards": -1, "open": 0}[wound]
    origins, directions = rays_from_outside(100_000, 7)
    hits = maps.trace(origins, directions)
    out = (hits.normal * directions).sum(axis=1) * (-1 if wound == "inwards" else 1)
    back = (out > 0).sum() / (hits.triangle >= 0).sum()
    assert back <= (1e-3 if wound == "open" else 1e-4), back


def test_rays_that_leave_a_patched_surface_mostly_do() -> None:
    """Patches rise a little over the surface that they stand for: a ray that starts there is beneath them."""
    mesh = shapes.make("torus_knot", DENSE_KNOT)
    maps, exact = (ldtrefl.peel(mesh.vertices, mesh.faces, quality=quality) for quality in ("balanced", "exact"))
    origins, directions = rays_from_outside(60_000, 8)
    hits = exact.trace(origins, directions)
    met = hits.triangle >= 0
    onwards = directions[met] - 2 * (directions[met] * hits.normal[met]).sum(axis=1, keepdims=True) * hits.normal[met]
    starts = origins[met] + hits.t[met, None] * directions[met] + 1e-4 * hits.normal[met]
    right, found = exact.trace(starts, onwards), maps.trace(starts, onwards)
    is_early = found.t < right.t - 0.01 * np.linalg.norm(onwards, axis=1) ** -1
    assert is_early.mean() <= 0.15 and (found.triangle >= 0).mean() > 0.2, is_early.mean()


@pytest.mark.parametrize("params", [{}, DENSE_KNOT])
def test_no_way_down_the_tree_changes_a_bit(params: dict) -> None:
    """Rays alone, rays that go as packets, and rays in turn are answered alike."""
    mesh = shapes.make("torus_knot", params)
    maps = ldtrefl.peel(mesh.vertices, mesh.faces)
    origins, directions = rays_from_outside(4096, 3)
    together = np.argsort(directions[:, 0])
    expected = [maps.trace(origins[i : i + 1], directions[i : i + 1]).t[0] for i in range(256)]
    for in_turn in (0, 1):
        maps.tree.view.in_turn = in_turn
        hits = maps.trace(origins, directions)
        assert (hits.triangle >= 0).mean() > 0.3
        np.testing.assert_array_equal(hits.t[:256], expected)
        np.testing.assert_array_equal(maps.trace(origins[together], directions[together]).t, hits.t[together])
        # From one point through a narrow window: packets.
        window = np.float32([0.0, -3.0, 0.0]) + np.zeros((4096, 3), np.float32)
        x, z = np.meshgrid(np.linspace(-0.5, 0.5, 64), np.linspace(-0.5, 0.5, 64))
        towards = np.stack([x.ravel(), np.full(4096, 3.0), z.ravel()], axis=1).astype(np.float32)
        packets, backwards = maps.trace(window, towards), maps.trace(window[::-1][::7], towards[::-1][::7])
        np.testing.assert_array_equal(packets.t[::-1][::7], backwards.t)
        np.testing.assert_array_equal(packets.triangle[::-1][::7], backwards.triangle)
