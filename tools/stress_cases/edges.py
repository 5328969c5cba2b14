"""Case 20: rays that pass within 1e-7 to 1e-4 of a mesh's size beside its edges and vertices, and exactly through them.

The meshes are closed: through none may a ray slip, and nothing may stick out of one by more than the allowance.
``edge_truth.py`` says what is right, and how far a tracer is free.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import cKDTree

import ldtrefl
from ldtrefl.scene import shapes

from .edge_truth import LADDER, Right, Surface, examine, what_is_right
from .outcomes import TEXELS, Outcome

NAME = "20 edges"

CLOSEST, FARTHEST = 1e-7, 1e-4
"""Of the mesh's size, how far beside an edge or a vertex the rays are aimed: log-uniform."""

REAL = ("spot.glb", "teapot.ply", "armadillo.ply")
"""Closed meshes of LDTREFL_MESH_PATH, which are left out where they are missing."""

LATTICE = 2.0**-12
"""Vertices in multiples of this, in a mesh from -1 to 1: rays can be aimed at them and at edges' middles exactly."""

LEAST_HITS = 0.2
"""Share of the rays of a kind that must hit: where most may do either, nothing is tested."""

LEAST_LENGTH = 1e-300
"""To divide by: triangles without area have no normal."""

SAME_PLACE = 1e-12
"""Of a mesh's size, how far vertices may lie apart that are one but for rounding."""

Trace = Callable[[np.ndarray, np.ndarray], ldtrefl.Hits]
Rays = tuple[np.ndarray, np.ndarray]
"""(n, 3) float32 origins and directions."""


def run(rays: int, pictures: int) -> list[Outcome]:
    """``rays`` rays in all."""
    outcomes = []
    meshes = made() | real()
    count = rays // (len(meshes) * len(KINDS)) + 1
    for name, mesh in meshes.items():
        traces = dict(tracers(mesh))
        for kind, given, right in rays_at(mesh, count):
            for by, trace in traces.items():
                start = time.perf_counter()
                hits = trace(*given)
                seconds = time.perf_counter() - start
                outcome = judge_edges(right, given, hits)
                outcome.case, outcome.what, outcome.by, outcome.seconds = NAME, f"{name}, {kind}", by, seconds
                outcomes.append(outcome)
    return outcomes


def rays_at(mesh: ldtrefl.Mesh, count: int) -> Iterator[tuple[str, Rays, Right]]:
    """Of each kind its name, ``count`` rays, and what they may be answered within ``ALLOWANCE``."""
    surface = Surface(mesh)
    for number, (kind, rays_of) in enumerate(KINDS.items()):
        given = rays_of(surface, count, np.random.default_rng(number))
        yield kind, given, what_is_right(surface, *given)


def tracers(mesh: ldtrefl.Mesh) -> Iterator[tuple[str, Trace]]:
    """(name, trace) of what must be exact."""
    yield "exact", ldtrefl.peel(mesh.vertices, mesh.faces, quality="exact").trace
    yield "bvh", ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace


def judge_edges(right: Right, rays: Rays, hits: ldtrefl.Hits) -> Outcome:
    """Whether all of a tracer's answers are right; ``radius`` is the allowance that explains them all."""
    found, count = examine(right, hits), len(hits.t)
    outcome = Outcome(
        tried=count,
        wrong_hits=int(found.sticks_out.sum()),
        wrong_misses=int(found.slips.sum()),
        disagree=int(found.wrong.sum()),
        defects=int(found.wrong.sum()),
        misnamed=int(found.misnamed.sum()),
        non_finite=int((~np.isfinite(hits.barycentrics).all(axis=1) | np.isnan(hits.t)).sum()),
        radius=TEXELS * explaining_allowance(right, rays, hits),
        limit=f"as float64 says of a ray within {right.allowance:g} of the size",
    )
    is_right = outcome.defects == 0 and outcome.misnamed == 0 and outcome.non_finite == 0
    outcome.passed = is_right and bool(right.must.mean() >= LEAST_HITS)
    return outcome


def explaining_allowance(right: Right, rays: Rays, hits: ldtrefl.Hits) -> float:
    """The allowance within which every answer is right: the one given, or a step of ``LADDER``; else infinite."""
    left = np.flatnonzero(examine(right, hits).wrong)
    if not len(left):
        return right.allowance
    for allowance in LADDER:
        few = ldtrefl.Hits(hits.t[left], hits.normal[left], hits.triangle[left], hits.barycentrics[left], 0)
        wider = what_is_right(right.surface, rays[0][left], rays[1][left], allowance)
        left = left[examine(wider, few).wrong]
        if not len(left):
            return allowance
    return np.inf


# The meshes.


