"""The environment of a scene: what a ray that hits nothing sees."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from ldtrefl.base.checked import CONFIG, Color, Number, Real, Reflectance, Text, refusing_in_one_line
from ldtrefl.files.picture_reading import stored_picture
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.presets.base import Surroundings
from ldtrefl.scene.presets.sky import sky
from ldtrefl.scene.presets.soft_boxes import studio

SKY, GROUND = (0.55, 0.70, 0.95), (0.30, 0.28, 0.25)

BY_DAY: dict[str, tuple[float, float, float]] = {"sky": (42.0, -50.0, 2.2), "sunset": (8.0, -15.0, 2.8)}
"""Presets with a sun. If the scene does not say so: degrees that it stands above the horizon and about ``up``, and the
turbidity of the air."""

SUN_KEYS = ("sun_elevation", "sun_azimuth", "turbidity", "ground_albedo")


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Environment:
    """What a ray that hits nothing sees: a blend from ground to sky by its height, an equirectangular image, or a
    preset, which brings light along."""

    sky: Color = SKY
    """Radiance straight up."""
    ground: Color = GROUND
    """Radiance straight down."""
    image: Text | None = None
    """A picture file, in place of sky and ground."""
    preset: Literal["studio", "sky", "sunset"] | None = None
    """What is made in their place: a photographer's studio, or sun and sky by day."""
    rotation: Number = 0.0
    """Degrees that an image or a preset is turned about ``up``, counter-clockwise seen from above."""
    strength: Annotated[Real, Field(ge=0.0, le=1e6)] = 1.0
    """A factor on the radiance of an image, or of a preset and its lights."""
    sun_elevation: Annotated[Real, Field(ge=0.0, le=90.0)] | None = None
    """Of a preset with a sun: degrees above the horizon; 42 of "sky" and 8 of "sunset" if not given."""
    sun_azimuth: Number | None = None
    """Degrees about ``up``; where that is z, 0 is +x and 90 is +y. -50 of "sky" and -15 of "sunset" if not given."""
    turbidity: Annotated[Real, Field(ge=1.7, le=10.0)] | None = None
    """How hazy the air is: 2 clear, 3 usual, 6 hazy; 2.2 of "sky" and 2.8 of "sunset" if not given."""
    ground_albedo: Reflectance | None = None
    """Of the ground below the horizon."""

    @model_validator(mode="after")
    def _says_one_thing(self) -> Environment:
        if self.image is not None and self.preset is not None:
            raise ValueError("'image' and 'preset' exclude each other")
        if self.preset is not None and (self.sky, self.ground) != (SKY, GROUND):
            raise ValueError("'sky' and 'ground' do not go with 'preset'")
        if self.image is None and self.preset is None and (self.rotation, self.strength) != (0.0, 1.0):
            raise ValueError("'rotation' and 'strength' go with 'image' or 'preset'")
        for key in SUN_KEYS:
            if getattr(self, key) is not None and self.preset not in BY_DAY:
                raise ValueError(f"'{key}' goes with the presets {' and '.join(BY_DAY)}")
        return self

    @functools.cached_property
    def surroundings(self) -> Surroundings | None:
        """What the preset gives, at a strength of 1 and as it is before it is turned; None without one."""
        return None if self.preset is None else self._maker()

    @property
    def _maker(self) -> Callable[[], Surroundings]:
        if self.preset not in BY_DAY:
            return studio
        elevation, azimuth, turbidity = BY_DAY[self.preset]
        return functools.partial(
            sky,
            elevation if self.sun_elevation is None else self.sun_elevation,
            azimuth if self.sun_azimuth is None else self.sun_azimuth,
            turbidity if self.turbidity is None else self.turbidity,
            GROUND if self.ground_albedo is None else self.ground_albedo,
        )

    @functools.cached_property
    def picture(self) -> StoredPicture | None:
        """The picture that ``image`` names, read when it is first asked for, or that of the preset; None without."""
        if self.surroundings is not None:
            return self.surroundings.picture
        return None if self.image is None else stored_picture(self.image)
