"""The presets "sky" and "sunset": sun and sky by day over a level ground, and the light of both.

The sky is Preetham's (``preetham.py``), the sun what the air leaves of it (``sunlight.py``), both in the same unit.
White is that of daylight film, and all is scaled as a photographer would expose: a white surface that faces the sun has
luminance 1, the mean of all that is around it at most ``MOST_AROUND``, which counts when the sun is low.
"""

from __future__ import annotations

import functools

import numpy as np

from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.presets.base import (
    Disc,
    DistantLight,
    Radiance,
    Surroundings,
    direction,
    mean_radiance,
    picture_directions,
    solid_angles,
    three,
)
from ldtrefl.scene.presets.colorimetry import daylight_rgb_from_xyz, luminance
from ldtrefl.scene.presets.preetham import sky_xyz
from ldtrefl.scene.presets.sunlight import SUN_RADIUS, sun_xyz

ROWS = 256
"""Of the picture, 0.7 degrees each: a clear sky has nothing sharp but the sun, which is drawn apart."""

MOST_AROUND = 0.36
"""Luminance that sky and ground have at most, in the mean over all directions."""

HAZE = 0.05
"""Sine of the angle below the horizon at which the air before the ground has let through 1 / e of its light."""

BRIGHTEST = 100.0
"""The disc's radiance in its brightest channel is this at most. It is white at any exposure; the sun's own, a hundred
thousand, would outweigh all other samples of a pixel, and those about it. What the sun lights is lit by all of it."""


@functools.lru_cache(maxsize=8)
def sky(elevation: float, azimuth: float, turbidity: float, ground_albedo: Radiance) -> Surroundings:
    """Sun and sky.

    Args:
        elevation: degrees of the sun above the horizon, 0 to 90.
        azimuth: degrees of the sun from x towards y.
        turbidity: of the air; 2 is clear, 6 hazy.
        ground_albedo: of the ground, which is matt.
    """
    to_sun = direction(azimuth, elevation)
    to_rgb = daylight_rgb_from_xyz()
    # What lies outside of sRGB's gamut is brought to its edge.
    above = np.maximum(sky_xyz(picture_directions(ROWS)[: ROWS // 2], to_sun, turbidity) @ to_rgb.T, 0.0)
    sun = np.maximum(to_rgb @ sun_xyz(elevation, turbidity), 0.0) / np.pi
    pixels = np.concatenate([above, _ground(above, np.sin(np.radians(elevation)) * sun, ground_albedo)])
    ambient = mean_radiance(pixels)
    scale = min(1.0 / luminance(sun + ambient), MOST_AROUND / luminance(ambient))
    pixels = (scale * pixels).astype(np.float32)
    seen = scale * sun / np.sin(SUN_RADIUS) ** 2
    seen *= min(1.0, BRIGHTEST / float(seen.max()))
    light = DistantLight(three(to_sun), three(scale * sun))
    disc = Disc(three(to_sun), float(SUN_RADIUS), three(seen))
    return Surroundings(StoredPicture(pixels), three(scale * ambient), (light,), disc=disc)


def _ground(above: np.ndarray, from_sun: np.ndarray, albedo: Radiance) -> np.ndarray:
    """The picture below the horizon: a plane that the sun and the picture above it light, seen through haze.

    Args:
        above: (rows, columns, 3) the upper half of the picture.
        from_sun: (3,) what the sun adds to the radiance of a white plane.
        albedo: of the plane.
    """
    rows = len(above)
    cosine = np.cos((np.arange(rows) + 0.5) / rows * np.pi / 2.0)[:, None]
    from_sky = (above.sum(axis=1, dtype=float) * solid_angles(2 * rows)[:rows] * cosine).sum(axis=0) / np.pi
    plane = (np.array(albedo) * (from_sun + from_sky)).astype(np.float32)
    clear = np.exp(-HAZE / cosine[::-1]).astype(np.float32)[..., None]
    return np.asarray(clear * plane + (1.0 - clear) * above[-1])
