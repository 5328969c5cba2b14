"""Three-quarter views: where a camera must stand so that points fill its picture.

The camera looks at what stands upright, with its front to -y, from the front (``AZIMUTH`` degrees to the left of it)
and from above. That is the side of a file that glTF and Blender call the front.
"""

from __future__ import annotations

import numpy as np

from ldtrefl.base.errors import InputError
from ldtrefl.scene.description import MAX_SIDE, Camera
from ldtrefl.scene.tidy import tidy_point

AZIMUTH = -32.0
"""Degrees from the front (-y) towards +x: where the camera stands, seen from above."""

FOV_Y = 30.0
"""Degrees: that of a portrait lens, whose perspective flatters."""

MARGIN = 0.07
"""What stays free at each edge of the picture, as a share of its shorter side."""

LANDSCAPE, PORTRAIT = (768, 512), (512, 768)
"""Sizes of pictures of which none is asked for."""

Axes = tuple[np.ndarray, np.ndarray, np.ndarray]


def towards(azimuth: float, elevation: float) -> np.ndarray:
    """(3,) unit vector towards what stands ``azimuth`` degrees from -y towards +x, ``elevation`` above the horizon."""
    around, above = np.radians(azimuth), np.radians(elevation)
    return np.array([np.sin(around) * np.cos(above), -np.cos(around) * np.cos(above), np.sin(above)])


def view_axes(elevation: float) -> Axes:
    """Unit vectors to the right, up and forward in a three-quarter view from ``elevation`` degrees above."""
    forward = -towards(AZIMUTH, elevation)
    right = towards(AZIMUTH + 90.0, 0.0)
    return right, np.cross(right, forward), forward


def check_size(size: tuple[int, int] | None) -> None:
    """Refuse what is no size of a picture.

    Raises:
        InputError: it is not a width and a height that are allowed.
    """
    if size is None:
        return
    if len(size) != 2 or not all(isinstance(side, (int, np.integer)) and 1 <= side <= MAX_SIDE for side in size):
        raise InputError(f"size: should be width and height, each a whole number from 1 to {MAX_SIDE}, got {size}")


def three_quarter_camera(points: np.ndarray, elevation: float, size: tuple[int, int] | None, digits: int) -> Camera:
    """The closest camera that has all points in its picture, within its margin.

    Args:
        points: (n, 3) float64, in the world.
        elevation: degrees that the camera looks down.
        size: width and height of the picture; if not given, it is upright or not, whichever is closer.
        digits: decimals that coordinates of the camera are rounded to.
    """
    axes = view_axes(elevation)
    sizes = (LANDSCAPE, PORTRAIT) if size is None else (size,)
    eyes = [closest_eye(points, axes, _slopes(*one)) for one in sizes]
    distances = [float(_along(points - eye, axes[2]).min()) for eye in eyes]
    closest = distances.index(min(distances))
    look_at = eyes[closest] + distances[closest] * axes[2]
    width, height = sizes[closest]
    return Camera(
        eye=tidy_point(eyes[closest], digits),
        look_at=tidy_point(look_at, digits),
        fov_y=FOV_Y,
        width=width,
        height=height,
    )


def _slopes(width: int, height: int) -> tuple[float, float]:
    """The largest of ``|x| / z`` and ``|y| / z`` inside the margin of a picture."""
    edge = np.tan(np.radians(FOV_Y / 2.0))
    margin = 2.0 * MARGIN * edge * min(width, height) / height
    return edge * width / height - margin, edge - margin


def closest_eye(points: np.ndarray, axes: Axes, slopes: tuple[float, float]) -> np.ndarray:
    """(3,) float64: the closest eye that sees all points inside its picture.

    Along its line of sight the eye goes as near as they allow; they then reach two opposite edges of the picture, and
    stand in the middle between the others.

    A point (x, y, z) along the axes is seen from the eye (a, b, c) at ``(x - a) / (z - c)`` and ``(y - b) / (z - c)``.
    To lie within a slope s it takes ``x - s z <= a - s c`` and ``a + s c <= x + s z``: an ``a`` that suits all points
    exists where ``2 s c`` is at most ``min(x + s z) - max(x - s z)``.

    Args:
        points: (n, 3).
        axes: unit vectors to the right, up and forward in the picture, at right angles.
        slopes: the largest of ``|x| / z`` and ``|y| / z``: tangents of half the field of view, less a margin.
    """
    right, up, forward = axes
    middle = points.mean(axis=0)  # far from the origin, products of coordinates would lose their last digits
    along_axes = [_along(points - middle, axis) for axis in axes]
    lows, highs = [], []
    for across, slope in zip(along_axes[:2], slopes, strict=True):
        lows.append((across - slope * along_axes[2]).max())
        highs.append((across + slope * along_axes[2]).min())
    depth = min((high - low) / (2.0 * slope) for low, high, slope in zip(lows, highs, slopes, strict=True))
    return middle + (lows[0] + highs[0]) / 2.0 * right + (lows[1] + highs[1]) / 2.0 * up + depth * forward


def _along(points: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """(n,) coordinates along an axis. Not by BLAS, whose threads go on spinning afterwards."""
    return np.einsum("ij,j->i", points, axis)
