"""Two images beside each other in one picture of their difference."""

from __future__ import annotations

import numpy as np

from ldtrefl.files.srgb import linear_from_srgb, srgb_from_linear

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Weights of red, green and blue in the luminance of Rec. 709."""


def difference_image(image: np.ndarray, reference: np.ndarray, gain: float = 4.0) -> np.ndarray:
    """The signed difference as a picture: grey where equal, red where ``image`` is brighter, blue where darker.

    Differences are taken of luminance (Rec. 709) of the sRGB-encoded images, times ``gain``. Returns linear radiance.
    """
    weights = np.array(LUMINANCE, np.float32)
    delta = gain * ((srgb_from_linear(image) - srgb_from_linear(reference)) @ weights)
    encoded = np.full((*delta.shape, 3), 0.5, np.float32)
    encoded[..., 0] += 0.5 * np.clip(delta, -1, 1)
    encoded[..., 1] -= 0.5 * np.clip(np.abs(delta), 0, 1)
    encoded[..., 2] -= 0.5 * np.clip(delta, -1, 1)
    return linear_from_srgb(np.clip(encoded, 0, 1))
