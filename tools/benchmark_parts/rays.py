"""Kinds of rays against a mesh of side 2 about the origin, as their users send them: in rows of pixels, or at random.

Directions are unit vectors, float32. Closest hits: ``primary`` of a camera; ``mirror, few hits``, reflected off a ball
beside the object, of which a third meet the object's box; ``mirror, many hits``, only those that meet it, as a renderer
that culls sends them; ``second bounce`` of those; ``random, from outside``, from a sphere about the object to points of
its box; ``random, from within``, from points of its box anywhere; ``close-up``, at boxes of all sizes alike, in cities.
Any hit: ``shadow``, from what the camera sees to a distant light; ``random, any hit``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from .models import CITIES, Model

KINDS = (
    "primary",
    "mirror, few hits",
    "mirror, many hits",
    "second bounce",
    "random, from outside",
    "random, from within",
    "close-up",
    "shadow",
    "random, any hit",
)

RAYS = 100_000
"""About as many as each kind has."""

EYE, FIELD = np.array([1.5, -4.2, 1.4]), 24.0
"""Of the camera of primary rays, which looks at the origin: where it is and its field of view, degrees."""

LIGHT = np.array([0.4, -0.5, 0.77]) / np.linalg.norm([0.4, -0.5, 0.77])
"""Towards the distant light."""

SURFACE = 1e-4
"""How far above the surface rays start that leave it."""

AROUND = 3.0
"""Radius of the sphere about the object."""

FirstHits = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""(n, 3) origins and directions to (n,) distances and triangles, -1 on a miss."""


@dataclass(frozen=True)
class Rays:
    """Rays of one kind."""

    kind: str
    origins: np.ndarray
    directions: np.ndarray
    any_hit: bool = False
    size: tuple[int, int] | None = None
    """Columns and rows of the picture, where the rays are all rays of the camera at ``EYE``."""


def kinds_of(model: Model, first_hits: FirstHits, rays: int = RAYS) -> Iterator[Rays]:
    """All kinds of rays against this mesh; ``first_hits`` tells where the later ones start."""
    rng = np.random.default_rng(0)
    yield Rays("primary", *camera_rays(*_picture(rays)), size=_picture(rays))
    yield Rays("mirror, few hits", *mirror_rays(*_picture(3.93 * rays)))
    many = mirror_rays_that_enter(model.box, rays)
    yield Rays("mirror, many hits", *many)
    yield Rays("second bounce", *second_bounce(model, first_hits, *many))
    outside = Rays("random, from outside", *rays_from_outside(model.box, rays, rng))
    yield outside
    yield Rays("random, from within", *rays_from_within(model.box, rays, rng))
    if model.name in CITIES:
        yield Rays("close-up", *rays_at_triangles(model, rays, rng))
    yield Rays("shadow", *shadow_rays(model, first_hits, rays), any_hit=True)
    yield Rays("random, any hit", outside.origins, outside.directions, any_hit=True)


def _picture(rays: float) -> tuple[int, int]:
    """Columns and rows of a picture of 3 to 2 with about so many pixels."""
    rows = 2 * round((rays / 6) ** 0.5)
    return 3 * rows // 2, rows


