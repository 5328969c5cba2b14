"""What every case shares: answers that depend on no tracer of ours, and the classification of disagreements.

The truth of a ray is float64 brute force (Moeller and Trumbore 1997, every triangle, NumPy); on meshes of more than
``BRUTE_TRIANGLES`` it is Embree in robust mode. A disagreement (a hit too many, a hit too few, a hit elsewhere) is
*explained* when the truth itself gives the tracer's answer for a ray moved aside by at most a *radius*: the ray passes
within that radius of a silhouette or of a tie between coincident surfaces. What no radius within the limit explains is
a defect. Every disagreement is examined, and percentiles of the distance are of *all* rays that hit and should, or of
all but the explained: an error is never left out for being large. Distances and radii are in texels of a 256 map of
the object, whatever the map's resolution.
"""

from __future__ import annotations

import copy
import dataclasses
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import warp as wp
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

import ldtrefl

wp.config.log_level = wp.LOG_ERROR

BRUTE_TRIANGLES = 4000
"""Triangles up to which every ray is tested against every triangle."""

TEXELS = 256
"""Texels along an object's longest side that distances are given in."""

RADII = (1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.3, 1.0, 3.0)
"""Texels by which a ray is moved aside, smallest first, to explain a disagreement."""

MOVED = 96
"""Rays about one for each radius."""

FLOAT32 = 2.4e-7
"""Relative rounding of a float32, four times."""

ENOUGH_DEFECTS = 100
"""Disagreements that nothing explains, or twice as many as the limit allows, after which a run is known to have failed:
the rest are not examined, and count as defects."""


@dataclass(frozen=True)
class Limit:
    """What a tracer is held to in a case."""

    radius: float = 0.01
    """Texels from a silhouette or a tie within which disagreements may lie."""
    worst: float = 0.05
    """Texels between the hit and the true one beyond which it is a disagreement."""
    p999: float = 0.01
    """Texels between the hit and the true one, 99.9th percentile of all that are not explained."""
    p99: float = 0.01
    """The same, 99th percentile, of *all* rays that hit and should, the explained ones too."""
    wrong: float = 0.1
    """Percent of rays that may disagree at all, however well explained; one ray may in any case."""
    defects: float = 0.0
    """Percent of rays whose disagreement nothing within ``radius`` may explain; 100 if they are not examined at all."""
    slips: bool = False
    """Whether any answer counts as explained within ``radius`` of a silhouette, as between patches there may be a slit.
    Then ``wrong`` alone says how many may."""
    place: float = 0.1
    """Texels between the ray's end and the point that the triangle and the barycentrics name, the float32 rounding of
    the distance not counted; infinite where triangle, barycentrics and normal may be a neighbour's."""
    why: str = ""


LINEAR_WORST = 2.0
"""Texels beyond which a hit of the paper's search counts as wrong: its blocks are one wide and one deep."""

EXACT = Limit(why="float32: a thousandth of a texel, and ten times that at grazing angles")
LINEAR = Limit(
    worst=LINEAR_WORST,
    p99=np.inf,
    p999=np.inf,
    wrong=10.0,
    defects=100.0,
    place=np.inf,
    why="the paper's search steps over what is thin and sees texels as blocks: percent alone",
)


@dataclass
class Outcome:
    """What a case measured for one tracer."""

    case: str = ""
    what: str = ""
    by: str = ""
    tried: int = 0
    wrong_hits: int = 0
    wrong_misses: int = 0
    worst: float = 0.0
    """Texels."""
    p999: float = 0.0
    """Texels; of all hits but the explained."""
    p99: float = 0.0
    """Texels; of all hits."""
    disagree: int = 0
    """Hits too many, too few, and farther off than the limit's ``worst``."""
    explained: int = 0
    """Disagreements that a silhouette or a tie within the limit's radius explains."""
    radius: float = 0.0
    """Texels within which every disagreement is explained; infinite where one is not."""
    defects: int = 0
    misnamed: int = 0
    """Hits whose triangle, barycentrics or normal are not those of the place where the ray ends."""
    non_finite: int = 0
    seconds: float = 0.0
    limit: str = ""
    passed: bool = True


