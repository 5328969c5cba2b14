"""Soft light for what stands alone before a plain backdrop: a key light from the right, a fill from the camera, a rim
from behind, and ambient light.

The directions are those of three-quarter views (``framing.py``). Key light that falls from the right lights the side
that a mirror on the right shows. The key is four lights close together, so that its shadow has a soft edge. White that
all of them reach is not brighter than 1, so that nothing clips.
"""

from __future__ import annotations

import numpy as np

from ldtrefl.scene.description import Environment, Light, Lighting
from ldtrefl.scene.framing import AZIMUTH, towards
from ldtrefl.scene.tidy import tidy, tidy_point

KEY = [(azimuth, elevation) for azimuth in (20.0, 28.0) for elevation in (45.0, 51.0)]
"""Azimuth and elevation of each, in degrees."""
KEY_RADIANCE = (0.158, 0.154, 0.146)
FILL = (AZIMUTH, 46.0)
FILL_RADIANCE = (0.14, 0.145, 0.16)
RIM = (165.0, 66.0)
RIM_RADIANCE = (0.09, 0.09, 0.095)
AMBIENT = (0.2, 0.2, 0.21)

DIRECTION_DIGITS = 3
COLOR_DIGITS = 3


def studio_lighting() -> Lighting:
    """Ambient light, and shadows."""
    return Lighting(ambient=AMBIENT, shadows=True)


def studio_lights() -> tuple[Light, ...]:
    """Key, fill and rim."""
    placed = [*((place, KEY_RADIANCE) for place in KEY), (FILL, FILL_RADIANCE), (RIM, RIM_RADIANCE)]
    return tuple(
        Light(kind="directional", direction=tidy_point(-towards(*place), DIRECTION_DIGITS), radiance=radiance)
        for place, radiance in placed
    )


def backdrop(horizon: np.ndarray, zenith: np.ndarray) -> Environment:
    """A blend that has these colours; what is below the horizon goes on in the same way.

    ``zenith`` is at most twice ``horizon``: there, nothing is left for the ground.
    """
    sky = [tidy(value, COLOR_DIGITS) for value in zenith]
    ground = [tidy(value, COLOR_DIGITS) for value in np.maximum(2.0 * horizon - zenith, 0.0)]
    return Environment(sky=(sky[0], sky[1], sky[2]), ground=(ground[0], ground[1], ground[2]))
