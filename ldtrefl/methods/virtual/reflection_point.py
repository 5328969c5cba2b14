"""Where points are seen in a mirror: on a sphere, a plane, or any star-shaped mesh.

    eye, points = (0.0, 0.0, 5.0), [(3.0, 0.0, 1.0), (0.0, 4.0, 2.0)]
    seen = ldtrefl.reflection_point(eye, points, ldtrefl.Sphere(centre=(0.0, 0.0, 0.0), radius=1.0))
    seen.points[seen.converged]

A mirror ball is calibrated by such points, and so is a camera that looks at a curved mirror. On a sphere this is
Alhazen's problem. The search is that of ``methods/virtual/fermat_search.py``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import warp as wp
from numpy.typing import ArrayLike
from pydantic.dataclasses import dataclass as checked_dataclass

from ldtrefl.base.checked import CONFIG, Direction, Positive, Vector, refusing_in_one_line
from ldtrefl.base.errors import InputError
from ldtrefl.device import launch
from ldtrefl.methods.virtual.fermat_search import Reflection, SearchLimits, fermat_search
from ldtrefl.methods.virtual.radius_map import RadialPoint, RadiusMap, radial_point
from ldtrefl.methods.virtual.star_shape import star_shape
from ldtrefl.scene.mesh import Mesh

MOST_ITERATIONS = 20
"""Of a search: what Roger and Holzschuch (2006) see at grazing incidence."""

LEAST_AREA = 1e-14
"""Area of the triangle of samples, over the radius squared, at which a search ends. The next sample's error is of its
order."""

MOST_RESIDUAL = 1e-5
"""Radians. On a convex mirror the normal turns as far as the point moves, and the mirrored view twice as far."""

INTERVALS = 256
"""Along a side of a face of a mesh's map of radii. A smooth surface is then known to 1e-5 of its size."""


@refusing_in_one_line
@checked_dataclass(frozen=True, kw_only=True, config=CONFIG)
class Sphere:
    """A mirror ball."""

    centre: Vector
    radius: Positive


@refusing_in_one_line
@checked_dataclass(frozen=True, kw_only=True, config=CONFIG)
class Plane:
    """A flat mirror without end."""

    point: Vector
    """Any point of it."""
    normal: Direction
    """Of any length. Both sides mirror."""


@dataclass(frozen=True)
class ReflectionPoints:
    """Where points of shape (..., 3) are seen in a mirror."""

    points: np.ndarray
    """(..., 3) float64 on the mirror. Where not converged, it is no reflection."""
    converged: np.ndarray
    """(...) bool, whether the mirror shows the point there: ``residual`` is at most 1e-5, and eye and point are on the
    same side of the mirror."""
    residual: np.ndarray
    """(...) float64, radians between the eye's view, mirrored there, and the way on to the point."""
    iterations: np.ndarray
    """(...) int, samples of the mirror that the search took after the first three."""


@wp.func
def unit_sphere(surface: wp.float64, direction: wp.vec3d) -> RadialPoint:
    """The surface of a sphere of this radius about O."""
    found = RadialPoint()
    found.radius = surface
    return found


search_sphere = fermat_search(wp.float64, unit_sphere)
search_map = fermat_search(RadiusMap, radial_point)


@launch.kernel
def find_on_sphere(
    first: int,
    # In:
    radius: wp.float64,
    eyes: wp.array(dtype=wp.vec3d),
    points: wp.array(dtype=wp.vec3d),
    limits: SearchLimits,
    # Out:
    found_out: wp.array(dtype=Reflection),
):
    """Find where a sphere about 0 mirrors one point."""
    i = first + wp.tid()
    found_out[i] = search_sphere(radius, eyes[i], points[i], limits)


@launch.kernel
def find_on_map(
    first: int,
    # In:
    surface: RadiusMap,
    eyes: wp.array(dtype=wp.vec3d),
    points: wp.array(dtype=wp.vec3d),
    limits: SearchLimits,
    # Out:
    found_out: wp.array(dtype=Reflection),
):
    """Find where a star-shaped surface mirrors one point; positions are from its O."""
    i = first + wp.tid()
    found_out[i] = search_map(surface, eyes[i], points[i], limits)


