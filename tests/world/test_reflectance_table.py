"""The table of what rough surfaces reflect, against sums over all directions of light and closed forms."""

import numpy as np
import pytest

from ldtrefl.world.reflectance_table import COLUMNS, LEAST_COSINE, ROWS, mean_cosine, reflectance_table

STEPS = 700
"""Directions of light along each axis of the sum. With more the sums change by less than half of what is allowed."""


def summed(alpha: float, cosine: float) -> tuple[float, float]:
    """a and b by the microfacet formula itself, for light from everywhere."""
    height, turn = np.meshgrid(
        (np.arange(STEPS) + 0.5) / STEPS, (np.arange(STEPS) + 0.5) / STEPS * np.pi, indexing="ij"
    )
    out = np.sqrt(1.0 - height**2)
    light = np.stack([out * np.cos(turn), out * np.sin(turn), height], axis=-1)
    view = np.array([np.sqrt(1.0 - cosine**2), 0.0, cosine])
    half = (light + view) / np.linalg.norm(light + view, axis=-1, keepdims=True)
    density = alpha**2 / (np.pi * ((alpha**2 - 1.0) * half[..., 2] ** 2 + 1.0) ** 2)
    of_view = height * np.sqrt(cosine**2 * (1 - alpha**2) + alpha**2)
    of_light = cosine * np.sqrt(height**2 * (1 - alpha**2) + alpha**2)
    once = density * 0.5 / (of_view + of_light) * height * (2.0 * np.pi / STEPS**2)
    grazing = (1.0 - (half * view).sum(axis=-1)) ** 5
    return float((once * (1.0 - grazing)).sum()), float((once * grazing).sum())


@pytest.mark.parametrize("roughness", [0.375, 0.5, 0.75, 1.0])
@pytest.mark.parametrize("column", [0, 6, 16, 31])
def test_entries_are_sums_over_all_light(roughness: float, column: int) -> None:
    table = reflectance_table().reshape(ROWS, COLUMNS, 3)
    expected = summed(roughness**2, max((column / (COLUMNS - 1)) ** 2, LEAST_COSINE))
    np.testing.assert_allclose(table[round(roughness * (ROWS - 1)), column, :2], expected, atol=4e-3)


def test_smooth_surfaces_are_schlicks() -> None:
    cosine = (np.arange(COLUMNS) / (COLUMNS - 1)) ** 2
    first = reflectance_table()[:COLUMNS]
    np.testing.assert_allclose(first[1:, 1], (1.0 - cosine[1:]) ** 5, atol=1e-6)
    np.testing.assert_allclose(first[:, 0] + first[:, 1], 1.0, atol=1e-6)


@pytest.mark.parametrize("alpha", [0.05, 0.25, 0.6])
def test_the_mean_cosine_has_a_closed_form(alpha: float) -> None:
    """The integrals of (2 x - 1)^n / (1 - (1 - alpha^2) x)^2 over microfacets' squared cosine x, from 1/2 to 1."""
    p, log = 1.0 + alpha**2, np.log((1.0 + alpha**2) / (2.0 * alpha**2))
    first = p / alpha**2 - 2.0 - 2.0 * log
    second = p**2 / alpha**2 - 4.0 * alpha**2 - 4.0 * p * log
    assert mean_cosine(alpha) == pytest.approx(second / ((1.0 - alpha**2) * first), abs=1e-5)
    assert mean_cosine(1.0) == pytest.approx(2.0 / 3.0, abs=1e-5)
