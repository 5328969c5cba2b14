"""Paths among spheres, boxes and rectangles that are known in closed form: float64, no triangles, no code of ours.

A path goes from mirror to mirror until it meets what is no mirror, or has met enough of them; then it sees the sky.
World space; up is +z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from picture_edges import near_edge

Points = np.ndarray
"""(n, 3)"""

TOUCHING = 1e-9
"""How near its start, in sizes of the solid that it leaves, a ray meets nothing of that."""


@dataclass(frozen=True, kw_only=True)
class Solid:
    """What glows, and mirrors if ``mirror`` is above 0."""

    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mirror: float = 0.0

    @property
    def size(self) -> float:
        raise NotImplementedError

    def crossings(self, o: Points, d: Points) -> list[tuple[np.ndarray, Points, np.ndarray]]:
        """((n,) t, NaN where there is none; (n, 3) unit normal; (n,) number of the face) of every crossing."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class Sphere(Solid):
    radius: float
    top: float = np.inf
    """Of a sphere that is cut off, how high it reaches above its centre."""

    @property
    def size(self) -> float:
        return self.radius

    def crossings(self, o: Points, d: Points) -> list[tuple[np.ndarray, Points, np.ndarray]]:
        offset, found = o - self.centre, []
        along, apart = (offset * d).sum(axis=1), (offset**2).sum(axis=1) - self.radius**2
        with np.errstate(invalid="ignore"):
            root = np.sqrt(along**2 - apart)
        for t in (-along - root, -along + root):
            normal = (offset + t[:, None] * d) / self.radius
            is_in = normal[:, 2] * self.radius <= self.top
            found.append((np.where(is_in, t, np.nan), normal, np.zeros(len(t), int)))
        return found


@dataclass(frozen=True, kw_only=True)
class Box(Solid):
    half: tuple[float, float, float]
    open_faces: tuple[int, ...] = ()
    """Of +x, -x, +y, -y, +z, -z, those that are not there."""

    @property
    def size(self) -> float:
        return max(self.half)

    def crossings(self, o: Points, d: Points) -> list[tuple[np.ndarray, Points, np.ndarray]]:
        offset, half, found = o - self.centre, np.array(self.half), []
        for face in {*range(6)} - {*self.open_faces}:
            axis, sign = face // 2, 1 - 2 * (face % 2)
            if half[axis] == 0.0 and sign < 0:
                continue  # a rectangle has one side
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (sign * half[axis] - offset[:, axis]) / d[:, axis]
                at = np.abs(offset + t[:, None] * d)
            is_in = np.all([(at[:, k] <= half[k]) | (k == axis) for k in range(3)], axis=0)
            normal = np.broadcast_to(np.eye(3)[axis], d.shape)
            found.append((np.where(is_in, t, np.nan), normal, np.full(len(t), face)))
        return found


@dataclass(frozen=True)
class Seen:
    """A picture, and what its paths have met."""

    image: np.ndarray
    """(h, w, 3) radiance."""
    is_clear: np.ndarray
    """(h, w) bool: pixels that are more than a pixel away from one whose path meets other faces."""


def _nearest(solids: tuple[Solid, ...], o: Points, d: Points, left: np.ndarray) -> tuple[np.ndarray, ...]:
    """(n,) t, solid, face and (n, 3) normal of first hits of rays that leave the solids ``left``; inf, -1 on a miss."""
    t, met, face, normal = np.full(len(o), np.inf), np.full(len(o), -1), np.full(len(o), -1), np.zeros_like(d)
    for k, solid in enumerate(solids):
        least = np.where(left == k, TOUCHING * solid.size, 0.0)
        for t_here, normal_here, face_here in solid.crossings(o, d):
            is_nearer = (t_here > least) & (t_here < t)
            t, met, face = (np.where(is_nearer, new, old) for new, old in ((t_here, t), (k, met), (face_here, face)))
            normal = np.where(is_nearer[:, None], normal_here, normal)
    return t, met, face, normal


def seen(
    solids: tuple[Solid, ...],
    o: Points,
    d: Points,
    shape: tuple[int, int],
    *,
    sky: np.ndarray,
    ground: np.ndarray,
    most: int,
) -> Seen:
    """What paths bring that start as camera rays of ``shape`` (h, w) and follow at most so many reflections."""
    d = d / np.linalg.norm(d, axis=1, keepdims=True)
    emission, mirror = np.array([s.emission for s in solids]), np.array([s.mirror for s in solids])

    def environment(directions: Points) -> Points:
        blend = 0.5 + 0.5 * directions[:, 2:]
        return blend * sky + (1 - blend) * ground

    radiance, weight, goes_on = np.zeros_like(d), np.ones(len(d)), np.ones(len(d), bool)
    left, signs = np.full(len(d), -1), []
    for bounce in range(most + 1):
        t, met, face, normal = _nearest(solids, o, d, left)
        signs.append(np.where(goes_on, 8 * met + face, -99))
        missed, hit = goes_on & (met < 0), goes_on & (met >= 0)
        radiance[missed] += weight[missed, None] * environment(d[missed])
        radiance[hit] += weight[hit, None] * emission[met[hit]]
        goes_on = hit & (mirror[met] > 0.0)
        o = o + np.where(hit, t, 0.0)[:, None] * d
        d = np.where(goes_on[:, None], d - 2 * (d * normal).sum(axis=1, keepdims=True) * normal, d)
        weight, left = np.where(goes_on, weight * mirror[met], weight), np.where(goes_on, met, left)
        if bounce == most:
            radiance[goes_on] += weight[goes_on, None] * environment(d[goes_on])
    met_by_pixel = np.stack(signs, axis=-1).reshape(*shape, most + 1)
    return Seen(radiance.reshape(*shape, 3), ~near_edge(met_by_pixel))
