"""Pictures as texts that a page holds within itself."""

from __future__ import annotations

import base64
import io

import numpy as np
from PIL import Image

from ldtrefl.compare.difference import difference_image
from ldtrefl.files.tone_mapping import shown

QUALITY = 60
"""Of WebP, 1 to 100."""
GAIN = 4.0
"""By which differences are multiplied: the ends of the scale are a quarter of the way from black to white."""
SMALLER = 2
"""Pixels of a picture along one of its difference."""


def picture_uri(image: np.ndarray) -> str:
    """A picture of (h, w, 3) linear radiance."""
    return _uri(Image.fromarray(_bytes(image)))


def difference_uri(image: np.ndarray, truth: np.ndarray) -> str:
    """The difference of two pictures of (h, w, 3) linear radiance, half as wide and high."""
    height, width = image.shape[:2]
    small = max(1, width // SMALLER), max(1, height // SMALLER)
    return _uri(Image.fromarray(_bytes(difference_image(image, truth, GAIN))).resize(small, Image.Resampling.BOX))


def _bytes(image: np.ndarray) -> np.ndarray:
    return np.asarray(np.rint(255.0 * shown(image)), np.uint8)


def _uri(picture: Image.Image) -> str:
    written = io.BytesIO()
    picture.save(written, "WEBP", quality=QUALITY, method=6)
    return "data:image/webp;base64," + base64.b64encode(written.getvalue()).decode("ascii")
