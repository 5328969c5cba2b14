"""What is put around a subject, and what its mirrors see: one function a stage.

Sizes are shares of the subject's, so that a stage suits any. Lamps are behind the camera, where neither they nor their
shadows are in the picture: mirrors show them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ldtrefl.base.errors import unknown_name
from ldtrefl.scene.description import Environment, Material, Object
from ldtrefl.scene.studio import albedo_seen_as, backdrop
from ldtrefl.scene.subject import Subject

CHROME = Material(mirror=(0.93, 0.94, 0.95))

FLOOR = np.array([0.30, 0.28, 0.26])
"""Radiance of the floor: a warm grey that lets both white and dark things stand out."""

FLOOR_REACH = 60.0
"""From the subject to the floor's edge, in its sizes: beyond the top of the picture, where the camera looks down."""


@dataclass(frozen=True, eq=False)
class Stage:
    """What is around a subject."""

    environment: Environment
    objects: tuple[Object, ...] = ()
    framed: tuple[Object, ...] = ()
    """Those of the objects that belong into the picture, whole."""
    points: np.ndarray | None = None
    """(n, 3): what else belongs into it."""
    elevation: float = 20.0
    """Degrees that the camera looks down. With 20 the horizon is above the picture."""


def bare(_: Subject) -> Stage:
    """Nothing but the subject, before a plain backdrop."""
    return Stage(backdrop(FLOOR * 1.1, FLOOR * 1.6))


def studio(subject: Subject) -> Stage:
    """On a matt floor without end."""
    return Stage(backdrop(FLOOR, FLOOR * 1.6), (_floor(subject, Material(albedo=albedo_seen_as(FLOOR))),))


def mirror_floor(subject: Subject) -> Stage:
    """On a mirror floor, whose reflection of the horizon, together with its own grey, is as bright as the horizon."""
    mirror = 0.55
    floor = _floor(subject, Material(albedo=albedo_seen_as((1.0 - mirror) * FLOOR), mirror=(mirror, mirror, mirror)))
    reflected = subject.points.copy()
    reflected[:, 2] = subject.base[2] - 0.45 * (reflected[:, 2] - subject.base[2])
    return Stage(backdrop(FLOOR, FLOOR * 1.6), (floor,), points=reflected, elevation=12.0)


def mirror_ball(subject: Subject) -> Stage:
    """Before a mirror ball, to its right and behind it, on a matt floor."""
    radius = subject.length(0.46 * max(subject.height, 0.85 * subject.width, 0.85 * subject.depth))
    ball = _ball(subject, "mirror ball", 26.0, radius, 0.04, CHROME, True)
    floor = _floor(subject, Material(albedo=albedo_seen_as(FLOOR)))
    return Stage(_bright_sky(), (floor, ball, *_lamps(subject)), framed=(ball,))


def chrome(subject: Subject) -> Stage:
    """The subject is a mirror among coloured balls, on a matt floor."""
    around = max(subject.width, subject.depth, 0.6 * subject.height) / 2.0
    balls = tuple(
        _ball(subject, f"{name} ball", degrees, subject.length(size * around), 0.5, Material(albedo=color), False)
        for name, degrees, size, color in (
            ("red", 35.0, 0.27, (0.75, 0.08, 0.05)),
            ("blue", 150.0, 0.2, (0.06, 0.2, 0.7)),
            ("yellow", -40.0, 0.14, (0.9, 0.55, 0.05)),
            ("green", -140.0, 0.1, (0.05, 0.45, 0.15)),
        )
    )
    floor = _floor(subject, Material(albedo=albedo_seen_as(FLOOR)))
    return Stage(_bright_sky(), (floor, *balls, *_lamps(subject)), framed=balls)


STAGES: dict[str, Callable[[Subject], Stage]] = {
    "studio": studio,
    "mirror-floor": mirror_floor,
    "mirror-ball": mirror_ball,
    "chrome": chrome,
}
"""What the user calls them."""


def find_stage(name: str) -> Callable[[Subject], Stage]:
    """The stage of this name.

    Raises:
        InputError: there is none.
    """
    if name not in STAGES:
        raise unknown_name("stage", name, STAGES)
    return STAGES[name]


def makes_a_mirror(name: str | None) -> bool:
    """Whether a subject is a mirror itself on the stage of this name.

    Raises:
        InputError: there is none.
    """
    return name is not None and find_stage(name) is chrome


def _bright_sky() -> Environment:
    """What makes mirrors gleam: bright over the horizon, blue above."""
    return backdrop(np.array([0.74, 0.76, 0.78]), np.array([0.36, 0.5, 0.78]))


def _floor(subject: Subject, material: Material) -> Object:
    scale = subject.length(FLOOR_REACH * subject.size)
    return Object(name="floor", shape="plane", scale=scale, translate=subject.at(0.0, 0.0, 0.0), material=material)


def _ball(
    subject: Subject, name: str, degrees: float, radius: float, gap: float, material: Material, reached_over: bool
) -> Object:
    """A ball on the floor; the gap to the subject is a share of its radius."""
    centre = subject.beside(degrees, radius, gap * radius, reached_over=reached_over)
    return Object(name=name, shape="sphere", scale=radius, translate=centre, material=material)


def _lamps(subject: Subject) -> tuple[Object, ...]:
    """Two soft boxes behind the camera, one warm, one cool."""
    return (
        _lamp(subject, "warm soft box", (8.0, -13.0, 4.4), (3.0, 2.8), (1.0, 0.9, 0.75)),
        _lamp(subject, "cool soft box", (-6.0, -14.0, 5.0), (3.4, 3.2), (0.8, 0.92, 1.0)),
    )


def _lamp(
    subject: Subject,
    name: str,
    place: tuple[float, float, float],
    half: tuple[float, float],
    emission: tuple[float, float, float],
) -> Object:
    """A plane that glows and faces the subject, upright; all lengths in the subject's sizes."""
    right, behind, up = (value * subject.size for value in place)
    centre = subject.at(right, behind, up)
    facing = -(place[0] * subject.right + place[1] * subject.behind + np.array([0.0, 0.0, place[2]]))
    return Object(
        name=name,
        shape="plane",
        scale=(subject.length(half[0] * subject.size), subject.length(half[1] * subject.size), 1.0),
        rotate=_turned_to(facing),
        translate=centre,
        material=Material(albedo=(0.0, 0.0, 0.0), emission=emission),
    )


def _turned_to(facing: np.ndarray) -> tuple[float, float, float, float]:
    """Axis and degrees of the rotation that turns +z to a direction, and x to a horizontal one."""
    z = facing / np.sqrt(np.vecdot(facing, facing))
    x = np.cross([0.0, 0.0, 1.0], z)
    x /= np.sqrt(np.vecdot(x, x))
    y = np.cross(z, x)
    # The axis is what the rotation leaves as it is; its trace is 1 + 2 cos of the angle.
    axis = np.array([y[2] - z[1], z[0] - x[2], x[1] - y[0]])
    length = np.sqrt(np.vecdot(axis, axis))
    degrees = np.degrees(np.arctan2(length, x[0] + y[1] + z[2] - 1.0))
    a, b, c = (round(float(value), 4) + 0.0 for value in axis / length)
    return a, b, c, round(float(degrees), 2)
