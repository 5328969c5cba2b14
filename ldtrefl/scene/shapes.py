"""Procedural meshes by name, centred at the origin: ``make("torus_knot", {"p": 2, "q": 3})``.

Sphere: radius 1. Box, hollow box, room: -1 to 1. Plane: -1 to 1 in x and y, facing +z. Torus: about z, radii 1 and
``minor``. Every other shape fits in the cube from -1 to 1. ``segments`` sets the tessellation. Closed shapes are
closed bit by bit: vertices that stand in one place, split for normals or UVs, have the same coordinates.
"""

from __future__ import annotations

import functools
import inspect
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field, ValidationError, validate_call
from skimage.measure import marching_cubes

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError, first_fault, unknown_name
from ldtrefl.base.sharing import shared_while_used
from ldtrefl.scene import teapot_patches
from ldtrefl.scene.mesh import Mesh

Segments = Annotated[int, Field(strict=True, ge=1, le=4096)]
Around = Annotated[int, Field(strict=True, ge=3, le=8192)]
Grid = Annotated[int, Field(strict=True, ge=16, le=400)]
Fraction = Annotated[float, Field(strict=True, gt=0.0, lt=1.0)]
Flag = Annotated[bool, Field(strict=True)]

# Bytes at the peak of making and rendering, by tools/stress_cases/hostile.py's measure: process size over what the
# process has without the shape.
MADE_NORMALS_BYTES = 300
"""A triangle, where vertex normals are made from the triangles."""
KNOWN_NORMALS_BYTES = 250
"""A triangle, where they are not."""
CELL_BYTES = 60
"""A cell that marching cubes samples."""
MESH_BYTES = 110
"""A triangle that marching cubes gives, while the samples are there."""
FIXED_BYTES = 16 << 10
"""Any shape: what Python and the device keep for it."""


@dataclass(frozen=True)
class _Shape:
    """What is known of a shape; both functions check its parameters."""

    make: Callable[..., Mesh]
    needed: Callable[..., float]
    """Bytes for making and rendering it."""
    smaller: tuple[str, ...]
    """The parameters that make it smaller."""


_SHAPES: dict[str, _Shape] = {}


def names() -> list[str]:
    """The shapes there are."""
    return sorted(_SHAPES)


def make(name: str, params: dict[str, Any] | None = None) -> Mesh:
    """The shape called ``name``. Equal calls return the same mesh, so that its maps are made once.

    Raises:
        InputError: no such shape or parameter, or a value that is not allowed.
    """
    if name not in _SHAPES:
        raise unknown_name("shape", name, _SHAPES)
    try:
        written = json.dumps(params or {}, sort_keys=True, default=_in_json)
    except (TypeError, ValueError, RecursionError) as error:  # names of two kinds, lists within themselves
        raise InputError(f"params: not names and values ({error})") from None
    shape = _SHAPES[name]
    try:
        needed = shape.needed(**json.loads(written))
    except ValidationError as error:
        raise first_fault(error, {"": list(inspect.signature(shape.make).parameters)}).within("params") from None
    # Asked for even if it is in use already: it is part of another scene then.
    budget.take(needed, f"the shape '{name}'", " and ".join(f"params.{key}" for key in shape.smaller))
    return _make(name, written)


def _in_json(value: Any) -> Any:
    """NumPy's numbers and arrays as plain ones, anything else in words: no parameter takes those."""
    return value.tolist() if isinstance(value, (np.generic, np.ndarray)) else str(value)


@shared_while_used
def _make(name: str, params: str) -> Mesh:
    return _SHAPES[name].make(**json.loads(params))


def _shape(needed: Callable[..., float], smaller: str) -> Callable[[Callable[..., Mesh]], Callable[..., Mesh]]:
    """Make a function a shape, named as it is.

    Args:
        needed: its parameters -> the bytes that making and rendering it takes, an estimate.
        smaller: the parameters that make it smaller.
    """

    def register(function: Callable[..., Mesh]) -> Callable[..., Mesh]:
        check = validate_call(config=ConfigDict(allow_inf_nan=False))
        signature = inspect.signature(function)

        @functools.wraps(function)
        def needed_of(*arguments: Any, **given: Any) -> Any:
            values = signature.bind(*arguments, **given)
            values.apply_defaults()
            return needed(**values.arguments)

        _SHAPES[function.__name__] = _Shape(check(function), check(needed_of), tuple(smaller.split()))
        return function

    return register


