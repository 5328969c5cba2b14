"""Copies of structs for many objects that share few: what a scene's objects have of their meshes."""

from __future__ import annotations

import numpy as np


def struct_copies(structs: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """(n,) copies of the structs of these (n,) numbers.

    Args:
        structs: (m,) structured, as a Warp array of structs is in numpy.
        numbers: (n,) whole numbers below m.
    """
    # As plain bytes they are copied in one go, not field by field.
    return structs.view(f"V{structs.dtype.itemsize}")[numbers].view(structs.dtype)
