"""Lights of a scene, and what all of them share."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from ldtrefl.base.checked import (
    CONFIG,
    Color,
    Direction,
    Flag,
    Intensity,
    Positive,
    Real,
    Vector,
    Whole,
    refusing_in_one_line,
)

SAMPLES = 16
"""Rays to a light, or for ambient occlusion, from each point that is shaded, if not given."""

MOST_SAMPLES = 4096

UPRIGHT = 0.999
"""Cosine of the angle between the way a rectangle shines and its ``up``, or z: beyond it, ``up`` is another axis."""

Samples = Annotated[Whole, Field(ge=1, le=MOST_SAMPLES)]
Angle = Annotated[Real, Field(ge=0.0, le=90.0)]

KEYS = {
    "directional": (("direction", "radiance"), ()),
    "point": (("position", "intensity"), ()),
    "spot": (("position", "direction", "intensity"), ("inner_angle", "outer_angle", "radius", "samples")),
    "sphere": (("position", "radius", "radiance"), ("samples", "visible")),
    "rectangle": (("position", "direction", "width", "height", "radiance"), ("up", "samples", "visible")),
}
"""What a light of each kind needs, and what else it may have."""


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Occlusion:
    """Ambient light is dimmed by what stands close to a surface."""

    distance: Positive
    """How far off it may stand, in the world."""
    samples: Samples = SAMPLES
    """Rays from each point that is shaded."""


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Lighting:
    """What all lights share."""

    ambient: Color | None = None
    """Added irradiance / pi. If not given, it is that of the environment's preset, or else ``AMBIENT``."""
    shadows: Flag = False
    occlusion: Occlusion | None = None
    """None: ambient light arrives everywhere."""

    @property
    def is_traced(self) -> bool:
        """Whether rays are asked what stands in the way of light."""
        return self.shadows or self.occlusion is not None


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Light:
    """A light of some kind; ``KEYS`` has what goes with each."""

    kind: Literal["directional", "point", "spot", "sphere", "rectangle"]
    direction: Direction | None = None
    """The way a directional light travels, a spot light points, or a rectangle shines, to one side."""
    radiance: Color | None = None
    """Directional: radiance leaving a white diffuse surface that faces the light. Sphere, rectangle: its surface's."""
    position: Vector | None = None
    """Of a sphere or a rectangle, its middle."""
    intensity: Intensity | None = None
    """Point, spot: ``intensity / distance^2`` in place of the radiance of a directional light."""
    radius: Positive | None = None
    """Of a sphere. Of a spot light, that its shadows are as soft as a sphere's; not given: they are hard."""
    inner_angle: Angle = 0.0
    """Spot: degrees from its axis up to which it shines in full."""
    outer_angle: Angle = 45.0
    """Spot: degrees from its axis at which its light ends; between the two it falls off as glTF says."""
    width: Positive | None = None
    height: Positive | None = None
    up: Direction | None = None
    """Rectangle: the direction of its height, as near as it can be; if not given z, or y if it shines along z."""
    samples: Samples = SAMPLES
    """Shadow rays from each point that is shaded; a spot light without ``radius`` takes one."""
    visible: Flag = True
    """Sphere, rectangle: whether mirrors and the camera see its shape."""

    @model_validator(mode="after")
    def _has_what_its_kind_needs(self) -> Light:
        needed, allowed = KEYS[self.kind]
        for entry in dataclasses.fields(self):
            is_given = getattr(self, entry.name) != entry.default
            if entry.name in needed and not is_given:
                raise ValueError(f"a {self.kind} light needs '{entry.name}' ({_having(self.kind)})")
            if is_given and entry.name not in ("kind", *needed, *allowed):
                raise ValueError(f"a {self.kind} light has no '{entry.name}' ({_having(self.kind)})")
        if self.inner_angle > self.outer_angle:
            raise ValueError(f"inner_angle {self.inner_angle:g} should be at most outer_angle, {self.outer_angle:g}")
        return self

    @property
    def axes(self) -> np.ndarray:
        """(3, 3) float64 unit rows: to the right and up along a rectangle's sides, and the way it shines; in the world.

        It is looked at against the way it shines. Where ``up`` is along that way, another axis stands for it.
        """
        forward = _unit(np.asarray(self.direction, float))
        up = np.array([0.0, 1.0, 0.0] if abs(forward[2]) > UPRIGHT else [0.0, 0.0, 1.0])
        if self.up is not None:
            up = _unit(np.asarray(self.up, float))
            if abs(up @ forward) > UPRIGHT:
                up = np.eye(3)[np.argmin(np.abs(forward))]
        right = _unit(np.cross(up, forward))
        return np.stack([right, np.cross(forward, right), forward])


def _having(kind: str) -> str:
    """What a light of a kind has, in words."""
    needed, allowed = KEYS[kind]
    optional = f", and may have {_listed(allowed)}" if allowed else ""
    return f"it has {_listed(needed)}{optional}"


def _listed(names: tuple[str, ...]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}"


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)
