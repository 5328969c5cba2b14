"""Where an object stands: fit, then scale, rotate, translate."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ldtrefl.base.checked import LARGEST, SMALLEST
from ldtrefl.base.errors import InputError


def placement(
    bounds: np.ndarray,
    fit: float | None,
    scale: float | tuple[float, float, float],
    rotate: tuple[float, float, float, float],
    translate: tuple[float, float, float],
) -> np.ndarray:
    """``world_from_object``, (4, 4) float64.

    Args:
        bounds: (2, 3), the lowest and highest corner of the mesh's box.
        fit: centre the box at 0 and scale its longest side to this, first; None to leave the mesh as it is.
        scale: one factor, or one for each axis.
        rotate: axis and degrees.
        translate: in the world.

    Raises:
        InputError: they give a size along an axis that is not allowed.
    """
    low, high = bounds
    side = float((high - low).max())
    matrix = np.eye(4)
    with np.errstate(all="ignore"):  # what is not finite is refused below
        if fit is not None:
            matrix = _scaling(fit / side if side > 0.0 else 1.0) @ _translation(-(low + (high - low) / 2))
        matrix = _translation(translate) @ _rotation(rotate) @ _scaling(scale) @ matrix
        sizes = np.linalg.norm(matrix[:3, :3] * (side or 1.0), axis=0)
    if not (np.isfinite(matrix).all() and SMALLEST <= sizes.min() and sizes.max() <= LARGEST):
        given = "" if fit is None else f"fit {fit:g}, "
        raise InputError(
            f"{given}scale {scale} and the mesh's own size of {side:g} give a size of {sizes.min():g} to "
            f"{sizes.max():g} along its axes, allowed are {SMALLEST:g} to {LARGEST:g}"
        )
    return matrix


def _translation(offset: ArrayLike) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def _scaling(factor: ArrayLike) -> np.ndarray:
    return np.diag([*np.broadcast_to(factor, 3), 1.0]).astype(float)


def _rotation(axis_and_degrees: tuple[float, float, float, float]) -> np.ndarray:
    """Rodrigues' formula."""
    axis = np.asarray(axis_and_degrees[:3], float)
    x, y, z = axis / np.linalg.norm(axis)
    # Whole quarter turns must be exact, so that they only permute axes.
    degrees = axis_and_degrees[3] % 360.0
    quarters = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}
    cosine, sine = quarters.get(degrees, (np.cos(np.radians(degrees)), np.sin(np.radians(degrees))))
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    along = np.outer([x, y, z], [x, y, z])
    matrix = np.eye(4)
    matrix[:3, :3] = cosine * np.eye(3) + sine * cross + (1 - cosine) * along
    return matrix
