"""Arrays of Warp's structs that the host fills by numpy.

Warp finds out what a struct is made of whenever such an array becomes numpy's, or the other way round. That takes a
millisecond. Here it is found out once.
"""

from __future__ import annotations

import ctypes
import functools
from typing import Any

import numpy as np
import warp as wp


@functools.cache
def numpy_type(struct: type) -> np.dtype:
    """What numpy calls an element of an array of these structs."""
    made: Any = struct
    return np.dtype(made.numpy_dtype())


def host_structs(count: int, struct: type) -> tuple[wp.array, np.ndarray]:
    """(an array on the CPU of so many structs, not filled yet; the same memory as numpy's structured array)."""
    made = wp.empty(count, dtype=struct, device="cpu")
    kind = numpy_type(struct)
    if count == 0:
        return made, np.zeros(0, kind)
    memory: Any = (ctypes.c_char * (count * kind.itemsize)).from_address(made.ptr)
    memory.owner = made  # so that it lives as long as what numpy makes of it
    return made, np.frombuffer(memory, kind)


def copy_structs(structs: np.ndarray, numbers: np.ndarray, out: np.ndarray) -> None:
    """Fill ``out``, (n,), with the structs of these (n,) numbers; all are structured arrays of one kind."""
    # As plain bytes they are copied in one go, not field by field.
    plain = f"V{structs.dtype.itemsize}"
    np.take(structs.view(plain), numbers, out=out.view(plain), mode="clip")
