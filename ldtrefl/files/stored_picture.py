"""A picture as it is stored, which textures and environments are kept as."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ldtrefl.files.content_key import content_key


@dataclass(frozen=True, eq=False)
class StoredPicture:
    """A picture's pixels, whose type says how they are encoded: ``uint8`` is sRGB, ``float32`` is linear.

    Whoever makes one hands the pixels over: they become read-only.
    """

    pixels: np.ndarray
    """(h, w, 3) uint8 or float32, row 0 at the top, which is v = 1."""
    alpha: np.ndarray | None = None
    """(h, w) uint8; None if it is opaque, or nobody asked for it."""

    def __post_init__(self) -> None:
        self.pixels.flags.writeable = False
        if self.alpha is not None:
            self.alpha.flags.writeable = False

    @functools.cached_property
    def key(self) -> str:
        """A hash of the pixels: pictures with the same key are the same. Made when it is first asked for."""
        return content_key(self.pixels, self.alpha)
