"""From linear radiance to what a display shows: exposure, tone mapping, the sRGB encoding.

- ``none``: as it is, cut off at 1. What metrics compare.
- ``agx``: Blender 4's default view (``agx.py``).
- ``aces``: the RRT and the ODT for sRGB of ACES 1.3, by the configuration that OpenColorIO is built with. Blender 5
  calls this view "ACES 1.3".

Each is monotone: with more exposure no luminance falls.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
import OpenImageIO as oiio
from pydantic import Field

from ldtrefl.base.checked import Real
from ldtrefl.base.errors import InputError
from ldtrefl.files.agx import agx
from ldtrefl.files.srgb import srgb_from_linear

ToneMapping = Literal["none", "agx", "aces"]
Exposure = Annotated[Real, Field(ge=-32.0, le=32.0)]
"""Stops."""

ACES_CONFIG = "ocio://cg-config-v1.0.0_aces-v1.3_ocio-v2.1"
"""Every OpenColorIO from 2.2 on has it built in, and it never changes."""
ACES_DISPLAY, ACES_VIEW = "sRGB - Display", "ACES 1.0 - SDR Video"
ACES_LINEAR_SRGB = "Linear Rec.709 (sRGB)"

BRIGHTEST = np.float32(65504.0)
"""Brighter radiance is shown as this, the largest half float: the curves are white far below, and stay finite."""


def shown(radiance: np.ndarray, exposure: float = 0.0, tone_mapping: ToneMapping = "none") -> np.ndarray:
    """What a display shows of (h, w, 3) linear radiance: sRGB-encoded float32 from 0 to 1.

    Args:
        radiance: linear, in the primaries of sRGB.
        exposure: stops; each shows everything twice as bright.
        tone_mapping: one of the names above.
    """
    with np.errstate(over="ignore"):
        exposed = radiance if exposure == 0.0 else radiance * np.float32(2.0**exposure)
    if tone_mapping == "none":
        return srgb_from_linear(exposed)
    exposed = np.minimum(exposed, BRIGHTEST)
    if tone_mapping == "aces":
        return _aces(exposed)
    channels = np.ascontiguousarray(np.moveaxis(exposed, -1, 0), np.float32)
    return srgb_from_linear(np.moveaxis(agx(channels), 0, -1))


def _aces(radiance: np.ndarray) -> np.ndarray:
    """The same by ACES."""
    picture = oiio.ImageBuf(np.ascontiguousarray(radiance, np.float32))
    to_display = oiio.ImageBufAlgo.ociodisplay
    made = to_display(picture, ACES_DISPLAY, ACES_VIEW, fromspace=ACES_LINEAR_SRGB, colorconfig=ACES_CONFIG)
    if made.has_error:
        raise InputError(f"tone_mapping aces: OpenColorIO cannot do it ({made.geterror()})")
    return np.clip(np.asarray(made.get_pixels(oiio.FLOAT)), 0.0, 1.0)
