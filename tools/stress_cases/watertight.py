"""Case 21: millions of rays aimed at vertices, edges and diagonals of closed meshes, at all scales: none may pass.

A ray is aimed at a point of the surface as exactly as float32 can, on a lattice exactly. It counts if all triangles
that meet in that point are seen from the same side, and none nearly edge on: then the surface about the point stands
across the ray however that is rounded, so the ray must meet something there, or before. It *passes* if it does not.
This needs no other ray tracer, and little time. ``edges.py`` examines all else about such rays, of fewer of them.

Embree stands beside ours in its robust mode, which promises no such thing and is held to nothing. It is given the mesh
in its unit cube, where float32 is as precise for it as for us.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

import ldtrefl

from . import edges
from .edge_truth import LEAST_LENGTH, Surface
from .inputs import moved
from .outcomes import Outcome

NAME = "21 watertight"

PLACES = ((1.0, 0.0), (1e-3, 1e6), (1.0, 1e6), (1e4, 1e3), (1e-6, 1e3), (1e6, 0.0))
"""The meshes' sizes, and how many sizes they stand from the origin along each axis."""

AT_ONCE = 250_000
"""Rays made at once, of which three in five count."""

FACING = 0.1
"""Least cosine between a ray that counts and the normals of all triangles that meet in its target."""

BEHIND = 1e-5
"""Of the mesh's size: how far behind its target a ray may be met. An aim is off by 2e-7, so by FACING 2e-6 along it."""

T_ROUNDING = 2.4e-7
"""Relative, of t: four roundings of a float32."""

NEAR_END = 0.05
"""Share of an edge at either end that is not aimed at: there, another star may be met."""

NEAREST, FARTHEST = 0.01, 2.0
"""Sizes from which targets are aimed at, log-uniform."""


@dataclass(frozen=True)
class Aimed:
    """Rays at a mesh, and where they are aimed."""

    origins: np.ndarray
    """(n, 3) float32."""
    directions: np.ndarray
    """(n, 3) float32, of any length."""
    t: np.ndarray
    """(n,) of their targets, float64."""
    slack: np.ndarray
    """(n,) by which t may be larger."""

    def passes(self, t: np.ndarray) -> np.ndarray:
        """(n,) bool: whether the rays pass, whose hits are at ``t``, infinite on a miss. NaN passes, too."""
        return ~(t <= (1.0 + T_ROUNDING) * self.t + self.slack)


class Stars:
    """Which triangles meet in the vertices and in the edges of a mesh."""

    def __init__(self, surface: Surface) -> None:
        a, b, c = np.moveaxis(surface.vertices[surface.mesh.faces], 1, 0)
        normals = np.cross(b - a, c - a)
        self._normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), LEAST_LENGTH)
        self.at_vertices, self.at_edges = _Lists(surface.faces), _Lists(surface.edges)

    def faced(self, lists: _Lists, which: np.ndarray, ways: np.ndarray) -> np.ndarray:
        """(n,) bool: whether all triangles in the stars ``which`` are seen from one side along unit (n, 3) ``ways``."""
        ray, triangle, first = lists.members(which)
        cosine = (self._normals[triangle] * ways[ray]).sum(axis=1)
        return (np.minimum.reduceat(cosine, first) > FACING) | (np.maximum.reduceat(cosine, first) < -FACING)