def welded(mesh: ldtrefl.Mesh) -> ldtrefl.Mesh:
    """The mesh with vertices that share a place but for rounding made one, and without triangles that become lines."""
    size = (mesh.bounds[1] - mesh.bounds[0]).max()
    number = np.arange(len(mesh.vertices))
    for first, second in sorted(cKDTree(mesh.vertices).query_pairs(SAME_PLACE * size)):
        number[second] = min(number[second], number[first])
    kept, place = np.unique(number, return_inverse=True)
    faces = place[mesh.faces]
    is_sound = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return ldtrefl.Mesh(mesh.vertices[kept], faces[is_sound])


def on_lattice(mesh: ldtrefl.Mesh) -> ldtrefl.Mesh:
    """The mesh from -1 to 1 along its longest side, its vertices moved to the nearest of a lattice."""
    low, high = mesh.bounds
    vertices = 2 * (mesh.vertices - (low + high) / 2) / (high - low).max()
    return welded(ldtrefl.Mesh(np.rint(vertices / LATTICE) * LATTICE, mesh.faces))


def turned(mesh: ldtrefl.Mesh) -> ldtrefl.Mesh:
    """The mesh turned about all axes, so that no coordinate of it is a round number."""
    rotation = np.linalg.qr(np.random.default_rng(50).normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    return ldtrefl.Mesh(mesh.vertices @ rotation.T, mesh.faces)


def rod(strips: int) -> ldtrefl.Mesh:
    """A rod from -1 to 1, 0.02 thick, whose sides are strips of 0.02 / ``strips``, two triangles each."""
    step = np.linspace(-0.01, 0.01, strips + 1)[:-1]
    side = np.full(strips, 0.01)
    rim = np.concatenate([np.column_stack(xy) for xy in ((step, -side), (side, step), (-step, side), (-side, -step))])
    n = len(rim)
    ends = [np.column_stack([np.full(n, z), rim]) for z in (-1.0, 1.0)]
    here, there = np.arange(n), np.roll(np.arange(n), -1)
    faces = [
        np.column_stack([here, there, there + n]),
        np.column_stack([here, there + n, here + n]),
        np.column_stack([there, here, np.full(n, 2 * n)]),
        np.column_stack([here + n, there + n, np.full(n, 2 * n + 1)]),
    ]
    return ldtrefl.Mesh(np.vstack([*ends, [[-1, 0, 0], [1, 0, 0]]]), np.vstack(faces))


def made() -> dict[str, ldtrefl.Mesh]:
    """Closed shapes by name."""
    box, knot = welded(shapes.make("box")), welded(shapes.make("torus_knot", {"segments": [96, 16]}))
    ball = trimesh.creation.icosphere(subdivisions=3)
    sphere = ldtrefl.Mesh(ball.vertices, ball.faces)
    return {
        "box": box,
        "box, turned": turned(box),
        "icosphere": sphere,
        "icosphere on a lattice": on_lattice(sphere),
        "knot": knot,
        "knot on a lattice": on_lattice(knot),
        "genus 3": welded(shapes.make("genus3", {"grid": 32})),
        "rod of triangles 10,000 : 1": turned(rod(100)),
    }


def real() -> dict[str, ldtrefl.Mesh]:
    """Closed meshes from files, of those that are there."""
    folders = [Path(folder) for folder in os.environ.get("LDTREFL_MESH_PATH", "").split(os.pathsep) if folder]
    paths = {name: folder / name for name in REAL for folder in reversed(folders) if (folder / name).is_file()}
    return {name: ldtrefl.load_mesh(path) for name, path in paths.items()}


# The rays. Lengths are in sizes of the mesh until ``placed`` puts them beside it.


@dataclass(frozen=True)
class Targets:
    """Points on edges and at vertices."""

    points: np.ndarray
    """(n, 3)."""
    normals: np.ndarray
    """(n, 3) unit, outwards: the mean of two triangles' there."""


def targets(surface: Surface, count: int, rng: np.random.Generator, middles: bool = False) -> Targets:
    """Every second target is a vertex; the others lie anywhere on edges, or with ``middles`` in their middles."""
    a, b, c = np.moveaxis(surface.vertices[surface.mesh.faces], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), LEAST_LENGTH)
    order = np.argsort(surface.edges.ravel())
    half = rng.integers(0, len(order) // 2, count)  # edges of closed meshes come in pairs
    one, other = order[2 * half], order[2 * half + 1]
    corner, face = one % 3, one // 3
    start, end = surface.mesh.faces[face, corner], surface.mesh.faces[face, (corner + 1) % 3]
    share = np.full(count, 0.5) if middles else rng.random(count)
    share[::2] = 0.0
    points = (1 - share)[:, None] * surface.vertices[start] + share[:, None] * surface.vertices[end]
    mean = normals[face] + normals[other // 3]
    return Targets(points, mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), LEAST_LENGTH))


