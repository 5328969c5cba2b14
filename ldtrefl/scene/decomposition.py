"""A place given by a matrix, as the scale, rotation and translation that an object is placed by."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ldtrefl.base.checked import LARGEST, SMALLEST
from ldtrefl.scene.placement import Matrix

EVEN = 1e-12
"""How far scales along three axes may lie apart, relatively, that are one but for rounding."""


def placed(matrix: np.ndarray) -> dict[str, Any]:
    """The fields of an object that place it where a (4, 4) matrix does: scale, rotate and translate where these can,
    so that the object can be moved by them; else the matrix itself."""
    scale = np.sqrt((matrix[:3, :3] ** 2).sum(axis=0))
    rotation = matrix[:3, :3] / scale
    is_rotation = np.allclose(rotation.T @ rotation, np.eye(3), atol=1e-12) and np.linalg.det(rotation) > 0.0
    fits = (np.abs(matrix[:3, 3]) <= LARGEST).all() and ((scale >= SMALLEST) & (scale <= LARGEST)).all()
    if not (is_rotation and fits):
        return {"matrix": rows_of(matrix)}
    axis, degrees = _axis_and_degrees(rotation)
    is_even = scale.max() - scale.min() <= EVEN * scale.max()
    factors = float(scale.mean()) if is_even else _three(scale)
    return {"scale": factors, "rotate": (*axis, degrees), "translate": _three(matrix[:3, 3])}


def _axis_and_degrees(rotation: np.ndarray) -> tuple[tuple[float, float, float], float]:
    """The axis and the angle of a rotation, by its quaternion (Shepperd 1978)."""
    m = rotation
    candidates = 1.0 + np.array(
        [m[0, 0] - m[1, 1] - m[2, 2], m[1, 1] - m[2, 2] - m[0, 0], m[2, 2] - m[0, 0] - m[1, 1], np.trace(m)]
    )
    most = int(np.argmax(candidates))
    if most == 3:
        x, y, z, w = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], candidates[3]
    else:
        i, j, k = most, (most + 1) % 3, (most + 2) % 3
        vector = np.zeros(3)
        vector[i], vector[j], vector[k] = candidates[most], m[j, i] + m[i, j], m[k, i] + m[i, k]
        x, y, z = vector
        w = m[k, j] - m[j, k]
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return (0.0, 0.0, 1.0), 0.0
    return (x / length, y / length, z / length), math.degrees(2.0 * math.atan2(length, w))


def _three(vector: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in vector)
    return x, y, z


def rows_of(matrix: np.ndarray) -> Matrix:
    """The three rows of a (4, 4) matrix that count."""
    a, b, c = (tuple(map(float, row)) for row in matrix[:3])
    return a, b, c  # type: ignore[return-value]