def _flat(triangles: float) -> float:
    """Bytes of a shape whose normals are known."""
    return FIXED_BYTES + KNOWN_NORMALS_BYTES * triangles


def _smoothed(triangles: float) -> float:
    """Bytes of a shape whose normals are made from its triangles."""
    return FIXED_BYTES + MADE_NORMALS_BYTES * triangles


def _sampled(cells: float, triangles: float) -> float:
    """Bytes of a surface by marching cubes: the samples are gone when the triangles are rendered."""
    return FIXED_BYTES + max(CELL_BYTES * cells + MESH_BYTES * triangles, MADE_NORMALS_BYTES * triangles)


# Building blocks.


def _grid(columns: int, rows: int) -> np.ndarray:
    """Faces of a grid of (columns + 1) x (rows + 1) vertices, row by row; counter-clockwise seen from u x v."""
    u, v = np.meshgrid(np.arange(columns), np.arange(rows))
    corner = (v * (columns + 1) + u).reshape(-1)
    right, up = corner + 1, corner + columns + 1
    return np.concatenate([np.stack([corner, right, up + 1], 1), np.stack([corner, up + 1, up], 1)])


def _without_points(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Faces less those with two corners in one place (the poles of a grid)."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    same = (a == b).all(1) | (b == c).all(1) | (c == a).all(1)
    return faces[~same]


def _parametric(
    position: Callable[[np.ndarray, np.ndarray], np.ndarray],
    columns: int,
    rows: int,
    *,
    wrap_u: bool = False,
    wrap_v: bool = False,
    normal: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
) -> Mesh:
    """A surface over (u, v) in 0..1; a seam's two sides are computed from the same parameter, so they match."""
    i, j = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    u = (i % columns if wrap_u else i).reshape(-1) / columns
    v = (j % rows if wrap_v else j).reshape(-1) / rows
    vertices = position(u, v)
    uvs = np.stack([i.reshape(-1) / columns, j.reshape(-1) / rows], 1)
    faces = _without_points(vertices, _grid(columns, rows))
    return Mesh(vertices, faces, None if normal is None else normal(u, v), uvs)


def _join(*meshes: Mesh) -> Mesh:
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    with_uvs = all(mesh.uvs is not None for mesh in meshes)
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=True)]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.uvs for mesh in meshes if mesh.uvs is not None]) if with_uvs else None,
    )


def _fitted(mesh: Mesh) -> Mesh:
    """The mesh moved and scaled so that its longest side runs from -1 to 1."""
    centre, half = mesh.unit_frame
    return Mesh((mesh.vertices - centre) / half, mesh.faces, mesh.normals, mesh.uvs)


def _rectangle(corners: Sequence[Sequence[float] | np.ndarray], segments: int) -> Mesh:
    """A flat quadrilateral, corners counter-clockwise from the texture's lower left, with its facet normal."""
    a, b, c, d = np.array(corners, float)
    s = np.linspace(0.0, 1.0, segments + 1)
    # Weights of (1 - s, s) form give bit-equal points along a shared edge whichever way it is walked.
    u, v = (x.reshape(-1, 1) for x in np.meshgrid(s, s))
    ur, vr = (x.reshape(-1, 1) for x in np.meshgrid(s[::-1], s[::-1]))
    vertices = vr * (ur * a + u * b) + v * (ur * d + u * c)
    normal = np.cross(b - a, d - a)
    normals = np.tile(normal / np.linalg.norm(normal), (len(vertices), 1))
    return Mesh(vertices, _grid(segments, segments), normals, np.hstack([u, v]))


