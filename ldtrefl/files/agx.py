"""AgX (Troy Sobotka, 2022) as Blender 4 shows it: linear radiance of any brightness to what an sRGB display shows.

Bright colours go to white by way of paler ones, in place of being cut off channel by channel, which turns a bright red
yellow. The image is formed in Rec. 2020: an *inset* makes colours paler, a sigmoid over the logarithm compresses each
channel, and an *outset* makes what is left as colourful as it was. What then lies outside of sRGB is moved inside.

This is computed as by the script that Blender's table is made by ("AgXBasesRGB" of Z. E. Zhou's AgX_LUT_Gen), not
looked up in the table (``AgX_Base_sRGB.cube``), nor by a polynomial. At the table's own points it agrees to 2e-6.
Between them Blender interpolates: a picture of the teapot scene differs by a quarter of a byte's step in the mean, by
1.8 steps at most.

Channels come first: arrays are (3, ...) float32.
"""

from __future__ import annotations

import numpy as np

MIDDLE_GREY = 0.18
"""Radiance that stays as it is."""

STOPS_BELOW, STOPS_ABOVE = 10.0, 6.5
"""Stops below and above middle grey at which the sigmoid reaches 0 and 1."""

STOPS_OF_TABLE = 25.0
"""Stops above the darkest that Blender's table holds. What is brighter counts as this."""

SLOPE = 2.4
"""Of the sigmoid at middle grey."""

BEND = 1.5
"""How suddenly the sigmoid turns to its limits, as a power."""

DISPLAY_POWER = 2.4
"""What the sigmoid gives is encoded by this power."""

HUE_SHIFT = 0.4
"""The sigmoid shifts hues. This share of that is kept: it is what makes fire yellow."""

DARK_POWER = 0.08
"""Of the luminance: how fast the correction for colours outside of sRGB fades as they get brighter."""

TINY = np.float32(1e-30)
"""What is divided by, and what the logarithm is taken of, is at least this."""

_XYZ_FROM_2020 = [
    [0.6369535067850740, 0.1446191846692331, 0.1688558539228734],
    [0.2626983389565560, 0.6780087657728165, 0.0592928952706273],
    [0.0, 0.0280731358475570, 1.0608272349505707],
]
_SRGB_FROM_XYZ = [
    [3.2410032329763587, -1.5373989694887855, -0.4986158819963629],
    [-0.9692242522025164, 1.8759299836951759, 0.0415542263400847],
    [0.0556394198519755, -0.2040112061239099, 1.0571489771875333],
]
_INSET = [
    [0.856627153315983, 0.0951212405381588, 0.0482516061458583],
    [0.137318972929847, 0.761241990602591, 0.101439036467562],
    [0.11189821299995, 0.0767994186031903, 0.811302368396859],
]
_UNDONE_BY_OUTSET = [
    [0.899796955911611, 0.0871996192028351, 0.013003424885555],
    [0.11142098895748, 0.875575586156966, 0.0130034248855548],
    [0.11142098895748, 0.0871996192028349, 0.801379391839686],
]
_SRGB_FROM_2020 = np.array(_SRGB_FROM_XYZ) @ _XYZ_FROM_2020
_INSET_FROM_SRGB = np.array(_INSET) @ np.linalg.inv(_SRGB_FROM_2020)
_SRGB_FROM_OUTSET = _SRGB_FROM_2020 @ np.linalg.inv(_UNDONE_BY_OUTSET)
_LUMINANCE = np.array([0.2658180370250449, 0.59846986045365, 0.1357121025213052]) @ np.linalg.inv(_SRGB_FROM_2020)
"""Of the channels of sRGB, by the colour matching functions of CIE 2015."""


