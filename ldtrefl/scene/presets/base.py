"""What a preset of an environment gives: a picture of all that is far away, and the lights that go with it.

Directions here are in the environment's own frame, right-handed with z up: azimuths count from x (longitude 0 of the
picture) towards y, counter-clockwise seen from above. The picture is equirectangular, straight up in its top row, its
middle column at azimuth 0, and columns run clockwise, as in every environment's picture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ldtrefl.files.stored_picture import StoredPicture

Radiance = tuple[float, float, float]

PARTS = 48
"""Along each side of a rectangle that is summed up: the sum is right to a thousandth."""


@dataclass(frozen=True)
class DistantLight:
    """Light from one direction."""

    towards: tuple[float, float, float]
    """Unit vector to where it comes from."""
    radiance: Radiance
    """What a white surface that faces it scatters."""


@dataclass(frozen=True)
class DistantRectangle:
    """A rectangle that glows evenly and is in the picture, too: what is matt is lit by it, and what mirrors shows the
    picture."""

    middle: tuple[float, float, float]
    """Unit vector to its middle, which it faces."""
    right: tuple[float, float, float]
    """From its middle to the middle of a side, in distances of its middle."""
    up: tuple[float, float, float]
    """The same at right angles."""
    radiance: Radiance
    """Of its surface."""

    def scattered_by(self, normals: np.ndarray) -> np.ndarray:
        """(n, 3) radiance of white surfaces whose unit normals are (n, 3), without shadows: the sum over its parts."""
        along = (np.arange(PARTS) + 0.5) / PARTS * 2.0 - 1.0
        across, above = np.meshgrid(along, along)
        to_part = np.array(self.middle) + np.multiply.outer(across, self.right) + np.multiply.outer(above, self.up)
        to_part = to_part.reshape(-1, 3)
        area = 4.0 * np.linalg.norm(np.cross(self.right, self.up)) / PARTS**2
        # The part's cosine with the way to it, over the square of its distance, and so that the way gets unit length.
        weight = area * (to_part @ self.middle) / np.vecdot(to_part, to_part) ** 2
        factor = np.maximum(normals @ to_part.T, 0.0) @ weight / np.pi
        return np.asarray(factor[:, None] * self.radiance)


@dataclass(frozen=True)
class Disc:
    """The sun as it is seen: too small for the picture."""

    towards: tuple[float, float, float]
    """Unit vector to its centre."""
    radius: float
    """Angle from its centre to its edge, in radians."""
    radiance: Radiance


@dataclass(frozen=True, eq=False)
class Surroundings:
    """All that a preset gives, at a strength of 1."""

    picture: StoredPicture
    """float32."""
    ambient: Radiance
    """The picture's mean over all directions, without what lights stand for: ambient light in its place."""
    lights: tuple[DistantLight, ...] = ()
    rectangles: tuple[DistantRectangle, ...] = ()
    disc: Disc | None = None


def direction(azimuth: float, elevation: float) -> np.ndarray:
    """(3,) float64 unit vector, of two angles in degrees."""
    around, above = np.radians(azimuth), np.radians(elevation)
    return np.array([np.cos(around) * np.cos(above), np.sin(around) * np.cos(above), np.sin(above)])


def picture_directions(rows: int) -> np.ndarray:
    """(rows, 2 * rows, 3) float32 unit vectors to the middles of a picture's pixels."""
    polar = (np.arange(rows) + 0.5) / rows * np.pi
    azimuth = (0.5 - (np.arange(2 * rows) + 0.5) / (2 * rows)) * 2.0 * np.pi
    made = np.empty((rows, 2 * rows, 3), np.float32)
    made[..., 0] = np.outer(np.sin(polar), np.cos(azimuth))
    made[..., 1] = np.outer(np.sin(polar), np.sin(azimuth))
    made[..., 2] = np.cos(polar)[:, None]
    return made


def solid_angles(rows: int) -> np.ndarray:
    """(rows, 1) float64 steradians of a pixel in each row of a picture; they add up to those of the sphere."""
    edges = np.cos(np.arange(rows + 1) / rows * np.pi)
    return (edges[:-1, None] - edges[1:, None]) * (2.0 * np.pi / (2 * rows))


def mean_radiance(pixels: np.ndarray) -> np.ndarray:
    """(3,) float64 mean over all directions of a picture (rows, 2 * rows, 3): irradiance / pi, as a mean over surfaces
    of all ways to face."""
    by_row = pixels.mean(axis=1, dtype=float)
    return np.asarray((by_row * solid_angles(len(pixels))).sum(axis=0) * (2 * len(pixels)) / (4.0 * np.pi))


def three(values: np.ndarray) -> tuple[float, float, float]:
    """(3,) as plain numbers."""
    a, b, c = (float(value) for value in values)
    return a, b, c
