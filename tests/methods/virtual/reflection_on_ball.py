"""Where a ball shows points, found in the plane of eye, centre and point: independently of every search."""

import numpy as np


def unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def is_hidden(eye: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n,) bool: whether the unit ball about 0 stands between the eye and points outside it."""
    way = points - eye
    along = np.clip(-(way @ eye) / (way**2).sum(axis=1), 0.0, 1.0)
    return np.asarray(((eye + along[:, None] * way) ** 2).sum(axis=1) < 1.0)


def reflection_points(eye: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n, 3) where the unit ball about 0 shows (n, 3) points outside it that it does not hide from the eye.

    On the arc between the ways to the eye and to the point the incoming angle grows and the outgoing one falls: where
    they are equal is found by bisection.
    """
    one, across = unit(eye), unit(points)
    across = unit(across - (across @ one)[:, None] * one)
    low = np.zeros(len(points))
    high = np.arccos(np.clip(unit(points) @ one, -1.0, 1.0))
    for _ in range(100):
        middle = (low + high) / 2
        normal = np.cos(middle)[:, None] * one + np.sin(middle)[:, None] * across
        to_eye, to_point = unit(eye - normal), unit(points - normal)
        is_low = (to_eye * normal).sum(axis=1) > (to_point * normal).sum(axis=1)
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    return np.asarray(np.cos(low)[:, None] * one + np.sin(low)[:, None] * across)
