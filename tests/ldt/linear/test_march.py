"""The paper's search: it skips samples and answers, to the bit, as if it did not."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.ldt.linear.march import march_linear
from ldtrefl.ldt.maps import MapsView
from ldtrefl.ldt.texture import LayeredDepthTexture
from ldtrefl.tracing.tracer import array_of_views

from .reference import LinearReference


@launch.kernel
def march_rays(
    first: int,
    views: wp.array(dtype=MapsView),
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    t_max: wp.array(dtype=float),
    any: int,
    t_out: wp.array(dtype=float),
    fragment_out: wp.array(dtype=int),
    steps_out: wp.array(dtype=int),
):
    """A thread searches for one ray."""
    i = first + wp.tid()
    found = march_linear(views, 0, origins[i], directions[i], t_max[i], any != 0)
    t_out[i] = found.t
    fragment_out[i] = found.fragment
    steps_out[i] = found.steps


def marched(
    maps: LayeredDepthTexture,
    origins: np.ndarray,
    directions: np.ndarray,
    t_max: np.ndarray,
    any: bool = False,
    **steps,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) t, fragment and samples looked at of rays in texel space."""
    device, n = launch.resolve_device(None), len(origins)
    view = maps.view("linear", **steps)
    rays = [wp.array(x, dtype=wp.vec3, device=device) for x in (origins, directions)]
    t = wp.empty(n, dtype=float, device=device)
    fragment, looks = (wp.empty(n, dtype=int, device=device) for _ in range(2))
    inputs = [array_of_views([view], MapsView, device), *rays, wp.array(t_max, dtype=float, device=device), int(any)]
    launch.launch(march_rays, n, [*inputs, t, fragment, looks], device)
    return t.numpy(), fragment.numpy(), looks.numpy()


