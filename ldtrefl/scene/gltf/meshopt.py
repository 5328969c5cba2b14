"""Buffer views that meshoptimizer has compressed (EXT_meshopt_compression), unpacked by ``meshoptimizer``, which the
extra ``gltf`` has."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError

EXTRA = "pip install 'ldtrefl[gltf]'"
"""What installs the readers of compressed geometry."""

MODES = ("ATTRIBUTES", "TRIANGLES", "INDICES")
FILTERS = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL")
STRIDES = {"OCTAHEDRAL": (4, 8), "QUATERNION": (8,)}
"""Bytes of an element that filters allow."""


def unpacked(data: memoryview, count: int, stride: int, table: Mapping[str, object], place: str) -> bytes:
    """The bytes of a buffer view.

    Args:
        data: the packed bytes.
        count: elements.
        stride: bytes of each.
        table: the extension's table.
        place: where it stands.

    Raises:
        InputError: meshoptimizer is not installed, or the data are damaged.
    """
    mode, kind = table.get("mode"), table.get("filter", "NONE")
    if mode not in MODES or kind not in FILTERS:
        raise InputError(f"{place}: allowed are the modes {', '.join(MODES)} and the filters {', '.join(FILTERS)}")
    strides = STRIDES.get(kind, range(4, 257, 4)) if mode == "ATTRIBUTES" else (2, 4)
    if stride not in strides:
        raise InputError(f"{place}.byteStride: {stride} is not allowed for {mode} and {kind}")
    try:
        import meshoptimizer  # noqa: PLC0415  an extra
    except ImportError:
        raise InputError(f"{place}: it is compressed by meshoptimizer ({EXTRA} lets it be read)") from None
    budget.take(4.0 * count * stride, f"{place}: unpacking it")
    decoders = {
        "ATTRIBUTES": meshoptimizer.decode_vertex_buffer,
        "TRIANGLES": meshoptimizer.decode_index_buffer,
        "INDICES": meshoptimizer.decode_index_sequence,
    }
    filters = {
        "OCTAHEDRAL": meshoptimizer.decode_filter_oct,
        "QUATERNION": meshoptimizer.decode_filter_quat,
        "EXPONENTIAL": meshoptimizer.decode_filter_exp,
    }
    try:
        found = np.frombuffer(decoders[mode](count, stride, bytes(data)).tobytes(), np.uint8)
        return bytes(filters[kind](found, count, stride) if kind in filters else found)
    except Exception as error:  # whatever damaged data provoke in a reader is the file's fault
        raise InputError(f"{place}: it is damaged ({type(error).__name__})") from error