def _box_sides(segments: int, *, inwards: bool = False) -> list[Mesh]:
    """The six sides of the box from -1 to 1, textures upright on the four that stand."""
    x, y, z = np.eye(3)
    sides = []
    for out, right, up in ((x, y, z), (-x, -y, z), (y, -x, z), (-y, x, z), (z, x, y), (-z, -x, y)):
        across = -right if inwards else right
        corners = [out + s * across + t * up for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        sides.append(_rectangle(corners, segments))
    return sides


def _implicit(field: Callable[..., np.ndarray], extent: tuple[float, float, float], grid: int) -> Mesh:
    """The surface ``field = 0`` (positive inside) by marching cubes, on ``grid`` cells along the longest side."""
    cell = 2.0 * max(extent) / grid
    counts = [int(np.ceil(2.0 * side / cell)) + 1 for side in extent]
    axes = [(np.arange(n) - (n - 1) / 2.0) * cell for n in counts]
    values = field(*np.meshgrid(*axes, indexing="ij"))
    vertices, faces, _, _ = marching_cubes(values, 0.0, spacing=(cell, cell, cell))
    return _outwards(_fitted(Mesh(vertices, faces)))


def _signed_volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, i]].astype(float) for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


# The shapes.


@_shape(lambda segments: _flat(2 * segments[0] * segments[1]), "segments")
def sphere(segments: tuple[Around, Segments] = (192, 96)) -> Mesh:
    """Radius 1; segments around and from pole to pole."""

    def position(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        polar = np.pi * (1.0 - v)
        ring = np.where((v == 0.0) | (v == 1.0), 0.0, np.sin(polar))
        return np.stack([ring * np.cos(2 * np.pi * u), ring * np.sin(2 * np.pi * u), np.cos(polar)], 1)

    return _parametric(position, *segments, wrap_u=True, normal=position)


@_shape(lambda segments: _flat(2 * segments**2), "segments")
def plane(segments: Segments = 1) -> Mesh:
    """-1 to 1 in x and y, facing +z."""
    return _rectangle([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], segments)


@_shape(lambda segments: _flat(12 * segments**2), "segments")
def box(segments: Segments = 1) -> Mesh:
    """-1 to 1, flat sides, the whole texture on each."""
    return _join(*_box_sides(segments))


@_shape(lambda segments: _flat(12 * segments**2), "segments")
def room(segments: Segments = 1) -> Mesh:
    """A box seen from inside."""
    return _join(*_box_sides(segments, inwards=True))


@_shape(lambda hole, segments: _flat(32 * segments**2), "segments")
def hollow_box(hole: Fraction = 0.6, segments: Segments = 1) -> Mesh:
    """A box from -1 to 1 with a square hole of half-width ``hole`` through it, along z."""
    ring = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    sides = []
    for k in range(4):
        (ax, ay), (bx, by) = ring[k], ring[(k + 1) % 4]
        sides.append(_rectangle([[ax, ay, -1], [bx, by, -1], [bx, by, 1], [ax, ay, 1]], segments))
        h = hole
        sides.append(
            _rectangle([[h * bx, h * by, -1], [h * ax, h * ay, -1], [h * ax, h * ay, 1], [h * bx, h * by, 1]], segments)
        )
        top = [[ax, ay, 1], [bx, by, 1], [h * bx, h * by, 1], [h * ax, h * ay, 1]]
        sides.append(_rectangle(top, segments))
        sides.append(_rectangle([[x, y, -1] for x, y, _ in top[::-1]], segments))
    return _join(*sides)


@_shape(lambda minor, segments: _flat(2 * segments[0] * segments[1]), "segments")
def torus(minor: Fraction = 0.35, segments: tuple[Around, Around] = (192, 96)) -> Mesh:
    """About z, radii 1 and ``minor``."""

    def ring(u: np.ndarray) -> np.ndarray:
        return np.stack([np.cos(2 * np.pi * u), np.sin(2 * np.pi * u), 0 * u], 1)

    def normal(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        around, up = np.cos(2 * np.pi * v)[:, None], np.sin(2 * np.pi * v)[:, None]
        return around * ring(u) + up * np.array([0.0, 0.0, 1.0])

    return _parametric(lambda u, v: ring(u) + minor * normal(u, v), *segments, wrap_u=True, wrap_v=True, normal=normal)


@_shape(lambda p, q, tube, segments: _smoothed(2 * segments[0] * segments[1]), "segments")
def torus_knot(
    p: Annotated[int, Field(strict=True, ge=1, le=64)] = 2,
    q: Annotated[int, Field(strict=True, ge=1, le=64)] = 3,
    tube: Fraction = 0.28,
    segments: tuple[Around, Around] = (600, 80),
) -> Mesh:
    """A tube about the (p, q) knot r = 2 + cos(q t), z = sin(q t); ``tube`` is a fraction of the ring's radius 1.6."""

    def curve(t: np.ndarray) -> np.ndarray:
        r = 2.0 + np.cos(q * t)
        return np.stack([r * np.cos(p * t), r * np.sin(p * t), -np.sin(q * t)], 1)

    def position(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        t = 2 * np.pi * u
        step = 1e-4
        ahead, behind = curve(t + step), curve(t - step)
        tangent = ahead - behind
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        # A frame from the curve's position is periodic, which a Frenet frame's sign is not.
        outwards = ahead + behind
        binormal = np.cross(tangent, outwards)
        binormal /= np.linalg.norm(binormal, axis=1, keepdims=True)
        across = np.cross(binormal, tangent)
        angle = 2 * np.pi * v[:, None]
        return curve(t) + 1.6 * tube * (np.cos(angle) * across + np.sin(angle) * binormal)

    return _outwards(_fitted(_parametric(position, *segments, wrap_u=True, wrap_v=True)))


@_shape(lambda grid: _sampled(0.5 * grid**3, 4.5 * grid**2), "grid")
def genus3(grid: Grid = 96) -> Mesh:
    """A rounded disc with three holes: the implicit surface z^2 = k f(x, y), f positive between rim and holes."""
    holes = [(0.52 * np.cos(a), 0.52 * np.sin(a)) for a in np.pi / 2 + np.arange(3) * 2 * np.pi / 3]

    def field(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        f = 1.0 - x**2 - y**2
        for cx, cy in holes:
            distance = (x - cx) ** 2 + (y - cy) ** 2
            f = f * (distance - 0.24**2) / (distance + 0.24**2)
        return 0.14 * f - z**2

    return _implicit(field, (1.1, 1.1, 0.5), grid)


@_shape(lambda periods, grid: _sampled(grid**3, (4.0 + 9.0 * periods) * grid**2), "periods grid")
def gyroid(periods: Annotated[float, Field(strict=True, gt=0, le=8)] = 1.5, grid: Grid = 128) -> Mesh:
    """A gyroid's sheet, given a thickness and cut by a ball: closed, of high genus, with deep layers."""

    def field(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        k = np.pi * periods
        g = np.sin(k * x) * np.cos(k * y) + np.sin(k * y) * np.cos(k * z) + np.sin(k * z) * np.cos(k * x)
        return np.minimum(0.4 - np.abs(g), k * (1.0 - np.sqrt(x**2 + y**2 + z**2)))

    return _implicit(field, (1.1, 1.1, 1.1), grid)


@_shape(
    lambda closed, depth, thickness, segments: _smoothed(2 * segments[0] * _rows(closed, segments[1])),
    "segments",
)
def bowl(
    closed: Flag = True,
    depth: Annotated[float, Field(strict=True, gt=0.05, le=1.0)] = 0.7,
    thickness: Annotated[float, Field(strict=True, gt=0.0, lt=0.5)] = 0.06,
    segments: tuple[Around, Segments] = (128, 48),
) -> Mesh:
    """A round bowl, open upwards: part of a sphere. ``closed`` gives it a wall of ``thickness``; else one sheet."""
    angle = np.arccos(1.0 - depth)
    around, down = segments
    theta = np.linspace(0.0, angle, down + 1)
    inner = np.stack([np.sin(theta), -np.cos(theta)], 1)
    profile = inner[::-1]
    if closed:
        # From the outside's bottom up, half a circle over the rim, and down the inside.
        out, up = inner[-1], np.array([np.cos(angle), np.sin(angle)])
        turn = np.linspace(0.0, np.pi, 9)[1:-1, None]
        rim = out * (1.0 + thickness / 2) + thickness / 2 * (np.cos(turn) * out + np.sin(turn) * up)
        profile = np.concatenate([inner * (1.0 + thickness), rim, profile])
    return _fitted(_revolved(profile, around))


def _rows(closed: bool, segments: int) -> int:
    """Of a bowl's profile: both sides and the rim, or one side."""
    return 2 * segments + 9 if closed else segments


def _revolved(profile: np.ndarray, around: int) -> Mesh:
    """A profile of (radius, z) points turned about z."""
    rows = len(profile) - 1

    def position(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        radius, height = profile[np.round(v * rows).astype(int)].T
        return np.stack([radius * np.cos(2 * np.pi * u), radius * np.sin(2 * np.pi * u), height], 1)

    return _parametric(position, around, rows, wrap_u=True)


@_shape(lambda segments: _smoothed(64 * segments**2), "segments")
def teapot(segments: Segments = 16) -> Mesh:
    """The Utah teapot from its Bezier patches, ``segments`` along a patch's edge. One sheet: lid and body are open."""
    t = np.linspace(0.0, 1.0, segments + 1)
    bernstein = np.stack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3], 1)
    vertices: list[np.ndarray] = []
    faces: list[np.ndarray] = []
    uvs: list[np.ndarray] = []

    def add(patch: tuple[int, ...], mirror: tuple[int, int]) -> None:
        control = teapot_patches.POINTS[list(patch)].reshape(4, 4, 3) * np.array([*mirror, 1.0])
        points = np.einsum("ui,vj,ijk->uvk", bernstein, bernstein, control).reshape(-1, 3)
        points[np.abs(points) < 1e-12] = 0.0  # on a mirror plane both sides must meet exactly
        grid = _grid(segments, segments)
        flipped = mirror[0] * mirror[1] < 0
        kept = _without_points(points, grid[:, ::-1] if flipped else grid)
        faces.append(kept + sum(len(v) for v in vertices))
        vertices.append(points)
        v, u = np.meshgrid(t, t, indexing="ij")
        uvs.append(np.stack([u.reshape(-1), v.reshape(-1)], 1))

    for patch in teapot_patches.FOURFOLD:
        for mirror in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
            add(patch, mirror)
    for patch in teapot_patches.TWOFOLD:
        for mirror in ((1, 1), (1, -1)):
            add(patch, mirror)
    return _fitted(Mesh(np.concatenate(vertices), np.concatenate(faces), None, np.concatenate(uvs)))


@_shape(lambda count, radius, segments: _smoothed(12 * count * segments), "count segments")
def wires(
    count: Annotated[int, Field(strict=True, ge=1, le=256)] = 8,
    radius: Annotated[float, Field(strict=True, gt=0.0, le=0.5)] = 0.01,
    segments: Around = 12,
) -> Mesh:
    """A lattice of thin closed cylinders: ``count`` along x and as many along y, one layer above the other."""
    wire = _revolved(np.array([[0.0, -1.0], [radius, -1.0], [radius, 1.0], [0.0, 1.0]]), segments)
    places = np.linspace(radius - 1.0, 1.0 - radius, count) if count > 1 else np.zeros(1)
    along_x, along_y = wire.vertices[:, [2, 0, 1]], wire.vertices[:, [1, 2, 0]]
    pieces = [Mesh(along_x + np.array([0.0, place, radius]), wire.faces) for place in places]
    pieces += [Mesh(along_y + np.array([place, 0.0, -radius]), wire.faces) for place in places]
    return _join(*pieces)


def _outwards(mesh: Mesh) -> Mesh:
    """The mesh wound so that its volume is positive."""
    if _signed_volume(mesh.vertices, mesh.faces) >= 0:
        return mesh
    return Mesh(mesh.vertices, mesh.faces[:, ::-1], None, mesh.uvs)
