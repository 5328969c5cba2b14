"""Numbers that a person would write: coordinates rounded to as many decimals as a scene's size gives a meaning to."""

from __future__ import annotations

import math

import numpy as np

FIGURES = 4
"""Digits that the size of a scene is written with: a ten-thousandth of it is less than a pixel."""


def decimals_for(size: float) -> int:
    """How many decimals a coordinate has in a scene of this size; negative for tens and hundreds."""
    return FIGURES - 1 - math.floor(math.log10(size))


def tidy(value: float, digits: int) -> float:
    """A number of so many decimals; of -0 it makes 0."""
    return round(float(value), digits) + 0.0


def tidy_below(value: float, digits: int) -> float:
    """The largest number of so many decimals that is not above ``value``."""
    rounded = tidy(value, digits)
    return rounded if rounded <= value else tidy(rounded - 10.0**-digits, digits)


def tidy_point(point: np.ndarray, digits: int) -> tuple[float, float, float]:
    """A point whose coordinates have so many decimals."""
    x, y, z = (tidy(value, digits) for value in point)
    return x, y, z