def reflection_point(eye: ArrayLike, points: ArrayLike, reflector: Sphere | Plane | Mesh) -> ReflectionPoints:
    """Where on a mirror an eye sees points.

    Light takes a path of extremal length. On a convex mirror that is the shortest one by way of it, and the only one.
    Where eye and point are both inside a sphere or a bowl, up to four points of a sphere mirror, and more of others:
    one of them is found. What the mirror itself hides is not converged, and neither are points on the other side than
    the eye, such as inside a sphere that is seen from outside. Nothing else is taken to hide anything.

    Args:
        eye: (3,) or any shape (..., 3) that fits the points': where it is looked from.
        points: (..., 3) what is mirrored.
        reflector: a ``Sphere``, a ``Plane``, or a star-shaped ``Mesh``, one that is all seen from a point inside or, of
            an open one, before it. Its shading normals mirror: it stands for a smooth surface.

    Raises:
        InputError: the shapes do not fit, a number is not finite, or the mesh is not star-shaped.
    """
    eyes, targets = _positions(eye, "eye"), _positions(points, "points")
    try:
        eyes, targets = np.broadcast_arrays(eyes, targets)
    except ValueError:
        raise InputError(f"eye of shape {eyes.shape} and points of shape {targets.shape} do not fit") from None
    shape = targets.shape[:-1]
    flat_eyes, flat_targets = eyes.reshape(-1, 3), targets.reshape(-1, 3)
    if isinstance(reflector, Sphere):
        found = _on_sphere(flat_eyes, flat_targets, reflector)
    elif isinstance(reflector, Plane):
        found = _on_plane(flat_eyes, flat_targets, reflector)
    elif isinstance(reflector, Mesh):
        found = _on_mesh(flat_eyes, flat_targets, reflector)
    else:
        raise InputError(f"reflector: a Sphere, a Plane or a Mesh, got {type(reflector).__name__}")
    return ReflectionPoints(
        found.points.reshape(targets.shape),
        found.converged.reshape(shape),
        found.residual.reshape(shape),
        found.iterations.reshape(shape),
    )


def _positions(values: ArrayLike, name: str) -> np.ndarray:
    """(..., 3) float64, checked."""
    try:
        given = np.asarray(values, float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: numbers of shape (..., 3), got {type(values).__name__}") from None
    if given.ndim == 0 or given.shape[-1] != 3:
        raise InputError(f"{name}: shape (..., 3), got {given.shape}")
    if not np.isfinite(given).all():
        raise InputError(f"{name}: a number is not finite")
    return given


def _on_sphere(eyes: np.ndarray, points: np.ndarray, sphere: Sphere) -> ReflectionPoints:
    """By the search, on a unit sphere about 0."""
    centre = np.array(sphere.centre)
    return _found(find_on_sphere, wp.float64(1.0), eyes, points, centre, sphere.radius)


def _on_mesh(eyes: np.ndarray, points: np.ndarray, mesh: Mesh) -> ReflectionPoints:
    """By the search, on a map of the radii of the mesh, scaled to size 1."""
    middle, half = mesh.unit_frame
    shape = star_shape((mesh.vertices - middle) / half, mesh.faces, mesh.normals.astype(float), "the mesh")
    surface = shape.radius_map(INTERVALS, launch.resolve_device(None))
    found = _found(find_on_map, surface, eyes, points, middle + half * shape.centre, half)
    # The map goes on beyond the rim of an open mesh.
    ways = (found.points - middle) / half - shape.centre
    lengths = np.linalg.norm(ways, axis=1, keepdims=True)
    radii, _ = shape.radii(ways / np.where(lengths > 0.0, lengths, 1.0))
    return replace(found, converged=found.converged & (radii > 0.0))


def _found(
    kernel: wp.Kernel, surface: object, eyes: np.ndarray, points: np.ndarray, centre: np.ndarray, unit: float
) -> ReflectionPoints:
    """What a search finds on a surface about ``centre``, in lengths of ``unit``."""
    limits = SearchLimits()
    limits.most_iterations, limits.least_area, limits.most_residual = MOST_ITERATIONS, LEAST_AREA, MOST_RESIDUAL
    device = launch.resolve_device(None)
    given = [wp.array((each - centre) / unit, dtype=wp.vec3d, device=device) for each in (eyes, points)]
    reflections = wp.zeros(len(eyes), dtype=Reflection, device=device)
    launch.launch(kernel, len(eyes), [surface, *given, limits, reflections], device)
    found = reflections.numpy()
    residual = np.where(found["iterations"] > 0, found["residual"], np.pi)
    return ReflectionPoints(centre + unit * found["point"], found["is_found"] == 1, residual, found["iterations"])


def _on_plane(eyes: np.ndarray, points: np.ndarray, plane: Plane) -> ReflectionPoints:
    """In closed form: heights above the plane divide the way between the feet of eye and point."""
    normal = np.array(plane.normal) / np.linalg.norm(plane.normal)
    of_eye, of_point = ((positions - plane.point) @ normal for positions in (eyes, points))
    both = np.abs(of_eye) + np.abs(of_point)
    share = np.where(both > 0.0, np.abs(of_eye) / np.where(both > 0.0, both, 1.0), 0.5)[:, None]
    feet = (positions - height[:, None] * normal for positions, height in ((eyes, of_eye), (points, of_point)))
    foot_of_eye, foot_of_point = feet
    at = (1.0 - share) * foot_of_eye + share * foot_of_point
    view, onwards = at - eyes, points - at
    mirrored = view - 2.0 * (view @ normal)[:, None] * normal
    angle = np.arctan2(np.linalg.norm(np.cross(mirrored, onwards), axis=1), np.einsum("ij,ij->i", mirrored, onwards))
    converged = (of_eye * of_point > 0.0) & (angle <= MOST_RESIDUAL)
    return ReflectionPoints(at, converged, angle, np.zeros(len(at), int))
