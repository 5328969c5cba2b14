"""What may be answered to rays that pass near edges and vertices, in float64, and whether a tracer's answers are so.

The truth is of the vertices as they were given, float64, and of the rays as they are handed over, float32. A tracer
rounds the vertices to float32 in a unit space, by up to 2.6e-8 of the size, so it is free to answer as for a ray moved
aside by an *allowance*, 1e-7 of the mesh's size, and for no other. This is found without asking for the sign of any
number that is nearly 0:

Triangles are *near* whose distance from the ray's line is at most the allowance; a ray can meet no other, however it
is moved. Near triangles that share an edge within the allowance make one *patch* of surface. A patch's border is
farther from the ray than the allowance, so the number of times that it winds about the ray, seen along it, is the same
for every ray within the allowance, and where it is not 0 the ray passes through the patch. A single triangle is such a
patch, and the fan about a vertex is one: through it a ray must not slip. Where the winding number is 0, beside a
silhouette but for the allowance, hit and miss are both right. So

    a miss is right if no patch must be met;
    a hit is right if its triangle is near, if t is that of the triangle's plane within the allowance of the ray, and
    if no patch that must be met lies wholly in front of it.

A patch within the allowance of the ray's start may be met or left. All lengths in here are in sizes of the mesh, the
longest side of its box.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

import ldtrefl

ALLOWANCE = 1e-7
"""How far aside of a ray its answer may be right: four roundings of a vertex to float32 in unit space."""

T_ROUNDING = 2.4e-7
"""Relative, of t: four roundings of a float32 (the direction's length, the unit's, t, and t in the user's unit)."""

PLACE = 5e-7
"""How far the point that the barycentrics name may lie from the ray: as far as rays that leave it are lifted off the
surface (``unit_rays.LEAVING``). Two weights rounded to float32 are up to 1.2e-7 of the triangle's longest edge."""

ALIKE = 0.999
"""Least cosine between a hit's normal and that of its triangle."""

FLOAT64 = 1e-6
"""Share of the allowance by which it is widened: many roundings of a float64."""

LADDER = (2e-7, 5e-7, 1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4)
"""Larger allowances, tried in turn on answers that the allowance does not explain: they tell how wrong those are."""

AT_ONCE = 20_000
"""Rays examined at once, whose boxes, triangles and patches take some hundred megabytes."""

LEAST_LENGTH = 1e-300
"""To divide by: triangles without area have no normal."""

LEAST_COMPONENT = 1e-200
"""Of a direction: smaller ones are replaced by it, so that its inverse is finite."""

WHOLE = 1e-6
"""How far from a whole number a winding number may be by rounding."""


@dataclass(frozen=True)
class Near:
    """Pairs of a ray and a triangle that is near it."""

    ray: np.ndarray
    """(p,) numbers of rays."""
    triangle: np.ndarray
    """(p,) numbers of triangles."""
    seen: SeenAlong
    is_edge_near: np.ndarray
    """(p, 3) bool: edges from corner 0 to 1, 1 to 2, 2 to 0 within the allowance."""


@dataclass(frozen=True)
class SeenAlong:
    """Triangles as seen along a ray each: the ray is the origin of a plane that stands across it."""

    across: np.ndarray
    """(p, 3, 2) corners in that plane."""
    along: np.ndarray
    """(p, 3) distance of the corners along the ray from its start."""

    def edge_distances(self) -> np.ndarray:
        """(p, 3) from the ray's line to the edges 0-1, 1-2, 2-0."""
        start, way = self.across, np.roll(self.across, -1, axis=1) - self.across
        squared = (way * way).sum(axis=2)
        part = np.clip(-(start * way).sum(axis=2) / np.where(squared > 0.0, squared, 1.0), 0.0, 1.0)
        return np.linalg.norm(start + part[..., None] * way, axis=2)

    def angles(self) -> np.ndarray:
        """(p, 3) by which the edges 0-1, 1-2, 2-0 turn about the ray, -pi to pi."""
        start, end = self.across, np.roll(self.across, -1, axis=1)
        return np.arctan2(_cross(start, end), (start * end).sum(axis=2))

    def surrounds(self) -> np.ndarray:
        """(p,) bool: the ray's line passes through the triangle; at its edges as rounding will have it."""
        return np.abs(self.angles().sum(axis=1)) > np.pi

    def distance(self) -> np.ndarray:
        """(p,) from the ray's line to the triangle."""
        return np.where(self.surrounds(), 0.0, self.edge_distances().min(axis=1))

    def reach(self, allowance: float) -> tuple[np.ndarray, np.ndarray]:
        """(p,) least and greatest distance along the ray of the triangle's points within an allowance of it."""
        u, v = self.across[:, 1] - self.across[:, 0], self.across[:, 2] - self.across[:, 0]
        rise_u, rise_v = self.along[:, 1] - self.along[:, 0], self.along[:, 2] - self.along[:, 0]
        area = _cross(u, v)
        first, last = self.along.min(axis=1), self.along.max(axis=1)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            slope_x = (rise_u * v[:, 1] - rise_v * u[:, 1]) / area
            slope_y = (rise_v * u[:, 0] - rise_u * v[:, 0]) / area
            middle = self.along[:, 0] - slope_x * self.across[:, 0, 0] - slope_y * self.across[:, 0, 1]
            margin = allowance * np.hypot(slope_x, slope_y)
            low, high = np.clip(middle - margin, first, last), np.clip(middle + margin, first, last)
        # A triangle seen edge on may be met anywhere along it. The ray's start is as free as its line.
        low, high = np.where(np.isnan(low), first, low), np.where(np.isnan(high), last, high)
        return low - allowance, high + allowance


@dataclass(frozen=True)
class Patches:
    """Connected pieces of near surface."""

    ray: np.ndarray
    low: np.ndarray
    high: np.ndarray
    """Least and greatest distance along the ray of what is near."""
    must: np.ndarray
    """Bool: however the ray is moved aside within the allowance, it meets the patch."""
    is_open: np.ndarray
    """Bool: it has a border within the allowance, so that the ray may meet it or not."""


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


class Surface:
    """A mesh in float64, in sizes, with boxes about its triangles: a tree of halves by median, in NumPy."""

    def __init__(self, mesh: ldtrefl.Mesh) -> None:
        low, high = mesh.bounds
        self.centre, self.size = low + (high - low) / 2, float((high - low).max())
        self.mesh = mesh
        self.vertices = (mesh.vertices - self.centre) / self.size
        # Vertices in one place are one: seams of textures and normals are no borders.
        _, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
        self.faces = place.reshape(-1)[mesh.faces]
        ends = np.sort(np.stack([self.faces, np.roll(self.faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        _, edge = np.unique(ends, axis=0, return_inverse=True)
        self.edges = edge.reshape(-1, 3)
        self.turn = np.where(self.faces < np.roll(self.faces, -1, axis=1), 1, -1)
        self._build()

    @property
    def is_closed(self) -> bool:
        """Whether every edge has as many triangles on one side as on the other."""
        return not np.bincount(self.edges.ravel(), weights=self.turn.ravel()).any()

    def _build(self) -> None:
        corners = self.vertices[self.mesh.faces]
        low, high = corners.min(axis=1), corners.max(axis=1)
        count = len(low)
        depth = max(int(np.ceil(np.log2(count))), 0)
        # The tree is filled up to a power of two with boxes that no ray meets.
        order = np.minimum(np.arange(2**depth), count)
        middle = np.vstack([(low + high) / 2, high[-1:]])
        for level in range(depth):
            halves = order.reshape(2**level, -1)
            axis = np.ptp(middle[halves], axis=1).argmax(axis=1)
            key = np.take_along_axis(middle[halves], axis[:, None, None], axis=2)[..., 0]
            order = np.take_along_axis(halves, key.argsort(axis=1), axis=1).ravel()
        self._order = order
        boxes = np.hstack([np.vstack([low, np.full((1, 3), np.inf)]), np.vstack([high, np.full((1, 3), -np.inf)])])
        self._levels = [boxes[order]]
        while len(self._levels[0]) > 1:
            first, second = self._levels[0][::2], self._levels[0][1::2]
            both = [np.minimum(first[:, :3], second[:, :3]), np.maximum(first[:, 3:], second[:, 3:])]
            self._levels.insert(0, np.hstack(both))

    def in_sizes(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rays' (n, 3) origins and unit directions in here, and (n,) lengths of the directions in sizes."""
        d = directions.astype(float)
        length = np.linalg.norm(d, axis=1)
        return (origins.astype(float) - self.centre) / self.size, d / length[:, None], length / self.size

    def boxes_met(self, o: np.ndarray, d: np.ndarray, margin: float) -> tuple[np.ndarray, np.ndarray]:
        """(p,) rays and (p,) triangles whose boxes, wider by ``margin``, the ray meets."""
        inverse = 1.0 / np.where(np.abs(d) < LEAST_COMPONENT, LEAST_COMPONENT, d)
        ray, node = np.arange(len(o)), np.zeros(len(o), int)
        for level, boxes in enumerate(self._levels):
            if level > 0:
                ray, node = np.repeat(ray, 2), np.stack([2 * node, 2 * node + 1], axis=1).ravel()
            box, start, per = boxes[node], o[ray], inverse[ray]
            with np.errstate(over="ignore"):
                one = (box[:, :3] - margin - start) * per
                other = (box[:, 3:] + margin - start) * per
            enter, leave = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
            met = (enter <= leave) & (leave >= -margin) & (box[:, 0] <= box[:, 3])
            ray, node = ray[met], node[met]
        return ray, self._order[node]

    def seen_along(self, triangle: np.ndarray, o: np.ndarray, d: np.ndarray) -> SeenAlong:
        """(p,) triangles along a ray each, (p, 3) ``o`` and unit ``d``."""
        least = np.zeros_like(d)
        least[np.arange(len(d)), np.abs(d).argmin(axis=1)] = 1.0
        x = np.cross(d, least)
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        frame = np.stack([x, np.cross(d, x), d], axis=2)
        seen = (self.vertices[self.mesh.faces[triangle]] - o[:, None]) @ frame
        return SeenAlong(seen[..., :2], seen[..., 2])

    def near(self, o: np.ndarray, d: np.ndarray, allowance: float) -> Near:
        """The triangles within an allowance of (n, 3) rays."""
        allowance *= 1.0 + FLOAT64
        ray, triangle = self.boxes_met(o, d, 2.0 * allowance)
        seen = self.seen_along(triangle, o[ray], d[ray])
        is_edge_near = seen.edge_distances() <= allowance
        kept = is_edge_near.any(axis=1) | seen.surrounds()
        kept &= seen.reach(allowance)[1] >= 0.0
        seen = SeenAlong(seen.across[kept], seen.along[kept])
        return Near(ray[kept], triangle[kept], seen, is_edge_near[kept])

    def patches(self, near: Near, allowance: float) -> Patches:
        """The patches of near surface that a ray can meet."""
        count = len(near.ray)
        pair, corner = np.nonzero(near.is_edge_near)
        edge = near.ray[pair] * (self.edges.max() + 1) + self.edges[near.triangle[pair], corner]
        names, shared = np.unique(edge, return_inverse=True)
        links = coo_matrix((np.ones(len(pair)), (pair, count + shared)), shape=(count + len(names),) * 2)
        _, piece = connected_components(links, directed=False)
        patches, piece_of_pair = np.unique(piece[:count], return_inverse=True)
        # Near edges with a triangle on one side only: borders of the mesh, or of what lies behind the start.
        turns = np.bincount(shared, weights=self.turn[near.triangle[pair], corner], minlength=len(names))
        is_open = np.zeros(len(patches), bool)
        is_open[piece_of_pair[pair[turns[shared] != 0]]] = True
        # How often the border winds about the ray. Edges between two triangles of the patch cancel.
        angle = np.where(near.is_edge_near, 0.0, near.seen.angles()).sum(axis=1)
        winding = np.bincount(piece_of_pair, weights=angle, minlength=len(patches)) / (2.0 * np.pi)
        assert (np.abs(winding - np.rint(winding))[~is_open] < WHOLE).all(), "a border that does not close"
        ray, low, high = np.zeros(len(patches), int), np.full(len(patches), np.inf), np.full(len(patches), -np.inf)
        ray[piece_of_pair] = near.ray
        pair_low, pair_high = near.seen.reach(allowance)
        np.minimum.at(low, piece_of_pair, pair_low)
        np.maximum.at(high, piece_of_pair, pair_high)
        return Patches(ray, low, high, (np.rint(winding) != 0) & ~is_open & (low > 0.0), is_open)


@dataclass(frozen=True)
class Right:
    """What n rays may be answered."""

    surface: Surface
    origins: np.ndarray
    """(n, 3) in sizes."""
    directions: np.ndarray
    """(n, 3) unit."""
    length: np.ndarray
    """(n,) of the directions as they were given, in sizes."""
    allowance: float
    bound: np.ndarray
    """(n,) distance in sizes up to which something must be met; infinite where hit or miss is free, or a miss right."""
    may: np.ndarray
    """(n,) bool: something can be met at all."""

    @property
    def must(self) -> np.ndarray:
        """(n,) bool: a miss is wrong."""
        return np.isfinite(self.bound)


def what_is_right(surface: Surface, origins: np.ndarray, directions: np.ndarray, allowance: float = ALLOWANCE) -> Right:
    """What may be answered to rays, (n, 3) float32 origins and directions of any length."""
    o, d, length = surface.in_sizes(origins, directions)
    bound, may = np.full(len(o), np.inf), np.zeros(len(o), bool)
    for first in range(0, len(o), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        near = surface.near(o[part], d[part], allowance)
        patches = surface.patches(near, allowance)
        may[first + patches.ray] = True
        np.minimum.at(bound, first + patches.ray[patches.must], patches.high[patches.must])
    return Right(surface, o, d, length, allowance, bound, may)


@dataclass(frozen=True)
class Verdict:
    """What is wrong with the answers to n rays, (n,) bool each."""

    sticks_out: np.ndarray
    """A hit on a triangle that the ray misses by more than the allowance."""
    slips: np.ndarray
    """A miss where a patch must be met."""
    elsewhere: np.ndarray
    """A hit behind a patch that must be met, or whose t is not that of its triangle."""
    misnamed: np.ndarray
    """Barycentrics of a point off the ray or outside the triangle, or the normal of another."""

    @property
    def wrong(self) -> np.ndarray:
        """(n,) bool: another answer than float64 gives to any ray within the allowance."""
        return self.sticks_out | self.slips | self.elsewhere


def examine(right: Right, hits: ldtrefl.Hits) -> Verdict:
    """What is wrong with a tracer's answers to the rays."""
    triangle, t = np.asarray(hits.triangle), np.asarray(hits.t, float)
    sticks_out, elsewhere, misnamed = (np.zeros(len(t), bool) for _ in range(3))
    for first in range(0, len(t), AT_ONCE):
        hit = first + np.flatnonzero(triangle[first : first + AT_ONCE] >= 0)
        seen = right.surface.seen_along(triangle[hit], right.origins[hit], right.directions[hit])
        sticks_out[hit] = beside = seen.distance() > right.allowance * (1.0 + FLOAT64)
        along = t[hit] * right.length[hit]
        slack = T_ROUNDING * np.abs(along)
        low, high = seen.reach(right.allowance)
        is_there = (along >= np.maximum(low, 0.0) - slack) & (along <= high + slack)
        elsewhere[hit] = ~beside & ~(is_there & (along <= right.bound[hit] + slack))
        misnamed[hit] = ~beside & _is_misnamed(right.surface, seen, hits, hit)
    # A miss must have t = +inf.
    elsewhere |= (triangle < 0) & ~np.isposinf(t)
    return Verdict(sticks_out, np.isposinf(t) & (triangle < 0) & right.must, elsewhere, misnamed)


def _is_misnamed(surface: Surface, seen: SeenAlong, hits: ldtrefl.Hits, hit: np.ndarray) -> np.ndarray:
    """(p,) bool: barycentrics or normals of hits that are not those of where the ray meets the triangle."""
    u, v = hits.barycentrics[hit].astype(float).T
    weights = np.stack([1.0 - u - v, u, v], axis=1)
    across = np.linalg.norm((weights[..., None] * seen.across).sum(axis=1), axis=1)
    along = (weights * seen.along).sum(axis=1)
    low, high = seen.reach(PLACE)
    is_there = (across <= PLACE) & (along >= low) & (along <= high) & (weights.min(axis=1) >= -T_ROUNDING)
    a, b, c = np.moveaxis(surface.vertices[surface.mesh.faces[hits.triangle[hit]]], 1, 0)
    facet = np.cross(b - a, c - a)
    cosine = (facet * hits.normal[hit]).sum(axis=1) / np.maximum(np.linalg.norm(facet, axis=1), LEAST_LENGTH)
    return ~(is_there & (cosine >= ALIKE))