def agx(radiance: np.ndarray) -> np.ndarray:
    """What a display shows, (3, ...) float32 from 0 to 1 and linear, of (3, ...) linear sRGB; negative counts as 0."""
    inset = _times(_INSET_FROM_SRGB, np.maximum(radiance, np.float32(0.0)))
    formed = _sigmoid(inset) ** np.float32(DISPLAY_POWER)
    shift = (_hue(formed) - _hue(inset) + 3.0) % 6.0 - 3.0
    hue = (_hue(inset) + np.float32(HUE_SHIFT) * shift) % 6.0
    formed = _of_hue(hue, formed.min(axis=0), formed.max(axis=0))
    return np.clip(_inside_srgb(_times(_SRGB_FROM_OUTSET, formed)), 0.0, 1.0)


def _times(matrix: np.ndarray, color: np.ndarray) -> np.ndarray:
    """A matrix times every colour; not by BLAS, whose threads spin on."""
    red, green, blue = color
    return np.stack([row[0] * red + row[1] * green + row[2] * blue for row in matrix.astype(np.float32)])


def _sigmoid(radiance: np.ndarray) -> np.ndarray:
    """Display values of each channel, 0 to a little over 1: straight at middle grey, bent to both sides."""
    all_stops = STOPS_BELOW + STOPS_ABOVE
    stops = np.log2(np.maximum(radiance, TINY) / np.float32(MIDDLE_GREY)) + np.float32(STOPS_BELOW)
    x = np.clip(stops, 0.0, STOPS_OF_TABLE) / np.float32(all_stops)
    middle_x, middle_y = STOPS_BELOW / all_stops, MIDDLE_GREY ** (1.0 / DISPLAY_POWER)
    toe, shoulder = _reach(middle_x, middle_y), _reach(1.0 - middle_x, 1.0 - middle_y)
    reach = np.where(x < middle_x, np.float32(toe), np.float32(shoulder))
    distance = np.abs(x - np.float32(middle_x)) * np.float32(SLOPE) / reach
    bent = distance / (1.0 + distance ** np.float32(BEND)) ** np.float32(1.0 / BEND)
    return np.maximum(np.float32(middle_y) + np.where(x < middle_x, -reach, reach) * bent, np.float32(0.0))


def _reach(x: float, y: float) -> float:
    """How far from the middle a side of the sigmoid would go at last, if it passes ``y`` at ``x`` from there."""
    straight = SLOPE * x
    return float((straight**-BEND * ((straight / y) ** BEND - 1.0)) ** (-1.0 / BEND))


def _hue(color: np.ndarray) -> np.ndarray:
    """Hue in sixths of the circle, red at 0, from -1 to 5."""
    red, green, blue = color
    high = color.max(axis=0)
    spread = np.maximum(high - color.min(axis=0), TINY)
    of_blue = np.where(high == green, 2.0 + (blue - red) / spread, 4.0 + (red - green) / spread)
    return np.where(high == red, (green - blue) / spread, of_blue)


def _of_hue(hue: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The colour of a hue whose least and largest channel are these."""
    shares = [np.clip(np.abs((hue + turn) % 6.0 - 3.0) - 1.0, 0.0, 1.0) for turn in (0.0, 4.0, 2.0)]
    return np.stack([low + (high - low) * share for share in shares])


def _inside_srgb(color: np.ndarray) -> np.ndarray:
    """A colour without negative channels: white is added, and the luminance that adds is taken away by scaling."""
    raised = color + np.maximum(-color.min(axis=0), np.float32(0.0))
    before, after = _weighed_luminance(color), _weighed_luminance(raised)
    return raised * np.where(after > before, before / np.maximum(after, TINY), np.float32(1.0))


def _weighed_luminance(color: np.ndarray) -> np.ndarray:
    """Luminance; of dark colours that of the opponent colour is counted in, as negative channels spoil their own."""
    (luminance,) = _times(_LUMINANCE[None], color)
    high = color.max(axis=0)
    opponent = high - color
    (of_opponent,) = _times(_LUMINANCE[None], opponent)
    compensated = opponent.max(axis=0) - of_opponent + luminance
    share = np.minimum(np.maximum(luminance, np.float32(0.0)) ** np.float32(DARK_POWER), np.float32(1.0))
    return compensated + (luminance - compensated) * share
