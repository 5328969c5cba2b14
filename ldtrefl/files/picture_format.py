"""What a picture file holds of linear radiance, by the ending of its name.

PNG, JPEG and WebP hold what a display shows, EXR the radiance itself, as in Blender and Mitsuba: neither exposure nor
tone mapping touches it, so that both can be chosen later. Of pixels with alpha, colours in an EXR are multiplied by it,
as that format has it, and in a PNG or a WebP they are not.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from ldtrefl.base.checked import CONFIG, Flag, Whole, plain
from ldtrefl.base.errors import InputError, first_fault
from ldtrefl.files.dither import dithered
from ldtrefl.files.tone_mapping import Exposure, ToneMapping, shown

JPEG, WEBP = (".jpg", ".jpeg"), (".webp",)
LOSSY = (*JPEG, *WEBP)
WRITABLE = (".png", ".exr", *LOSSY)
"""Endings of the names of pictures that can be written."""

QUALITY = 92
"""Of JPEG and WebP, if none is given: steps are hard to see, even in slow gradients."""

SMALLEST_ALPHA = np.float32(1e-6)
"""A colour is divided by its alpha, which is at least this."""


@dataclass(frozen=True, kw_only=True, config=CONFIG)
class PictureFormat:
    """How linear radiance is written."""

    exposure: Exposure = 0.0
    """Stops: each shows everything twice as bright."""
    tone_mapping: ToneMapping = "none"
    bits: Annotated[Literal[8, 16], BeforeValidator(plain)] = 8
    """Of a channel of a PNG, 8 or 16."""
    quality: Annotated[Whole, Field(ge=1, le=100)] | None = None
    """Of JPEG and WebP, 1 to 100; a WebP of 100 loses nothing."""
    dither: Flag | None = None
    """Whether values between two of the file's are dithered. If not given, 8-bit PNGs of tone-mapped pictures are: they
    are looked at. What is not tone-mapped may be compared, and is rounded to the nearest."""

    @classmethod
    def checked(cls, path: Path, **options: object) -> PictureFormat:
        """The format of a file with these options.

        Raises:
            InputError: an option or a value is not allowed, or does not go with the ending of the file's name.
        """
        try:
            chosen: PictureFormat = TypeAdapter(cls).validate_python(options)
        except ValidationError as error:
            raise first_fault(error, {"": list(cls.__dataclass_fields__)}).within(str(path)) from None
        ending = path.suffix.lower()
        wrong = {
            "exposure": ending == ".exr" and chosen.exposure != 0.0,
            "tone_mapping": ending == ".exr" and chosen.tone_mapping != "none",
            "bits": ending != ".png" and chosen.bits != 8,
            "dither": ending != ".png" and chosen.dither is not None,
            "quality": ending not in LOSSY and chosen.quality is not None,
        }
        goes_with = {"bits": "PNG", "dither": "PNG", "quality": "JPEG and WebP"}
        for name in (name for name, is_wrong in wrong.items() if is_wrong):
            kinds = goes_with.get(name, "PNG, JPEG and WebP; an EXR holds the radiance itself")
            raise InputError(f"{path}: {name} goes with {kinds}")
        return chosen

    @property
    def _dithers(self) -> bool:
        return self.bits == 8 and self.tone_mapping != "none" if self.dither is None else self.dither

    def encoded(self, rows: np.ndarray, first_row: int = 0) -> np.ndarray:
        """The whole numbers that a file holds for (h, w, 3 or 4) radiance; colours of 4 channels are multiplied by the
        fourth, and not in the file. ``first_row`` is where the rows begin in their picture."""
        color = rows[..., :3]
        if rows.shape[2] == 4:
            color = color / np.maximum(rows[..., 3:], SMALLEST_ALPHA)
        values = shown(color, self.exposure, self.tone_mapping) * (2.0**self.bits - 1.0)
        values = dithered(values, first_row) if self._dithers else np.round(values)
        if rows.shape[2] == 4:
            alpha = np.round(np.clip(rows[..., 3:], 0.0, 1.0) * (2.0**self.bits - 1.0))
            values = np.concatenate([values, alpha], axis=2)
        return values.astype(np.uint8 if self.bits == 8 else np.uint16)