def linear_limit(percent: float, why: str) -> Limit:
    """The paper's search held to a share of wrong rays."""
    return dataclasses.replace(LINEAR, wrong=percent, why=why)


def limits(
    exact: Limit = EXACT, balanced: Limit | None = None, fast: Limit | None = None, linear: Limit = LINEAR
) -> dict[str, Limit]:
    """Limits by tracer: where triangles are larger than texels all qualities are held to the exact one's."""
    return {
        "exact": exact,
        "balanced": balanced or exact,
        "fast": fast or balanced or exact,
        "linear": linear,
        "bvh": exact,
    }


DENSE = limits(
    balanced=Limit(
        radius=1.0,
        worst=1.0,
        p999=0.9,
        p99=0.4,
        wrong=0.2,
        slips=True,
        place=np.inf,
        why="a patch is a plane of at most 1.4 texels: silhouettes move by up to half of one",
    ),
    fast=Limit(
        radius=3.0,
        worst=3.0,
        p999=3.0,
        p99=2.0,
        wrong=1.2,
        slips=True,
        place=np.inf,
        why="a patch is a plane of at most 3.2 texels: at silhouettes one ray in 300 ends on another surface, so that "
        "of all hits the 99.9th percentile is 60 texels",
    ),
)
"""Limits where triangles are smaller than texels and patches stand for them."""


