"""What is put around a subject, and what its mirrors see: one function a stage.

Sizes are shares of the subject's, so that a stage suits any. On a floor a subject stands in the environment's preset
"studio", whose soft boxes light it and are seen in mirrors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ldtrefl.base.errors import unknown_name
from ldtrefl.scene.description import Environment, Light, Lighting, Material, Object
from ldtrefl.scene.framing import AZIMUTH
from ldtrefl.scene.presets.soft_boxes import HORIZON, TINT
from ldtrefl.scene.presets.soft_boxes import studio as soft_boxes
from ldtrefl.scene.studio import backdrop, studio_lighting, studio_lights
from ldtrefl.scene.subject import Subject
from ldtrefl.scene.tidy import tidy

CHROME = Material(mirror=(0.93, 0.94, 0.95))

STUDIO = Environment(preset="studio", rotation=AZIMUTH)
"""It faces the camera of three-quarter views."""

SHADOWS = Lighting(shadows=True)
"""Ambient light is the environment's."""

FLOOR = HORIZON * np.array(TINT)
"""Radiance of the floor: a grey that lets both white and dark things stand out, and that of the studio's horizon."""

COLOR_DIGITS = 3

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
    lighting: Lighting = SHADOWS
    lights: tuple[Light, ...] = ()
    """Those beside the environment's."""


def bare(_: Subject) -> Stage:
    """Nothing but the subject, before a plain backdrop."""
    plain = backdrop(FLOOR * 1.1, FLOOR * 1.6)
    return Stage(plain, lighting=studio_lighting(), lights=studio_lights())


def studio(subject: Subject) -> Stage:
    """On a matt floor without end."""
    return Stage(STUDIO, (_floor(subject, Material(albedo=albedo_seen_as(FLOOR))),))


def mirror_floor(subject: Subject) -> Stage:
    """On a mirror floor, whose reflection of the horizon, together with its own grey, is as bright as the horizon."""
    mirror = 0.55
    floor = _floor(subject, Material(albedo=albedo_seen_as((1.0 - mirror) * FLOOR), mirror=(mirror, mirror, mirror)))
    reflected = subject.points.copy()
    reflected[:, 2] = subject.base[2] - 0.45 * (reflected[:, 2] - subject.base[2])
    return Stage(STUDIO, (floor,), points=reflected, elevation=12.0)


def mirror_ball(subject: Subject) -> Stage:
    """Before a mirror ball, to its right and behind it, on a matt floor."""
    radius = subject.length(0.46 * max(subject.height, 0.85 * subject.width, 0.85 * subject.depth))
    ball = _ball(subject, "mirror ball", 26.0, radius, 0.04, CHROME, True)
    floor = _floor(subject, Material(albedo=albedo_seen_as(FLOOR)))
    return Stage(STUDIO, (floor, ball), framed=(ball,))


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
    return Stage(STUDIO, (floor, *balls), framed=balls)


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


def floor_light() -> np.ndarray:
    """(3,): radiance of a white floor that all of the studio's lights reach."""
    surroundings, up = soft_boxes(), np.array([[0.0, 0.0, 1.0]])
    lit = [light.scattered_by(up)[0] for light in surroundings.rectangles]
    return np.asarray(np.array(surroundings.ambient) + np.sum(lit, axis=0))


def albedo_seen_as(color: np.ndarray) -> tuple[float, float, float]:
    """The albedo of a floor that looks like this where all lights reach it."""
    red, green, blue = (tidy(value, COLOR_DIGITS) for value in color / floor_light())
    return red, green, blue


def makes_a_mirror(name: str | None) -> bool:
    """Whether a subject is a mirror itself on the stage of this name.

    Raises:
        InputError: there is none.
    """
    return name is not None and find_stage(name) is chrome


def _floor(subject: Subject, material: Material) -> Object:
    scale = subject.length(FLOOR_REACH * subject.size)
    return Object(name="floor", shape="plane", scale=scale, translate=subject.at(0.0, 0.0, 0.0), material=material)


def _ball(
    subject: Subject, name: str, degrees: float, radius: float, gap: float, material: Material, reached_over: bool
) -> Object:
    """A ball on the floor; the gap to the subject is a share of its radius."""
    centre = subject.beside(degrees, radius, gap * radius, reached_over=reached_over)
    return Object(name=name, shape="sphere", scale=radius, translate=centre, material=material)