def rays_in(size: tuple[int, int, int], count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays in texel space, of every kind: from outside and inside, along axes and diagonals, on the borders of texels
    and cells and of the box, with components that hardly count, from far away."""
    rng = np.random.default_rng(seed)
    sides = np.array(size, np.float32)

    def somewhere() -> np.ndarray:
        return rng.uniform(0.0, 1.0, (count, 3)) * sides

    def on_borders() -> np.ndarray:
        spacing = rng.choice([1.0, 4.0, 0.5], (count, 3))
        return np.clip(np.round(somewhere() / spacing) * spacing, 0.0, sides)

    towards = somewhere()
    outside = sides / 2 + 1.5 * max(size) * _unit(rng.normal(size=(count, 3)))
    far = sides / 2 + 8.0 * max(size) * _unit(rng.normal(size=(count, 3)))
    axes = np.eye(3)[rng.integers(0, 3, count)] * rng.choice([-1.0, 1.0], (count, 1))
    diagonals = rng.choice([-1.0, 0.0, 1.0], (count, 3)) + 0.0
    diagonals[(diagonals == 0.0).all(axis=1)] = 1.0
    tiny = axes + rng.choice([0.0, -0.0, 1e-3, -1e-6, 1e-12, -1e-20, 1e-30, 1e-39], (count, 3))
    rim = on_borders()
    side, high = rng.integers(0, 3, count), rng.integers(0, 2, count)
    rim[np.arange(count), side] = np.where(high, sides[side] + 0.005, -0.005)
    kinds = [
        (outside, towards - outside),
        (far, towards - far),
        (somewhere(), rng.normal(size=(count, 3))),
        (on_borders(), axes),
        (on_borders() - 3.0 * max(size) * axes, axes),
        (on_borders(), diagonals),
        (on_borders() - 2.0 * max(size) * diagonals, diagonals),
        (somewhere(), tiny),
        (on_borders() - 2.0 * max(size) * axes, tiny),
        (rim, axes),
        (rim - 2.0 * max(size) * diagonals, diagonals),
    ]
    origins = np.concatenate([o for o, _ in kinds]).astype(np.float32)
    directions = np.concatenate([d if d is tiny else _unit(d) for _, d in kinds]).astype(np.float32)
    return origins, directions * np.float32(max(size) / 2)


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def flipped(mesh: ldtrefl.Mesh) -> ldtrefl.Mesh:
    """Every third triangle wound the other way."""
    faces = mesh.faces.copy()
    faces[::3] = faces[::3, ::-1]
    return ldtrefl.Mesh(mesh.vertices, faces)


def holed(mesh: ldtrefl.Mesh) -> ldtrefl.Mesh:
    """Every fifth triangle left out."""
    return ldtrefl.Mesh(mesh.vertices, np.delete(mesh.faces, np.s_[::5], axis=0))


def doubled(mesh: ldtrefl.Mesh) -> ldtrefl.Mesh:
    """The mesh, itself again in the same place, and itself once more at half the size."""
    n = len(mesh.vertices)
    vertices = np.concatenate([mesh.vertices, mesh.vertices, 0.5 * mesh.vertices])
    return ldtrefl.Mesh(vertices, np.concatenate([mesh.faces, mesh.faces + n, mesh.faces + 2 * n]))


def piled(_: ldtrefl.Mesh) -> ldtrefl.Mesh:
    """Two hundred sheets, more than a test walks through one by one, some of them in pairs that face each other."""
    sheet = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    heights = np.round(np.random.default_rng(0).uniform(-1.0, 1.0, 200), 2)
    vertices = np.concatenate([sheet + np.array([0.0, 0.0, h]) for h in heights])
    quad = np.array([[0, 1, 2], [0, 2, 3]])
    faces = np.concatenate([4 * i + (quad if i % 3 else quad[:, ::-1]) for i in range(200)])
    return ldtrefl.Mesh(vertices, faces)


def scattered(_: ldtrefl.Mesh) -> ldtrefl.Mesh:
    """Rectangles across every axis, anywhere: most texels hold an odd number, and rays come in from the side."""
    rng = np.random.default_rng(0)
    flat = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    vertices = []
    for i in range(15):
        turned = np.roll(flat * rng.uniform(0.2, 0.9, 3), i % 3, axis=1)
        vertices.append(turned + rng.uniform(-1.0, 1.0, 3))
    quad = np.array([[0, 1, 2], [0, 2, 3]])
    return ldtrefl.Mesh(np.concatenate(vertices), np.concatenate([4 * i + quad for i in range(15)]))


def as_it_is(mesh: ldtrefl.Mesh) -> ldtrefl.Mesh:
    return mesh


CASES: list[tuple[str, Callable[[ldtrefl.Mesh], ldtrefl.Mesh], int, int | str, int]] = [
    ("torus_knot", as_it_is, 64, 512, 8),
    ("torus_knot", as_it_is, 64, "texel", 8),
    ("torus_knot", as_it_is, 150, "texel", 8),
    ("torus_knot", as_it_is, 16, 1, 0),
    ("torus_knot", as_it_is, 17, 4000, 64),
    ("torus_knot", flipped, 64, 100, 8),
    ("torus_knot", holed, 64, 100, 8),
    ("torus", doubled, 64, 100, 3),
    ("torus", piled, 64, "texel", 8),
    ("torus", scattered, 64, "texel", 8),
    ("torus", scattered, 256, 100, 8),
    ("hollow_box", as_it_is, 64, 100, 8),
    ("room", as_it_is, 64, "texel", 8),
    ("plane", as_it_is, 64, 100, 8),
    ("bowl", as_it_is, 64, "texel", 8),
    ("wires", as_it_is, 64, 100, 8),
    ("bunny_open.ply", as_it_is, 64, 100, 8),
    ("lucy.ply", as_it_is, 300, 300, 8),
]
"""Mesh, what is done to it, resolution, linear and binary steps."""


@pytest.fixture(params=CASES, ids=lambda case: f"{case[0]}-{case[1].__name__}-{case[2]}-{case[3]}-{case[4]}")
def case(request: pytest.FixtureRequest, mesh_or_shape: Callable[[str], ldtrefl.Mesh]) -> Iterator[tuple]:
    name, change, resolution, linear_steps, binary_steps = request.param
    mesh = change(mesh_or_shape(name))
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution, search="linear")
    yield maps, {"linear_steps": linear_steps, "binary_steps": binary_steps}


def test_what_is_skipped_changes_no_bit(case: tuple) -> None:
    maps, steps = case
    origins, directions = rays_in(maps.frame.size, 60, seed=1)
    no_limit = np.full(len(origins), np.inf, np.float32)
    t, fragment, _ = marched(maps, origins, directions, no_limit, **steps)
    reference = LinearReference(maps, **steps)
    truth = [reference.trace(o, d) for o, d in zip(origins, directions, strict=True)]
    true_t, true_fragment = np.array([a.t for a in truth]), np.array([a.fragment for a in truth])
    assert 0.0 < (true_fragment >= 0).mean() < 1.0
    different = np.flatnonzero((t.view(np.int32) != true_t.view(np.int32)) | (fragment != true_fragment))
    assert not len(different), "\n".join(
        f"{origins[i]} {directions[i]}: {t[i]!r} {fragment[i]}, {true_t[i]!r} {true_fragment[i]}" for i in different[:5]
    )

    # Hits before a limit, and whether there is any.
    limits = np.where(np.isfinite(true_t), true_t, 1.0) * np.float32([0.5, 1.0, 1.001])[np.arange(len(t)) % 3]
    limits = limits.astype(np.float32)
    before = true_t < limits
    t, fragment, _ = marched(maps, origins, directions, limits, **steps)
    np.testing.assert_array_equal(t, np.where(before, true_t, np.float32(np.inf)))
    np.testing.assert_array_equal(fragment, np.where(before, true_fragment, -1))
    _, fragment, _ = marched(maps, origins, directions, limits, any=True, **steps)
    np.testing.assert_array_equal(fragment >= 0, before)


def test_most_samples_are_skipped(case: tuple) -> None:
    """Rays look at few samples, however many they have; not those that creep along the border of a texel."""
    maps, _ = case
    origins, directions = (rays[: 3 * 200] for rays in rays_in(maps.frame.size, 200, seed=2))
    no_limit = np.full(len(origins), np.inf, np.float32)
    few, many = (marched(maps, origins, directions, no_limit, linear_steps=n)[2].mean() for n in (1000, 10_000))
    assert few < 0.1 * 3 * 1000 and many < 4 * few, f"{few:.1f} looks of 1,000 samples, {many:.1f} of 10,000"
