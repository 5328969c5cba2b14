"""How much rough surfaces reflect of light that comes from everywhere, in a table.

The microfacets are GGX's with height-correlated Smith masking, and Fresnel's reflectance is Schlick's. So a surface
with reflectance ``low`` at normal incidence and ``high`` along it reflects ``low * a + high * b`` once (B. Karis, "Real
Shading in Unreal Engine 4", 2013, the split sum). What microfacets reflect to each other is added by who reads the
table (E. Turquin, "Practical multiple scattering compensation for microfacet models", 2019).

The third number is how rough surfaces blur: the mean cosine between the rays that they mirror to a viewer who looks
straight at them, weighted as the environment is, and the mirrored ray. Whatever is linear in the direction, such as an
environment of two colours, is blurred to its mean by that factor.
"""

from __future__ import annotations

import functools

import numpy as np

ROWS = 17
"""Roughness 0 to 1. Row 0 is the smooth surface, of which the closed form is taken."""

COLUMNS = 32
"""Cosines of the way to the viewer with the normal, 0 to 1: the squares of equal steps, for it changes most near 0."""

SAMPLES = (32, 12)
"""Microfacet normals for an entry: across the lobe, and around half of it. Many more change no entry by 0.002."""

LEAST_COSINE = 1e-3
"""Cosine that stands for 0, where no microfacet would be seen."""


@functools.cache
def reflectance_table() -> np.ndarray:
    """(ROWS * COLUMNS, 3) float32: a, b, and the mean cosine. It is not to be changed."""
    made = np.empty((ROWS, COLUMNS, 3))
    cosine = np.maximum((np.arange(COLUMNS) / (COLUMNS - 1)) ** 2, LEAST_COSINE)
    for row, roughness in enumerate(np.arange(ROWS) / (ROWS - 1)):
        if row == 0:
            grazing = (1.0 - cosine) ** 5
            made[row] = np.stack([1.0 - grazing, grazing, np.ones(COLUMNS)], axis=1)
        else:
            made[row, :, 0], made[row, :, 1] = _reflected_once(roughness**2, cosine)
            made[row, :, 2] = mean_cosine(roughness**2)
    table = made.reshape(-1, 3).astype(np.float32)
    table.flags.writeable = False
    return table


def _reflected_once(alpha: float, cosine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) a and b, by sampling the microfacets that the viewer sees (E. Heitz, "Sampling the GGX Distribution of
    Visible Normals", 2018)."""
    across, around = ((np.arange(count) + 0.5) / count for count in SAMPLES)
    edge, second = (grid.ravel() for grid in np.meshgrid(across, around, indexing="ij"))
    first, dense = 1.0 - edge**2, 2.0 * edge  # most of them near the lobe's rim, where microfacets are hidden
    view = np.stack([np.sqrt(1.0 - cosine**2), np.zeros_like(cosine), cosine], axis=1)[:, None, :]
    stretched = view * [alpha, alpha, 1.0]
    stretched /= np.linalg.norm(stretched, axis=2, keepdims=True)
    side = np.array([0.0, 1.0, 0.0])  # across the plane of the viewer
    other = np.cross(stretched, side)
    radius, angle = np.sqrt(first), np.pi * (second - 0.5)  # half of a circle: the other half mirrors it
    x, y = radius * np.sin(angle), radius * np.cos(angle)
    # The disc of visible normals: x runs in the plane of the viewer, y across it.
    share = 0.5 * (1.0 + stretched[..., 2])
    x = (1.0 - share) * np.sqrt(1.0 - y**2) + share * x
    up = np.sqrt(np.maximum(0.0, 1.0 - x**2 - y**2))
    half = x[..., None] * other + y[:, None] * side + up[..., None] * stretched
    half *= [alpha, alpha, 1.0]
    half /= np.linalg.norm(half, axis=2, keepdims=True)
    towards = (view * half).sum(axis=2)
    leaving = 2.0 * towards * half[..., 2] - view[..., 2]
    seen = view[..., 2]
    # Height-correlated masking and shadowing over masking.
    of_view = seen * np.sqrt(alpha**2 + (1.0 - alpha**2) * leaving**2)
    of_light = leaving * np.sqrt(alpha**2 + (1.0 - alpha**2) * seen**2)
    masking = 2.0 * seen / (seen + np.sqrt(alpha**2 + (1.0 - alpha**2) * seen**2))
    both = np.where(leaving > 0.0, 2.0 * seen * leaving / np.maximum(of_view + of_light, 1e-30), 0.0)
    weight, grazing = dense * both / masking, np.clip(1.0 - towards, 0.0, 1.0) ** 5
    return (weight * (1.0 - grazing)).mean(axis=1), (weight * grazing).mean(axis=1)


def mean_cosine(alpha: float) -> float:
    """The mean cosine between mirrored rays and the mirrored ray of the smooth surface, seen along the normal."""
    quantile = (np.arange(4096) + 0.5) / 4096
    square = (1.0 - quantile) / (1.0 + (alpha**2 - 1.0) * quantile)  # of the microfacet's cosine
    cosine = np.maximum(2.0 * square - 1.0, 0.0)
    return float((cosine**2).sum() / cosine.sum())
