"""From spectra by way of CIE 1931 XYZ to linear RGB of sRGB's primaries, as a camera set to daylight sees them."""

from __future__ import annotations

import numpy as np

LUMENS_PER_WATT = 683.0
"""Of light at the wavelength that the eye sees best."""

RGB_FROM_XYZ = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)
"""IEC 61966-2-1, white D65."""

D55_XYZ, D65_XYZ = np.array([0.9568, 1.0, 0.9214]), np.array([0.9505, 1.0, 1.0888])
"""White of daylight film, and of sRGB: CIE daylight of 5,500 K and 6,500 K."""

BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
"""From XYZ to the sensors in which white is adapted (ICC.1:2004, annex E)."""

_LOBES = {
    0: ((1.056, 599.8, 37.9, 31.0), (0.362, 442.0, 16.0, 26.7), (-0.065, 501.1, 20.4, 26.2)),
    1: ((0.821, 568.8, 46.9, 40.5), (0.286, 530.9, 16.3, 31.1)),
    2: ((1.217, 437.0, 11.8, 36.0), (0.681, 459.0, 26.0, 13.8)),
}
"""Height, centre, width below it and width above it, in nm."""


def matching_functions(nanometres: np.ndarray) -> np.ndarray:
    """(n, 3) the CIE 1931 observer's colour matching functions: C. Wyman, P.-P. Sloan, P. Shirley, "Simple Analytic
    Approximations to the CIE XYZ Color Matching Functions" (2013), the multi-lobe fit."""
    made = np.zeros((len(nanometres), 3))
    for channel, lobes in _LOBES.items():
        for height, centre, below, above in lobes:
            width = np.where(nanometres < centre, below, above)
            made[:, channel] += height * np.exp(-0.5 * ((nanometres - centre) / width) ** 2)
    return made


def daylight_rgb_from_xyz() -> np.ndarray:
    """(3, 3): linear RGB in which D55 is white, as a camera set to daylight has it."""
    gain = np.diag((BRADFORD @ D65_XYZ) / (BRADFORD @ D55_XYZ))
    return np.asarray(RGB_FROM_XYZ @ np.linalg.inv(BRADFORD) @ gain @ BRADFORD)


def luminance(rgb: np.ndarray) -> float:
    """Y of a (3,) linear RGB."""
    return float(np.linalg.inv(RGB_FROM_XYZ)[1] @ rgb)
