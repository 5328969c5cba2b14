"""What arrives of the sun's light through the air: Preetham, Shirley and Smits 1999, appendix A.1.

Each wavelength is dimmed by Rayleigh scattering, by aerosols (Angstrom's formula) and by ozone. Mixed gases and water
vapour, which the paper has too, absorb at the edge of what is seen and are left out. Above the air the sun is a black
body of 5,778 K.
"""

from __future__ import annotations

import numpy as np

from ldtrefl.scene.presets.colorimetry import LUMENS_PER_WATT, matching_functions

SUN_RADIUS = np.radians(0.2666)
"""Angle from the sun's centre to its edge, seen from the earth at its mean distance."""

SUN_KELVIN = 5778.0

OZONE = 0.35
"""cm of ozone, were it all at sea level."""

NANOMETRES = np.arange(380.0, 781.0, 10.0)

_OZONE_NANOMETRES = np.arange(440.0, 781.0, 20.0)
_OZONE_ABSORBS = (
    *(0.0, 0.006, 0.014, 0.030, 0.048, 0.075, 0.103, 0.118, 0.125, 0.105, 0.079, 0.057, 0.036, 0.023, 0.014),
    *(0.010, 0.007, 0.0),
)
"""Per cm: every 20 nm of the paper's table 2."""


def air_mass(elevation: float) -> float:
    """How much air light comes through from this many degrees above the horizon, as a multiple of the zenith's (Kasten
    1966, as the paper has it)."""
    return float(1.0 / (np.sin(np.radians(elevation)) + 0.15 * (3.885 + elevation) ** -1.253))


def transmittance(nanometres: np.ndarray, elevation: float, turbidity: float) -> np.ndarray:
    """(n,) the share of sunlight of each wavelength that arrives, from this many degrees above the horizon."""
    micrometres, mass = nanometres / 1000.0, air_mass(elevation)
    rayleigh = 0.008735 * micrometres**-4.08
    aerosols = (0.04608 * turbidity - 0.04586) * micrometres**-1.3
    ozone = OZONE * np.interp(nanometres, _OZONE_NANOMETRES, _OZONE_ABSORBS)
    return np.asarray(np.exp(-mass * (rayleigh + aerosols + ozone)))


def sun_xyz(elevation: float, turbidity: float) -> np.ndarray:
    """(3,) CIE 1931 XYZ of the sunlight on a surface that faces the sun; Y is its illuminance in klux."""
    metres = NANOMETRES * 1e-9
    radiance = 1.191043e-16 / metres**5 / np.expm1(1.438777e-2 / (metres * SUN_KELVIN))  # Planck, W / (m^2 sr m)
    irradiance = radiance * np.pi * np.sin(SUN_RADIUS) ** 2 * transmittance(NANOMETRES, elevation, turbidity)
    step = 10.0e-9
    return np.asarray(LUMENS_PER_WATT / 1000.0 * step * irradiance @ matching_functions(NANOMETRES))