class _Lists:
    """Of each number in an (m, 3) array the rows in which it stands."""

    def __init__(self, numbers: np.ndarray) -> None:
        order = np.argsort(numbers.ravel(), kind="stable")
        self._rows = order // 3
        self._first = np.searchsorted(numbers.ravel()[order], np.arange(numbers.max() + 2))

    def members(self, which: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The lists ``which``, one after another: (p,) place in ``which``, (p,) row, and (n,) where each begins."""
        counts = self._first[which + 1] - self._first[which]
        begin = np.cumsum(counts) - counts
        place = np.repeat(np.arange(len(which)), counts)
        return place, self._rows[np.arange(len(place)) - begin[place] + self._first[which][place]], begin


def run(rays: int, pictures: int) -> list[Outcome]:
    """``rays`` rays that count or a few more, at each place a part of them."""
    meshes = edges.made() | edges.real()
    count = rays // (len(PLACES) * len(meshes)) + 1
    outcomes: list[Outcome] = []
    for size, sizes_off in PLACES:
        rows: dict[str, Outcome] = {}
        for number, mesh in enumerate(meshes.values()):
            _trace_all(placed(mesh, size, sizes_off), count, np.random.default_rng(number), rows)
        for by, row in rows.items():
            row.case, row.what, row.by = NAME, f"size {size:g}, {sizes_off:g} sizes off", by
            row.disagree = row.wrong_misses
            if by == "embree":
                row.limit = "none: its robust mode does not promise it"
            else:
                row.limit, row.defects, row.passed = "none may pass", row.wrong_misses, row.wrong_misses == 0
        outcomes += rows.values()
    return outcomes


def placed(mesh: ldtrefl.Mesh, size: float, sizes_off: float) -> ldtrefl.Mesh:
    """A mesh whose vertices are float32 numbers in its unit cube, of this size and so far from the origin."""
    unit = ldtrefl.Mesh(mesh.unit_vertices.astype(float), mesh.faces)
    return moved(unit, size / 2.0, size * sizes_off)


def _trace_all(mesh: ldtrefl.Mesh, count: int, rng: np.random.Generator, rows: dict[str, Outcome]) -> None:
    """Add to each tracer's row what ``count`` rays at a mesh do."""
    traces = dict(edges.tracers(mesh)) | {"embree": _embree(mesh)}
    for aimed in aimed_rays(mesh, count, rng):
        for by, trace in traces.items():
            row = rows.setdefault(by, Outcome())
            start = time.perf_counter()
            hits = trace(aimed.origins, aimed.directions)
            row.seconds += time.perf_counter() - start
            row.tried += len(aimed.t)
            row.wrong_misses += int(aimed.passes(np.asarray(hits.t, float)).sum())
            row.non_finite += int(np.isnan(hits.t).sum())


def _embree(mesh: ldtrefl.Mesh) -> edges.Trace:
    """Embree over a mesh in its unit cube, robust; rays are moved into that."""
    centre, half = mesh.unit_frame
    scene = rtcore_scene.EmbreeScene(robust=True)
    TriangleMesh(scene, mesh.unit_vertices, mesh.faces)

    def trace(origins: np.ndarray, directions: np.ndarray) -> ldtrefl.Hits:
        start = ((origins.astype(float) - centre) / half).astype(np.float32)
        found = scene.run(start, (directions.astype(float) / half).astype(np.float32), output=1)
        is_hit = found["primID"] >= 0
        nothing = np.zeros((len(start), 3), np.float32)
        return ldtrefl.Hits(np.where(is_hit, found["tfar"], np.inf), nothing, found["primID"], nothing[:, :2], 0)

    return trace


def aimed_rays(mesh: ldtrefl.Mesh, count: int, rng: np.random.Generator) -> Iterator[Aimed]:
    """``count`` rays that count, in batches: aimed at vertices, edges' middles, edges anywhere, and diagonals."""
    surface = Surface(mesh)
    stars = Stars(surface)
    while count > 0:
        points, at_vertex, which = _targets(surface, min(AT_ONCE, 2 * count), rng)
        origins, directions = _rays_to(surface, points, rng)
        # Far from the origin of coordinates a ray may start at its target.
        is_ray = directions.any(axis=1)
        points, at_vertex, which, origins, directions = (
            part[is_ray] for part in (points, at_vertex, which, origins, directions)
        )
        start, ways, length = surface.in_sizes(origins, directions)
        counts = np.zeros(len(points), bool)
        for lists, chosen in ((stars.at_vertices, at_vertex), (stars.at_edges, ~at_vertex)):
            counts[chosen] = stars.faced(lists, which[chosen], ways[chosen])
        t = ((points - start) * ways).sum(axis=1) / length
        aimed = Aimed(*(part[counts][:count] for part in (origins, directions, t, BEHIND / length)))
        count -= len(aimed.t)
        yield aimed


def _targets(surface: Surface, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n, 3) points in sizes; (n,) bool, whether they are vertices; (n,) the vertices' or edges' numbers."""
    face, corner = rng.integers(0, len(surface.faces), count), rng.integers(0, 3, count)
    kind = np.arange(count) % 4
    corners = surface.vertices[surface.mesh.faces]
    # A diagonal of a quadrangle that was cut in two is the longest edge of both halves.
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).argmax(axis=1)
    corner = np.where(kind == 3, longest[face], corner)
    share = np.select([kind == 0, kind == 1], [0.0, 0.5], rng.uniform(NEAR_END, 1.0 - NEAR_END, count))[:, None]
    points = (1 - share) * corners[face, corner] + share * corners[face, (corner + 1) % 3]
    return points, kind == 0, np.where(kind == 0, surface.faces[face, corner], surface.edges[face, corner])


def _rays_to(surface: Surface, points: np.ndarray, rng: np.random.Generator) -> edges.Rays:
    """From points of a lattice at random distances, every third along an axis."""
    count = len(points)
    offset = edges.log_uniform(NEAREST, FARTHEST, count, rng) * edges.unit_vectors(count, rng)
    is_straight = np.arange(count) % 3 == 0
    is_across = np.arange(3) != rng.integers(0, 3, (count, 1))
    offset[is_straight[:, None] & is_across] = 0.0
    step = edges.LATTICE / 2 / 2  # in sizes, of which the lattice's meshes have 2 units
    on_lattice = np.rint((points + offset) / step) * step
    return edges.placed(surface, np.where(offset == 0.0, points, on_lattice), points)