def unit_vectors(count: int, rng: np.random.Generator) -> np.ndarray:
    """(n, 3) unit vectors, all directions alike."""
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def log_uniform(low: float, high: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """(n, 1) numbers of all magnitudes from ``low`` to ``high`` alike."""
    return np.exp(rng.uniform(np.log(low), np.log(high), (count, 1)))


def offsets(count: int, rng: np.random.Generator) -> np.ndarray:
    """(n, 3) of all lengths from ``CLOSEST`` to ``FARTHEST``."""
    return log_uniform(CLOSEST, FARTHEST, count, rng) * unit_vectors(count, rng)


def placed(surface: Surface, origins: np.ndarray, aims: np.ndarray) -> Rays:
    """Rays from origins towards points, both in sizes: the direction is from the origin as float32 has it."""
    start = (origins * surface.size + surface.centre).astype(np.float32)
    return start, (aims * surface.size + surface.centre - start.astype(float)).astype(np.float32)


def from_outside(surface: Surface, count: int, rng: np.random.Generator) -> Rays:
    """From the side that the surface faces, near and far."""
    at = targets(surface, count, rng)
    ways = unit_vectors(count, rng)
    ways *= np.where((ways * at.normals).sum(axis=1, keepdims=True) > 0, 1.0, -1.0)
    return placed(surface, at.points + log_uniform(0.02, 2.0, count, rng) * ways, at.points + offsets(count, rng))


def from_afar(surface: Surface, count: int, rng: np.random.Generator) -> Rays:
    """From 2 to 200 sizes away: float32 unit vectors are too coarse there."""
    at = targets(surface, count, rng)
    origins = at.points + log_uniform(2.0, 200.0, count, rng) * unit_vectors(count, rng)
    return placed(surface, origins, at.points + offsets(count, rng))


def from_within(surface: Surface, count: int, rng: np.random.Generator) -> Rays:
    """From the side that it does not face."""
    at = targets(surface, count, rng)
    ways = unit_vectors(count, rng)
    ways *= np.where((ways * at.normals).sum(axis=1, keepdims=True) < 0, 1.0, -1.0)
    return placed(surface, at.points + log_uniform(0.005, 0.5, count, rng) * ways, at.points + offsets(count, rng))


def grazing(surface: Surface, count: int, rng: np.random.Generator) -> Rays:
    """Nearly along the surface, by slopes of a tenth to a millionth, from outside and within: most edges are
    silhouettes."""
    at = targets(surface, count, rng)
    ways = np.cross(at.normals, unit_vectors(count, rng))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    ways += rng.choice([-1.0, 1.0], (count, 1)) * log_uniform(1e-6, 1e-1, count, rng) * at.normals
    return placed(surface, at.points + log_uniform(0.02, 2.0, count, rng) * ways, at.points + offsets(count, rng))


def along_axes(surface: Surface, count: int, rng: np.random.Generator) -> Rays:
    """Exactly along +-x, +-y, +-z, the other components 0 or -0."""
    at = targets(surface, count, rng)
    axis, sign = rng.integers(0, 3, count), rng.choice([-1.0, 1.0], count)
    directions = np.where(rng.random((count, 3)) < 0.5, np.float32(0.0), np.float32(-0.0))
    directions[np.arange(count), axis] = sign
    origins = at.points + offsets(count, rng) - log_uniform(0.02, 2.0, count, rng) * directions
    return (origins * surface.size + surface.centre).astype(np.float32), directions


def leaving(surface: Surface, count: int, rng: np.random.Generator) -> Rays:
    """From the surface beside an edge or a vertex, half towards another edge or vertex, half anywhere."""
    at, other = targets(surface, count, rng), targets(surface, count, rng)
    shift = offsets(count, rng)
    shift -= (shift * at.normals).sum(axis=1, keepdims=True) * at.normals
    start = at.points + shift
    aims = np.where(rng.random((count, 1)) < 0.5, other.points + offsets(count, rng), start + unit_vectors(count, rng))
    return placed(surface, start, aims)


def through(surface: Surface, count: int, rng: np.random.Generator) -> Rays:
    """At vertices and edges' middles, from points of a lattice, as exactly as float32 can: on a lattice exactly."""
    at = targets(surface, count, rng, middles=True)
    ways = unit_vectors(count, rng)
    origins = at.points + log_uniform(0.05, 1.0, count, rng) * ways
    # Every third along an axis.
    axis = rng.integers(0, 3, count)
    is_straight = np.arange(count) % 3 == 0
    straight = at.points.copy()
    straight[np.arange(count), axis] = origins[np.arange(count), axis]
    origins[is_straight] = straight[is_straight]
    step = LATTICE / 2 / 2  # in sizes, of which the lattice's meshes have 2 units
    origins = np.where(np.abs(origins - at.points) > step, np.rint(origins / step) * step, at.points)
    return placed(surface, origins, at.points)


KINDS: dict[str, Callable[[Surface, int, np.random.Generator], Rays]] = {
    "from outside": from_outside,
    "from afar": from_afar,
    "from within": from_within,
    "grazing": grazing,
    "along axes": along_axes,
    "leaving": leaving,
    "through": through,
}
