"""The exact search: every quality against the ray caster, and what lies at its limits."""

from collections.abc import Callable

import numpy as np
import pytest
import trimesh
import warp as wp
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.ldt.texel_frame import point_from_texel
from ldtrefl.ldt.texture import LayeredDepthTexture
from ldtrefl.scene import shapes
from tests.conftest import REAL_MESHES

DENSE_KNOT = {"segments": [2000, 125]}


def differences(mesh: ldtrefl.Mesh, maps: LayeredDepthTexture, count: int, seed: int) -> dict[str, float]:
    """Wrong hits and misses in percent of true hits, same triangle in percent of common hits, and the 99th and 99.9th
    percentile of the distance in texels of 128."""
    origins, directions = rays_about(mesh, count, seed)
    hits = maps.trace(origins, directions)
    truth = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, directions)
    hit, true_hit = hits.triangle >= 0, truth.triangle >= 0
    both = hit & true_hit
    texel = (mesh.bounds[1] - mesh.bounds[0]).max() / 128
    return {
        "wrong_hits": 100.0 * (hit & ~true_hit).sum() / true_hit.sum(),
        "wrong_misses": 100.0 * (true_hit & ~hit).sum() / true_hit.sum(),
        "same": 100.0 * (hits.triangle == truth.triangle)[both].mean(),
        "p99": float(np.percentile(np.abs(hits.t[both] - truth.t[both]), 99)) / texel,
        "p999": float(np.percentile(np.abs(hits.t[both] - truth.t[both]), 99.9)) / texel,
    }


@pytest.mark.parametrize("name", [*shapes.names(), *REAL_MESHES])
def test_exact_finds_what_the_raycaster_finds(mesh_or_shape: Callable, name: str) -> None:
    mesh = mesh_or_shape(name)
    found = differences(mesh, ldtrefl.peel(mesh.vertices, mesh.faces, quality="exact"), 60_000, 5)
    assert found["wrong_hits"] + found["wrong_misses"] <= 0.01, f"{name}: {found}"
    coincident = name == "cycloidal_drive.ply"  # faces that lie in each other: either is right
    assert found["same"] >= (99.0 if coincident else 99.9) and found["p99"] < 0.01, f"{name}: {found}"


@pytest.mark.parametrize(
    ("quality", "wrong_hits", "wrong_misses", "p99"), [("balanced", 0.1, 0.05, 0.1), ("fast", 0.6, 0.2, 0.5)]
)
def test_dense_meshes_become_patches(quality: str, wrong_hits: float, wrong_misses: float, p99: float) -> None:
    mesh = shapes.make("torus_knot", DENSE_KNOT)
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, quality=quality)
    assert maps.tree.patches and maps.nbytes < 4_000_000
    found = differences(mesh, maps, 60_000, 6)
    assert found["wrong_hits"] <= wrong_hits, found
    assert found["wrong_misses"] <= wrong_misses, found
    assert found["p99"] <= p99, found


def rough_ball(rise: float) -> ldtrefl.Mesh:
    """A ball of 200,000 triangles whose vertices rise and fall at random by ``rise`` radii."""
    ball = shapes.make("sphere", {"segments": [500, 200]})
    place, number = np.unique(ball.vertices.round(9), axis=0, return_inverse=True)
    rises = 1.0 + rise * np.random.default_rng(3).normal(size=(len(place), 1))
    return ldtrefl.Mesh(ball.vertices * rises[number.ravel()], ball.faces)


def many_triangled_box(axis: tuple[float, float, float]) -> ldtrefl.Mesh:
    """A box turned about an axis, each side of 131,072 triangles."""
    box = trimesh.creation.box(extents=(1.0, 1.5, 2.0))
    for _ in range(8):
        box = box.subdivide()
    turned = trimesh.transformations.rotation_matrix(0.7, axis)[:3, :3]
    return ldtrefl.Mesh(box.vertices @ turned.T, box.faces)


@pytest.mark.parametrize("quality", ["balanced", "fast"])
def test_rough_surfaces_stay_triangles(quality: str) -> None:
    """Of a detailed scan no triangle can stand for its neighbours, however small it is."""
    mesh = rough_ball(0.003)
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, 128, quality=quality)
    smooth = rough_ball(0.0)
    assert ldtrefl.peel(smooth.vertices, smooth.faces, 128, quality=quality).tree.patches and not maps.tree.patches
    found = differences(mesh, maps, 60_000, 8)
    assert found["wrong_hits"] + found["wrong_misses"] <= 0.01 and found["p99"] < 0.01, found


