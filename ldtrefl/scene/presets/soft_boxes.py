"""The preset "studio": a dim room with soft boxes, as for photographs of things that gleam.

The camera is taken to stand at azimuth -90 degrees (-y), or up to a third of a right angle beside it. Each box is seen
in mirrors as it is. What is matt gets the light of the key and of the overhead box from rectangles of their size, which
glow evenly and give as much light as the boxes; that of the others, like that of the walls, is ambient light.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.presets.base import (
    DistantRectangle,
    Surroundings,
    direction,
    mean_radiance,
    picture_directions,
    solid_angles,
    three,
)

ROWS = 384
"""Of the picture: half a degree each, a quarter of the edge of a box."""


@dataclass(frozen=True)
class Box:
    """A rectangle that glows evenly but for its rim, and faces the middle of the room."""

    azimuth: float
    """Degrees, of its middle."""
    elevation: float
    width: float
    """Half of it, as seen from the middle of the room: the tangent of an angle."""
    height: float
    radiance: tuple[float, float, float]
    casts_shadows: bool = False
    """If not, its light is part of the ambient light."""


BOXES = (
    Box(-36.0, 38.0, 0.44, 0.44, (2.95, 2.88, 2.76), casts_shadows=True),  # key
    Box(-162.0, 27.0, 0.34, 0.58, (0.66, 0.69, 0.74)),  # fill
    Box(40.0, 18.0, 0.1, 0.5, (2.0, 2.0, 2.05)),  # rims
    Box(150.0, 20.0, 0.1, 0.5, (1.9, 1.9, 1.95)),
    Box(90.0, 80.0, 0.6, 0.22, (2.7, 2.7, 2.7), casts_shadows=True),  # overhead
)

EDGE = 0.03
"""How far a box's light falls off at its rim, as a tangent."""

VIGNETTE = 0.35
"""How much darker a box is in its corners than in its middle."""


TINT = (1.0, 0.985, 0.96)
"""Of the walls."""
CEILING, HORIZON, FLOOR = 0.035, 0.3, 0.22
"""Radiance of the walls straight up, at eye level and straight down."""
FADES = 0.4
"""Sine of the elevation at which the walls are 1 / e as bright as at eye level, above the ceiling."""
POOL = 0.34
"""Radiance of the light on the wall behind the subject, in its middle."""
POOL_ELEVATION, POOL_RADIUS = 18.0, 28.0
"""Degrees: where its middle is, and how far from it it is 1 / e as bright."""
POOL_RISES = 0.25
"""Sine of the elevation from which on it is whole. It begins at the horizon, which is everywhere alike: a floor can
meet it without a line."""


@functools.lru_cache(maxsize=1)
def studio() -> Surroundings:
    """The room with all its boxes."""
    directions = picture_directions(ROWS)
    pixels = _room(directions)
    ambient = mean_radiance(pixels)
    rectangles: list[DistantRectangle] = []
    for box in BOXES:
        rows, columns, glow = _glow(box, directions)
        pixels[rows, columns] += glow
        light = (glow * solid_angles(ROWS)[rows]).sum(axis=0, dtype=float)
        if box.casts_shadows:
            rectangles.append(_rectangle(box, light))
        else:
            ambient += light / (4.0 * np.pi)
    return Surroundings(StoredPicture(pixels), three(ambient), rectangles=tuple(rectangles))


def _room(directions: np.ndarray) -> np.ndarray:
    """(rows, columns, 3) float32 radiance of the walls: dim above, and behind the subject a pool of light."""
    height = directions[:, :1, 2]
    walls = CEILING + (HORIZON - CEILING) * np.exp(-((np.maximum(height, 0.0) / FADES) ** 2))
    floor = HORIZON + (FLOOR - HORIZON) * np.minimum(-2.0 * np.minimum(height, 0.0), 1.0)
    pool_middle, widens = direction(90.0, POOL_ELEVATION).astype(np.float32), 1.0 - np.cos(np.radians(POOL_RADIUS))
    pool = POOL * _smooth(height / POOL_RISES) * np.exp((directions @ pool_middle - 1.0) / np.float32(widens))
    return np.asarray((np.where(height < 0.0, floor, walls) + pool)[..., None] * np.array(TINT, np.float32))


def _glow(box: Box, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows and columns of the pixels that a box is near, and (n, 3) float32 its radiance in each."""
    ahead, right, up = (axis.astype(np.float32) for axis in _frame(box))
    depth = directions @ ahead
    rows, columns = np.nonzero(depth > 1.0 / np.sqrt(1.0 + box.width**2 + box.height**2))
    near = directions[rows, columns]
    x, y = (np.abs(near @ axis) / depth[rows, columns] for axis in (right, up))
    falls = 1.0 - 0.5 * VIGNETTE * ((x / box.width) ** 2 + (y / box.height) ** 2)
    glow = _smooth((box.width - x) / EDGE) * _smooth((box.height - y) / EDGE) * falls
    return rows, columns, glow[:, None] * np.array(box.radiance, np.float32)


def _smooth(at: np.ndarray) -> np.ndarray:
    """From 0 to 1 without a kink, between 0 and 1."""
    at = np.clip(at, 0.0, 1.0)
    return at * at * (3.0 - 2.0 * at)


def _frame(box: Box) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit vectors to a box's middle, along its width and along its height."""
    ahead, right = direction(box.azimuth, box.elevation), direction(box.azimuth - 90.0, 0.0)
    return ahead, right, np.cross(right, ahead)


def _rectangle(box: Box, light: np.ndarray) -> DistantRectangle:
    """What stands for a box whose radiance, summed up over its solid angle, is ``light``: its edge is where the box's
    rim is half as bright."""
    ahead, right, up = _frame(box)
    width, height = box.width - 0.5 * EDGE, box.height - 0.5 * EDGE
    solid_angle = 4.0 * np.arcsin(width * height / np.sqrt((1.0 + width**2) * (1.0 + height**2)))
    return DistantRectangle(three(ahead), three(width * right), three(height * up), three(light / solid_angle))
