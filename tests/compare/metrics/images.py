"""Images that are made up."""

import numpy as np


def noise(h: int = 20, w: int = 30) -> np.ndarray:
    """(h, w, 3) radiance, every pixel its own."""
    return np.random.default_rng(0).random((h, w, 3)).astype(np.float32)
