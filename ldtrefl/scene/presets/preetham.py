"""The clear sky's light: A. J. Preetham, P. Shirley, B. Smits, "A Practical Analytic Model for Daylight" (1999).

Luminance and chromaticity of a direction are those of the zenith (appendix A.2) times the formula of Perez (equation 3)
for the angles from the zenith and from the sun, over what the formula gives at the zenith. *Turbidity* says how hazy
the air is: 2 is clear, 3 usual, 6 hazy; the model was fitted from 2 to 6.

Its fit of chromaticity makes the sky purple near the horizon where the sun is high. Daylight as it was measured lies
about a curve, the CIE daylight locus. So what the model has on the purple side of that curve is put on it, with its x
and its luminance; elsewhere all is the model's own.
"""

from __future__ import annotations

import numpy as np

DISTRIBUTION = {
    "Y": ((0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)),
    "x": ((-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)),
    "y": ((-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)),
}
"""Perez' A to E of luminance and of chromaticity: slope with turbidity, and value at none (appendix A.2)."""

ZENITH = {
    "x": (
        (0.00166, -0.00375, 0.00209, 0.0),
        (-0.02903, 0.06377, -0.03202, 0.00394),
        (0.11693, -0.21196, 0.06052, 0.25886),
    ),
    "y": (
        (0.00275, -0.00610, 0.00317, 0.0),
        (-0.04214, 0.08970, -0.04153, 0.00516),
        (0.15346, -0.26756, 0.06670, 0.26688),
    ),
}
"""Chromaticity of the zenith: rows are factors of turbidity^2, turbidity and 1, columns of the sun's angle from the
zenith, cubed, squared, as it is and 1 (appendix A.2)."""

LEAST_COSINE = 1.0e-3
"""Perez' formula divides by the cosine of the angle from the zenith, which is 0 at the horizon."""


def zenith_luminance(from_zenith: float, turbidity: float) -> float:
    """Luminance of the zenith in kcd/m^2, for the sun's angle from it in radians."""
    chi = (4.0 / 9.0 - turbidity / 120.0) * (np.pi - 2.0 * from_zenith)
    return float((4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192)


def zenith_chromaticity(from_zenith: float, turbidity: float) -> tuple[float, float]:
    """CIE 1931 x and y of the zenith, for the sun's angle from it in radians."""
    of_turbidity = np.array([turbidity**2, turbidity, 1.0])
    of_angle = np.array([from_zenith**3, from_zenith**2, from_zenith, 1.0])
    x, y = (float(of_turbidity @ np.array(ZENITH[name]) @ of_angle) for name in ("x", "y"))
    return x, y


def perez(name: str, turbidity: float, cosine: np.ndarray, from_sun: np.ndarray) -> np.ndarray:
    """Perez' formula for cosines with the zenith, and angles from the sun in radians; ``name`` is Y, x or y."""
    a, b, c, d, e = (slope * turbidity + start for slope, start in DISTRIBUTION[name])
    by_height = 1.0 + a * np.exp(b / np.maximum(cosine, LEAST_COSINE))
    return np.asarray(by_height * (1.0 + c * np.exp(d * from_sun) + e * np.cos(from_sun) ** 2))


def daylight_y(x: np.ndarray) -> np.ndarray:
    """CIE 1931 y of daylight of this x: D. B. Judd, D. L. MacAdam, G. Wyszecki, "Spectral Distribution of Typical
    Daylight as a Function of Correlated Color Temperature" (1964), as CIE 15 has it."""
    return np.asarray((-3.0 * x + 2.87) * x - 0.275)


def sky_xyz(directions: np.ndarray, sun: np.ndarray, turbidity: float) -> np.ndarray:
    """CIE 1931 XYZ of the sky in kcd/m^2.

    Args:
        directions: (..., 3) unit vectors, z up. Below the horizon they see what the horizon above them does.
        sun: (3,) the unit vector to the sun, not below the horizon.
        turbidity: of the air.

    Returns:
        (..., 3), of the type of ``directions``.
    """
    from_zenith = float(np.arccos(np.clip(sun[2], -1.0, 1.0)))
    cosine = directions[..., 2]
    from_sun = np.arccos(np.clip(directions @ sun.astype(directions.dtype), -1.0, 1.0))
    x, y = zenith_chromaticity(from_zenith, turbidity)
    found = {}
    for name, at_zenith in (("Y", zenith_luminance(from_zenith, turbidity)), ("x", x), ("y", y)):
        there = float(perez(name, turbidity, np.ones(()), np.full((), from_zenith)))
        found[name] = at_zenith / there * perez(name, turbidity, cosine, from_sun)
    found["y"] = np.maximum(found["y"], daylight_y(found["x"]))
    scale = found["Y"] / found["y"]
    return np.stack([found["x"] * scale, found["Y"], (1.0 - found["x"] - found["y"]) * scale], axis=-1)