def _single(origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As contiguous float32; directions are made unit vectors first."""
    unit = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    return np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(unit, np.float32)


def unit_rays(eye: np.ndarray, look_at: np.ndarray, fov_y: float, columns: int, rows: int) -> np.ndarray:
    """(rows * columns, 3) unit directions through the pixels of a camera, z up, row by row from the top."""
    forward = (look_at - eye) / np.linalg.norm(look_at - eye)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    half = np.tan(np.radians(fov_y / 2.0))
    x, y = np.meshgrid((np.arange(columns) + 0.5) / columns * 2 - 1, (np.arange(rows) + 0.5) / rows * 2 - 1)
    rays = forward + (x * half * columns / rows)[..., None] * right + (y * half)[..., None] * down
    return (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).reshape(-1, 3)


def camera_rays(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """The primary rays of such a picture."""
    directions = unit_rays(EYE, np.zeros(3), FIELD, columns, rows)
    return _single(np.broadcast_to(EYE, directions.shape), directions)


def mirror_rays(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) float32 origins and directions in the unit space of an object beside a mirror ball."""
    eye, scale, place = np.array([0, -4.0, 0.6]), 1.3, np.array([0.6, -1.9, 0.5])
    rays = unit_rays(eye, np.zeros(3), 40.0, width, height)
    b = rays @ eye
    square = b * b - eye @ eye + 1.0
    rays, b, square = rays[square > 0], b[square > 0], square[square > 0]
    points = eye + (-b - np.sqrt(square))[:, None] * rays
    directions = rays - 2 * (rays * points).sum(axis=1, keepdims=True) * points
    return ((points - place) / scale).astype(np.float32), directions.astype(np.float32)


def mirror_rays_that_enter(box: np.ndarray, rays: int) -> tuple[np.ndarray, np.ndarray]:
    """Those of the mirror's rays that meet the box, of a picture so fine that there are about ``rays`` of them."""
    few = 20_000
    share = max(float(enters(box, *mirror_rays(*_picture(few))).sum()) / few, 1e-3)
    origins, directions = mirror_rays(*_picture(rays / share))
    inside = enters(box, origins, directions)
    return np.ascontiguousarray(origins[inside]), np.ascontiguousarray(directions[inside])


def enters(box: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(n,) bool: slab test."""
    with np.errstate(divide="ignore", invalid="ignore"):
        to_planes = (box[:, None, :] - origins) / directions
    near, far = np.nanmin(to_planes, axis=0).max(axis=1), np.nanmax(to_planes, axis=0).min(axis=1)
    return (near <= far) & (far >= 0.0)


def _surface_points(
    model: Model, first_hits: FirstHits, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points just above what the rays meet of the mesh proper, its unit normals on their side, and their directions."""
    t, triangle = first_hits(origins, directions)
    hit = triangle >= 0
    o, d, corners = (
        origins[hit].astype(float),
        directions[hit].astype(float),
        model.vertices[model.faces[triangle[hit]]],
    )
    a, b, c = corners.astype(float).transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    points = o + t[hit, None] * d
    # An outlier is left out, so that the rays are the same with it and without.
    kept = (length > 0.0) & (np.abs(points) <= np.abs(model.box).max() + SURFACE).all(axis=1)
    points, normal, d = points[kept], normal[kept] / length[kept, None], d[kept]
    normal *= -np.sign((normal * d).sum(axis=1, keepdims=True))
    return points + SURFACE * normal, normal, d


def second_bounce(
    model: Model, first_hits: FirstHits, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where these rays meet the mesh they are reflected by its facets."""
    points, normal, d = _surface_points(model, first_hits, origins, directions)
    return _single(points, d - 2.0 * (d * normal).sum(axis=1, keepdims=True) * normal)


def shadow_rays(model: Model, first_hits: FirstHits, rays: int) -> tuple[np.ndarray, np.ndarray]:
    """To the light from what the camera sees facing it, in a picture so fine that there are about ``rays`` of them."""

    def from_picture(pixels: float) -> np.ndarray:
        points, normal, _ = _surface_points(model, first_hits, *camera_rays(*_picture(pixels)))
        return points[normal @ LIGHT > 0.0]

    share = max(len(from_picture(rays / 5)) / (rays / 5), 1e-2)
    points = from_picture(rays / share)
    return _single(points, np.broadcast_to(LIGHT, points.shape))


def rays_from_outside(box: np.ndarray, rays: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """From a sphere about the object to points of its box."""
    around = rng.normal(size=(rays, 3))
    around *= AROUND / np.linalg.norm(around, axis=1, keepdims=True)
    return _single(around, rng.uniform(box[0], box[1], (rays, 3)) - around)


def rays_from_within(box: np.ndarray, rays: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """From points of the box in all directions."""
    return _single(rng.uniform(box[0], box[1], (rays, 3)), rng.normal(size=(rays, 3)))


def rays_at_triangles(model: Model, rays: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """At triangles of all sizes alike, from a few to a hundred of their own sizes away."""
    corners = model.vertices[model.faces[rng.integers(0, len(model.faces), rays)]].astype(float)
    middle = corners.mean(axis=1)
    reach = np.abs(corners - middle[:, None]).max(axis=(1, 2))[:, None]
    around = rng.normal(size=(rays, 3))
    around *= reach * 10.0 ** rng.uniform(0.5, 2, (rays, 1)) / np.linalg.norm(around, axis=1, keepdims=True)
    return _single(middle + around, rng.uniform(-1.2, 1.2, (rays, 3)) * reach - around)
