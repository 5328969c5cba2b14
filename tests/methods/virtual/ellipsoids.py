"""Ellipsoids as surfaces that the search works on, in closed form, and points of which some are seen at grazing
incidence."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.methods.virtual.fermat_search import Reflection, SearchLimits, fermat_search
from ldtrefl.methods.virtual.radius_map import RadialPoint

RNG = np.random.default_rng(5)


@wp.struct
class Ellipsoid:
    """Of these half axes about O, open above a height."""

    axes: wp.vec3d
    highest: wp.float64  # largest z of a direction in which there is a surface


@wp.func
def ellipsoid_point(surface: Ellipsoid, direction: wp.vec3d) -> RadialPoint:
    """The radius and its gradient in a unit direction."""
    found = RadialPoint()
    if direction[2] <= surface.highest:
        scaled = wp.cw_div(wp.cw_div(direction, surface.axes), surface.axes)
        found.radius = wp.float64(1.0) / wp.sqrt(wp.dot(scaled, direction))
        gradient = -found.radius * found.radius * found.radius * scaled
        found.gradient = gradient - wp.dot(gradient, direction) * direction
    return found


search = fermat_search(Ellipsoid, ellipsoid_point)


@launch.kernel
def find_reflections(
    first: int,
    # In:
    surface: Ellipsoid,
    eyes: wp.array(dtype=wp.vec3d),
    points: wp.array(dtype=wp.vec3d),
    limits: SearchLimits,
    # Out:
    found_out: wp.array(dtype=Reflection),
):
    """Each thread searches for the reflection of one point."""
    i = first + wp.tid()
    found_out[i] = search(surface, eyes[i], points[i], limits)


def reflections(
    axes: tuple[float, float, float],
    eyes: np.ndarray,
    points: np.ndarray,
    *,
    most_iterations: int = 20,
    least_solid_angle: float = 0.0,
    highest: float = 2.0,
) -> np.ndarray:
    """(n,) ``Reflection`` of points in an ellipsoid about the origin."""
    limits = SearchLimits()
    limits.most_iterations, limits.least_area, limits.most_residual = most_iterations, 1e-14, 1e-5
    limits.least_solid_angle = least_solid_angle
    surface = Ellipsoid()
    surface.axes, surface.highest = wp.vec3d(*axes), highest
    device = wp.get_device("cpu")
    found = wp.zeros(len(eyes), dtype=Reflection, device=device)
    given = [wp.array(values, dtype=wp.vec3d, device=device) for values in (eyes, points)]
    launch.launch(find_reflections, len(eyes), [surface, *given, limits, found], device)
    return found.numpy()


def directions(count: int) -> np.ndarray:
    """(count, 3) random unit vectors."""
    ways = RNG.normal(size=(count, 3))
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


def random_pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Eyes and points a thousandth of the radius to a hundred radii above a unit sphere: (n, 3) of those pairs between
    which the sphere does not stand."""
    eyes, points = (directions(count) * (1.0 + 10 ** RNG.uniform(-3, 2, (count, 1))) for _ in range(2))
    is_open = heights_between(eyes, points) > 0.0
    return eyes[is_open], points[is_open]


def grazing_pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """The same that see each other past a unit sphere at a height from a millionth to a tenth of the radius."""
    near = directions(count)
    along = np.cross(near, directions(count))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    near *= 1.0 + 10 ** RNG.uniform(-6, -1, (count, 1))
    before, behind = (10 ** RNG.uniform(-2, 2, (count, 1)) for _ in range(2))
    return near + before * along, near - behind * along


def heights_between(eyes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n,) how far above a unit sphere the way from eye to point is, where it is lowest."""
    way = points - eyes
    share = np.clip(-np.einsum("ij,ij->i", eyes, way) / np.einsum("ij,ij->i", way, way), 0.0, 1.0)
    return np.linalg.norm(eyes + share[:, None] * way, axis=1) - 1.0


def dots(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n,) scalar products."""
    return np.einsum("ij,ij->i", a, b)