@pytest.mark.parametrize(("quality", "resolution"), [("balanced", 256), ("fast", 400)])
@pytest.mark.parametrize("axis", [(1, 2, 3), (1, -0.5, 0.7)])
def test_patches_end_at_edges(quality: str, resolution: int, axis: tuple[float, float, float]) -> None:
    """Whichever way a box is turned, no edge may be taken for a surface that goes on in another map."""
    mesh = many_triangled_box(axis)
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution, quality=quality)
    assert maps.tree.patches
    found = differences(mesh, maps, 100_000, 9)
    assert found["wrong_hits"] + found["wrong_misses"] <= 0.005 and found["p999"] <= 0.01, found


def rays_from_outside(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from a sphere about the unit cube through it."""
    rng = np.random.default_rng(seed)
    origins = rng.normal(size=(count, 3))
    origins *= 3 / np.linalg.norm(origins, axis=1, keepdims=True)
    return origins.astype(np.float32), (rng.uniform(-1, 1, (count, 3)) - origins).astype(np.float32)


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


def test_patches_do_not_lose_what_is_thin_or_large() -> None:
    """A dense knot with wires far thinner than a texel and one large triangle: none of them may vanish."""
    knot, wires = shapes.make("torus_knot", DENSE_KNOT), shapes.make("wires", {"count": 3, "radius": 0.0004})
    sheet = np.array([[-1, -1, 0.9], [1, -1, 0.9], [0, 1, 0.9]])
    offset = len(knot.vertices)
    below = np.array([0, 0, -0.8])
    vertices = np.concatenate([knot.vertices, wires.vertices + below, sheet])
    faces = [knot.faces, wires.faces + offset, [np.arange(3) + offset + len(wires.vertices)]]
    mesh = ldtrefl.Mesh(vertices, np.concatenate(faces))
    maps = ldtrefl.peel(mesh.vertices, mesh.faces)
    assert maps.tree.patches
    rng = np.random.default_rng(0)
    targets = wires.vertices[wires.faces[rng.integers(0, len(wires.faces), 4000)]].mean(axis=1) + below
    origins = np.tile(np.array([[0.3, 0.2, -3.0]]), (len(targets), 1))
    truth = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, targets - origins)
    on_wires = truth.triangle >= len(knot.faces)
    found = maps.trace(origins, targets - origins)
    assert on_wires.sum() > 1000
    assert (found.triangle[on_wires] >= len(knot.faces)).mean() >= 0.99
    down = maps.trace([[0.0, -0.5, 3.0]], [[0.0, 0.0, -1.0]])
    assert down.triangle[0] == len(mesh.faces) - 1


@pytest.mark.parametrize("quality", ["balanced", "exact", "fast"])
def test_wires_of_a_fifth_of_a_texel_are_found(quality: str) -> None:
    mesh = shapes.make("wires", {"radius": 0.2 / 256})
    origins, directions = rays_about(mesh, 300_000, 1)
    truth = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, directions).triangle >= 0
    found = ldtrefl.peel(mesh.vertices, mesh.faces, quality=quality).trace(origins, directions).triangle >= 0
    assert truth.sum() > 5000
    assert (found & truth).sum() >= 0.99 * truth.sum() and (found & ~truth).sum() <= 0.01 * truth.sum()


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


@pytest.mark.parametrize("resolution", [16, 17, 64, 1024])
def test_any_resolution_gives_the_same_hits(resolution: int) -> None:
    mesh = shapes.make("genus3", {"grid": 32})
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution=resolution, quality="exact")
    found = differences(mesh, maps, 20_000, 3)
    assert found["wrong_hits"] == found["wrong_misses"] == 0.0


def test_same_bits_for_any_number_of_threads() -> None:
    for params in ({}, DENSE_KNOT):
        mesh = shapes.make("torus_knot", params)
        rows = []
        for threads in (1, 2, 5):
            ldtrefl.set_threads(threads)
            view = ldtrefl.peel(mesh.vertices, mesh.faces).tree.view
            rows.append([getattr(view, name).numpy().copy() for name in ("nodes", "rows")])
        for other in rows[1:]:
            for a, b in zip(rows[0], other, strict=True):
                np.testing.assert_array_equal(a, b)


@launch.kernel
def find_points(first: int, out: wp.array(dtype=wp.vec3)):
    axis = first + wp.tid()
    out[axis] = point_from_texel(axis, wp.vec3(1.0, 2.0, 3.0))


def test_points_of_texels() -> None:
    """The map of an axis has the next axis along u, the one after along v, and its own as depth."""
    device = launch.resolve_device(None)
    points = wp.zeros(3, dtype=wp.vec3, device=device)
    launch.launch(find_points, 3, [points], device)
    np.testing.assert_array_equal(points.numpy(), [[3.0, 1.0, 2.0], [2.0, 3.0, 1.0], [1.0, 2.0, 3.0]])