class Truth:
    """First hits on a mesh, by brute force or by Embree."""

    def __init__(self, mesh: ldtrefl.Mesh, *, always_embree: bool = False) -> None:
        self.mesh = mesh
        self.centre, self.half = mesh.unit_frame
        corners = ((mesh.vertices - self.centre) / self.half)[mesh.faces]
        self._a, self._u, self._v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        self._embree = None
        if always_embree or len(mesh.faces) > BRUTE_TRIANGLES:
            self._embree = rtcore_scene.EmbreeScene(robust=True)
            self._geometry = TriangleMesh(self._embree, mesh.unit_vertices, mesh.faces)

    @property
    def is_brute(self) -> bool:
        """Whether the answers are brute force's."""
        return self._embree is None

    def near(self, origin: np.ndarray, direction: np.ndarray, reach: float) -> Truth:
        """The truth of the triangles alone that rays within ``reach`` of a ray can meet, all parallel to it."""
        if not self.is_brute:
            return self
        o, d = (origin - self.centre) / self.half, direction / np.abs(direction).max()
        d = d / np.linalg.norm(d)
        middle = self._a + (self._u + self._v) / 3
        corners = (self._a, self._a + self._u, self._a + self._v)
        size = np.max([np.linalg.norm(corner - middle, axis=1) for corner in corners], axis=0)
        aside = middle - o
        aside = np.linalg.norm(aside - (aside @ d)[:, None] * d, axis=1)
        # A millionth more, for rounding.
        is_near = aside <= 1.000001 * (size + reach / self.half) + 1e-6
        few = copy.copy(self)
        few._a, few._u, few._v = (part[is_near] for part in (self._a, self._u, self._v))
        return few

    def hits(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """(n,) float64 distances in lengths of each direction, +inf on a miss; origins and directions (n, 3)."""
        return self.first_hits(origins, directions)[0]

    def first_hits(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same, and (n,) triangles, -1 on a miss."""
        o = (np.asarray(origins, float) - self.centre) / self.half
        d = np.asarray(directions, float)
        length = np.abs(d).max(axis=1, keepdims=True)
        length = length * np.linalg.norm(d / length, axis=1, keepdims=True)
        d = d / length
        # Start near the object: a float32 ray tracer cannot start far away, and brute force loses nothing.
        skipped = np.maximum(-(o * d).sum(axis=1) - 2.0, 0.0)
        o = o + skipped[:, None] * d
        t, triangle = _against_all(self._a, self._u, self._v, o, d) if self.is_brute else self._by_embree(o, d)
        return (t + skipped) * self.half / length[:, 0], triangle

    def _by_embree(self, o: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        assert self._embree is not None
        answer = self._embree.run(o.astype(np.float32), d.astype(np.float32), output=1)
        triangle = answer["primID"].astype(int)
        return np.where(triangle >= 0, answer["tfar"], np.inf).astype(float), triangle


def brute_force(mesh: ldtrefl.Mesh, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First hits of rays where they stand: (n,) distances in lengths of each direction, +inf on a miss, and (n,)
    triangles, -1 on a miss."""
    corners = mesh.vertices[mesh.faces]
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return _against_all(a, u, v, origins.astype(float), directions.astype(float))


def _against_all(
    a: np.ndarray, edge_u: np.ndarray, edge_v: np.ndarray, o: np.ndarray, d: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Every ray against every triangle, given by a corner and the edges from it."""
    t, triangle = np.full(len(o), np.inf), np.full(len(o), -1)
    if not len(a):
        return t, triangle
    step = max(1, 1_000_000 // len(a))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for first in range(0, len(o), step):
            rays = slice(first, first + step)
            p = np.cross(d[rays, None], edge_v)
            determinant = (p * edge_u).sum(axis=2)
            s = o[rays, None] - a
            u = (s * p).sum(axis=2) / determinant
            q = np.cross(s, edge_u)
            v = (q * d[rays, None]).sum(axis=2) / determinant
            along = (q * edge_v).sum(axis=2) / determinant
            inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (along >= 0) & np.isfinite(along)
            along = np.where(inside, along, np.inf)
            nearest = along.argmin(axis=1)
            t[rays] = along[np.arange(len(nearest)), nearest]
            triangle[rays] = np.where(np.isfinite(t[rays]), nearest, -1)
    return t, triangle


def tracers(mesh: ldtrefl.Mesh, resolution: int = TEXELS, **options: int) -> Iterator[tuple[str, Callable]]:
    """(name, ``trace(origins, directions) -> Hits``) of every search, every quality and the BVH."""
    for quality in ("exact", "balanced", "fast"):
        yield quality, ldtrefl.peel(mesh.vertices, mesh.faces, resolution, quality=quality).trace
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution, search="linear")
    yield "linear", lambda o, d: maps.trace(o, d, search="linear", **options)
    yield "bvh", ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace


def judge_mesh(
    case: str,
    what: str,
    mesh: ldtrefl.Mesh,
    origins: np.ndarray,
    directions: np.ndarray,
    held_to: dict[str, Limit] | None = None,
    resolution: int = TEXELS,
    least: float = 0.02,
) -> list[Outcome]:
    """Every tracer against the truth on the same rays, of which a share ``least`` must truly hit; none if it is 0."""
    origins, directions = (np.ascontiguousarray(x, np.float32) for x in (origins, directions))
    truth = Truth(mesh)
    true_t = truth.hits(origins, directions)
    share = float(np.isfinite(true_t).mean())
    outcomes = []
    for by, trace in tracers(mesh, resolution):
        start = time.perf_counter()
        hits = trace(origins, directions)
        outcome = judge(truth, origins, directions, true_t, hits, (held_to or limits())[by])
        outcome.case, outcome.what, outcome.by = case, what, by
        outcome.passed &= share >= least if least > 0 else share == 0
        outcome.seconds = time.perf_counter() - start
        outcomes.append(outcome)
    return outcomes


def judge(
    truth: Truth, origins: np.ndarray, directions: np.ndarray, true_t: np.ndarray, hits: ldtrefl.Hits, limit: Limit
) -> Outcome:
    """One tracer's hits against the truth."""
    texel = 2.0 * truth.half / TEXELS
    t = np.asarray(hits.t, float)
    hit, true = hits.triangle >= 0, np.isfinite(true_t)
    broken = np.isnan(t) | (hit != np.isfinite(t)) | ~np.isfinite(hits.normal).all(axis=1)
    broken |= ~np.isfinite(hits.barycentrics).all(axis=1) | (hits.triangle >= len(truth.mesh.faces))
    both = hit & true
    length = np.linalg.norm(directions.astype(float), axis=1)
    error = np.zeros(len(t))
    # The distance is a float32, which far away is coarser than a texel: its own rounding is no error.
    off = np.abs(t[both] - true_t[both])
    error[both] = np.maximum(off - FLOAT32 * true_t[both], 0.0) * length[both] / texel
    error[np.isnan(error)] = np.inf
    disagree = np.flatnonzero((hit != true) | (error > limit.worst))
    is_explained = np.zeros(len(t), bool)
    radius, defects = 0.0, 0
    for number, i in enumerate(disagree if limit.defects < 100 else ()):
        found = np.inf  # nothing explains what is no answer
        if not broken[i]:
            found = explaining_radius(truth, origins[i], directions[i], t[i], int(hits.triangle[i]), texel, limit.slips)
        radius = max(radius, found)
        is_explained[i] = found <= limit.radius
        defects += not is_explained[i]
        if defects >= max(ENOUGH_DEFECTS, 0.02 * limit.defects * len(t)):
            defects += len(disagree) - number - 1
            break
    counted = error[both & ~is_explained]
    outcome = Outcome(
        tried=len(t),
        wrong_hits=int((hit & ~true).sum()),
        wrong_misses=int((true & ~hit).sum()),
        worst=float(counted.max(initial=0.0)),
        p999=float(np.percentile(counted, 99.9)) if len(counted) else 0.0,
        p99=float(np.percentile(error[both], 99)) if both.any() else 0.0,
        explained=int(is_explained.sum()),
        radius=radius,
        defects=defects,
        misnamed=int(misnamed(truth, origins, directions, hits, limit.place).sum()) if np.isfinite(limit.place) else 0,
        non_finite=int(broken.sum()),
        limit=describe(limit),
    )
    outcome.disagree = len(disagree)
    outcome.passed = (
        outcome.non_finite == 0
        and outcome.misnamed == 0
        and outcome.p99 <= limit.p99
        and outcome.p999 <= limit.p999
        and len(disagree) <= max(1.0, limit.wrong / 100.0 * len(t))
        and defects <= limit.defects / 100.0 * len(t)
    )
    return outcome


def misnamed(truth: Truth, origins: np.ndarray, directions: np.ndarray, hits: ldtrefl.Hits, place: float) -> np.ndarray:
    """(n,) bool: hits whose barycentrics lie outside their triangle or name a point more than ``place`` texels
    from the ray's end, or whose normal is not their triangle's by its winding."""
    found = np.zeros(len(hits.t), bool)
    at = np.flatnonzero((hits.triangle >= 0) & (hits.triangle < len(truth.mesh.faces)) & np.isfinite(hits.t))
    a, b, c = np.moveaxis(truth.mesh.vertices[truth.mesh.faces[hits.triangle[at]]], 1, 0)
    u, v = hits.barycentrics[at].astype(float).T[..., None]
    t, d = hits.t[at, None].astype(float), directions[at].astype(float)
    # Far from the origin float32 rays, and the ends they lead to, stand on a lattice.
    size = np.abs(origins[at]).max(axis=1) + np.abs(t[:, 0]) * np.linalg.norm(d, axis=1) + np.abs(a).max(axis=1)
    apart = np.linalg.norm((1 - u - v) * a + u * b + v * c - (origins[at] + t * d), axis=1)
    elsewhere = apart > place * 2.0 * truth.half / TEXELS + FLOAT32 * size
    outside = np.minimum(np.minimum(u, v), 1 - u - v)[:, 0] < -1e-3
    edge, other = (b - a) / truth.half, (c - a) / truth.half
    facet = np.cross(edge, other)
    area = np.linalg.norm(facet, axis=1)
    # A triangle that is nearly a line has no normal in float32.
    sound = area > 1e-4 * np.linalg.norm(edge, axis=1) * np.linalg.norm(other, axis=1)
    cosine = (facet * hits.normal[at]).sum(axis=1) / np.where(sound, area, 1.0)
    found[at] = elsewhere | outside | (sound & (cosine < 0.999))
    return found


def explaining_radius(
    truth: Truth, origin: np.ndarray, direction: np.ndarray, t: float, triangle: int, texel: float, slips: bool
) -> float:
    """The least of ``RADII`` by which the ray is moved aside for the truth to give ``t``; infinite if none is.

    With ``slips`` it is enough that the truth jumps there, from hit to miss or to another distance.
    """
    rng = np.random.default_rng(0)
    o, d = origin.astype(float), direction.astype(float)
    length = np.linalg.norm(d)
    # Aside, and so that far rays are moved aside where they meet the object, not at their start.
    ways = rng.normal(size=(MOVED, 3))
    if triangle >= 0:
        # Into the triangle that was found, too: at a sharp corner chance does not find the way.
        corners = truth.mesh.vertices[truth.mesh.faces[triangle]]
        inwards = corners.mean(axis=0) - (o + t * d)
        ways[:4] = np.array([1.0, 0.5, 0.1, 0.01])[:, None] * inwards
    ways[4:] /= np.linalg.norm(ways[4:], axis=1, keepdims=True)
    ways[:4] /= max(float(np.linalg.norm(ways[0])), 1e-300)
    truth = truth.near(o, d, RADII[-1] * texel)
    for radius in RADII:
        moved = np.sort(truth.hits(o + radius * texel * ways, np.broadcast_to(d, (MOVED, 3))))
        with np.errstate(invalid="ignore"):
            if slips and np.nan_to_num(np.diff(moved), nan=0.0).max() > 16 * radius * texel / length:
                return radius
        if not np.isfinite(t):
            if not np.isfinite(moved).all():
                return radius
        else:
            finite = moved[np.isfinite(moved)]
            if len(finite):
                # Half as far again as the moved rays' hits lie apart: at grazing angles they are few and far between.
                slack = 4.0 * radius * texel / length + FLOAT32 * t + 0.5 * (finite.max() - finite.min())
                if finite.min() - slack <= t <= finite.max() + slack:
                    return radius
    return np.inf


def describe(limit: Limit) -> str:
    """A limit in a few words."""
    parts = [f"explained within {limit.radius:g} texels"] if limit.defects < 100 else []
    parts += [f"but for {limit.defects:g}%"] if 0 < limit.defects < 100 else []
    parts += [f"p99 <= {limit.p99:g}"] if np.isfinite(limit.p99) else []
    parts += [f"p99.9 <= {limit.p999:g}"] if np.isfinite(limit.p999) else []
    parts += [f"wrong <= {limit.wrong:g}%"] if limit.wrong < 100 else []
    parts += [f"a hit is wrong beyond {limit.worst:g} texels"] if np.isfinite(limit.worst) else []
    return ", ".join(parts) + (f" ({limit.why})" if limit.why else "")


def rays_about(mesh: ldtrefl.Mesh, count: int, seed: int = 0, reach: float = 2.5) -> tuple[np.ndarray, np.ndarray]:
    """(count, 3) float32 origins on a sphere about the mesh, and unit directions towards points of its box."""
    rng = np.random.default_rng(seed)
    centre, half = mesh.unit_frame
    around = rng.normal(size=(count, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    origins = (centre + reach * half * around).astype(np.float32)
    directions = rng.uniform(mesh.bounds[0], mesh.bounds[1], (count, 3)) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return origins, directions.astype(np.float32)


def moved(mesh: ldtrefl.Mesh, scale: object = 1.0, offset: object = 0.0) -> ldtrefl.Mesh:
    """The mesh scaled and moved."""
    return ldtrefl.Mesh(mesh.vertices * np.asarray(scale) + np.asarray(offset), mesh.faces)


def as_dict(outcome: Outcome) -> dict[str, object]:
    """For JSON: plain numbers, infinite ones become null."""
    values = {name: getattr(value, "item", lambda value=value: value)() for name, value in vars(outcome).items()}
    return {name: None if isinstance(v, float) and not np.isfinite(v) else v for name, v in values.items()}
