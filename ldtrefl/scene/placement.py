"""Where objects stand: upright and fitted, then scale, rotate, translate. Many objects are placed at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from ldtrefl.base.checked import LARGEST, SMALLEST
from ldtrefl.base.errors import InputError

UpAxis = Literal["x", "y", "z", "-x", "-y", "-z"]

_UPRIGHT: dict[UpAxis, list[list[float]]] = {
    "x": [[0, -1, 0], [0, 0, -1], [1, 0, 0]],
    "y": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    "z": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "-x": [[0, 1, 0], [0, 0, -1], [-1, 0, 0]],
    "-y": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
    "-z": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
}
"""The rotations that turn an axis to +z: about x; of x itself, about z to y first. What glTF calls the front, +z with
y up, comes to -y."""

Row = tuple[float, float, float, float]
Matrix = tuple[Row, Row, Row]
"""Three rows of a matrix whose fourth is 0, 0, 0, 1."""

_IDENTITY = np.eye(4)
_QUARTERS = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
"""Cosine and sine of whole quarter turns."""


def placement(
    bounds: np.ndarray,
    fit: float | None,
    scale: float | tuple[float, float, float],
    rotate: tuple[float, float, float, float],
    translate: tuple[float, float, float],
    up_axis: UpAxis = "z",
    matrix: Matrix | None = None,
) -> np.ndarray:
    """``world_from_object``, (4, 4) float64, of one object; :func:`placements` says what is what, and a ``matrix`` of
    three rows moves the mesh first.

    Raises:
        InputError: its size along an axis is not allowed.
    """
    fitted, scales = np.array([np.nan if fit is None else fit]), np.broadcast_to(scale, (1, 3)).astype(float)
    turn, offset = np.array([rotate], float), np.array([translate], float)
    matrices = placements(bounds[None], fitted, scales, turn, offset, [up_axis])
    if matrix is not None:
        matrices = moved_first(matrices, np.array([matrix]))
    if len(wrong_sizes(matrices, bounds[None])):
        (side,), sizes = _longest_sides(bounds[None]), _sizes(matrices, bounds[None])
        given = "" if fit is None else f"fit {fit:g}, "
        given += "" if matrix is None else "the matrix, "
        raise InputError(
            f"{given}scale {scale} and the mesh's own size of {side:g} give a size of {sizes.min():g} to "
            f"{sizes.max():g} along its axes, allowed are {SMALLEST:g} to {LARGEST:g}"
        )
    return matrices[0]


def placements(
    bounds: np.ndarray,
    fit: np.ndarray,
    scale: np.ndarray,
    rotate: np.ndarray,
    translate: np.ndarray,
    up_axes: Sequence[UpAxis] = (),
) -> np.ndarray:
    """``world_from_object`` of n objects, (n, 4, 4) float64; some may not be allowed (:func:`wrong_sizes`).

    Args:
        bounds: (n, 2, 3), the lowest and highest corner of each mesh's box.
        fit: (n,), centre the box at 0 and scale its longest side to this, first; NaN to leave the mesh as it is.
        scale: (n, 3), a factor for each axis.
        rotate: (n, 4), axis and degrees.
        translate: (n, 3), in the world.
        up_axes: n axes of the meshes that become +z, before the scale; z if none are given.
    """
    low, high = bounds[:, 0], bounds[:, 1]
    side = _longest_sides(bounds)
    with np.errstate(all="ignore"):  # what is not finite is not allowed
        matrices = _identities(len(fit))
        np.multiply(_rotations(rotate), scale[:, None, :], out=matrices[:, :3, :3])
        matrices[:, :3, 3] = translate
        turned = [number for number, axis in enumerate(up_axes) if axis != "z"]
        if turned:
            matrices[turned, :3, :3] @= np.array([_UPRIGHT[up_axes[number]] for number in turned])
        fitted = np.flatnonzero(~np.isnan(fit))
        factor = np.divide(fit, side, out=np.ones_like(fit), where=side > 0.0)[fitted]
        centring = _translations(-(low + (high - low) / 2)[fitted])
        matrices[fitted] @= _scalings(np.repeat(factor[:, None], 3, axis=1)) @ centring
        return matrices


def moved_first(matrices: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(n, 4, 4) placements of meshes that are first moved by (n, 3, 4) rows of matrices."""
    first = _identities(len(matrices))
    first[:, :3] = rows
    with np.errstate(all="ignore"):  # what is not finite is not allowed
        return np.einsum("nij,njk->nik", matrices, first)


def wrong_sizes(matrices: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Numbers of the objects whose size along an axis is not allowed, from their (n, 4, 4) placements."""
    sizes = _sizes(matrices, bounds)
    allowed = np.isfinite(matrices).all(axis=(1, 2)) & ((sizes >= SMALLEST) & (sizes <= LARGEST)).all(axis=1)
    return np.flatnonzero(~allowed)


def _longest_sides(bounds: np.ndarray) -> np.ndarray:
    """(n,) longest side of each box."""
    return (bounds[:, 1] - bounds[:, 0]).max(axis=1)


def _sizes(matrices: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """(n, 3) lengths in the world, along each object's own axes, of its box's longest side."""
    side = _longest_sides(bounds)
    with np.errstate(all="ignore"):
        columns = matrices[:, :3, :3] * np.where(side > 0.0, side, 1.0)[:, None, None]
        return np.sqrt((columns**2).sum(axis=1))


def _identities(count: int) -> np.ndarray:
    matrices = np.empty((count, 4, 4))
    matrices[:] = _IDENTITY
    return matrices


def _translations(offsets: np.ndarray) -> np.ndarray:
    matrices = _identities(len(offsets))
    matrices[:, :3, 3] = offsets
    return matrices


def _scalings(factors: np.ndarray) -> np.ndarray:
    matrices = _identities(len(factors))
    for axis in range(3):
        matrices[:, axis, axis] = factors[:, axis]
    return matrices


def _rotations(axes_and_degrees: np.ndarray) -> np.ndarray:
    """(n, 3, 3), by Rodrigues' formula."""
    axes = axes_and_degrees[:, :3]
    axes = axes / np.sqrt(np.vecdot(axes, axes))[:, None]
    # Whole quarter turns must be exact, so that they only permute axes.
    degrees = axes_and_degrees[:, 3] % 360.0
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    is_quarter = degrees % 90.0 == 0.0
    cosine[is_quarter], sine[is_quarter] = _QUARTERS[(degrees[is_quarter] / 90.0).astype(int) % 4].T
    x, y, z = axes.T
    cross = np.zeros((len(axes), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -z, y, -x
    cross[:, 1, 0], cross[:, 2, 0], cross[:, 2, 1] = z, -y, x
    along = axes[:, :, None] * axes[:, None, :]
    cosine, sine = cosine[:, None, None], sine[:, None, None]
    return cosine * _IDENTITY[:3, :3] + sine * cross + (1 - cosine) * along
