"""Buffer views that meshoptimizer has compressed (EXT_meshopt_compression), unpacked by ``meshoptimizer``, which the
extra ``gltf`` has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError

EXTRA = "pip install 'ldtrefl[gltf]'"
"""What installs the readers of compressed geometry."""

MODES = ("ATTRIBUTES", "TRIANGLES", "INDICES")
FILTERS = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL")


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
    if stride < 1 or stride > 256 or (mode != "ATTRIBUTES" and stride not in (2, 4)):
        raise InputError(f"{place}.byteStride: {stride} is not allowed for {mode}")
    try:
        import meshoptimizer  # noqa: PLC0415  an extra
    except ImportError:
        raise InputError(f"{place}: it is compressed by meshoptimizer ({EXTRA} lets it be read)") from None
    budget.take(4.0 * count * stride, f"{place}: unpacking it")
    packed = bytes(data)
    try:
        if mode == "TRIANGLES":
            found = np.asarray(meshoptimizer.decode_index_buffer(count, stride, packed))
        elif mode == "INDICES":
            found = np.asarray(meshoptimizer.decode_index_sequence(count, stride, packed))
        else:
            found = np.asarray(meshoptimizer.decode_vertex_buffer(count, stride, packed))
    except Exception as error:  # whatever damaged data provoke in a reader is the file's fault
        raise InputError(f"{place}: it is damaged ({type(error).__name__})") from error
    rows = np.frombuffer(np.ascontiguousarray(found).tobytes()[: count * stride], np.uint8).reshape(count, stride)
    return filtered(rows, kind, place).tobytes()


def filtered(rows: np.ndarray, kind: str, place: str) -> np.ndarray:
    """(count, stride) bytes of elements, decoded by the extension's filters."""
    if kind == "NONE":
        return rows
    stride = rows.shape[1]
    if kind == "EXPONENTIAL":
        if stride % 4:
            raise InputError(f"{place}.byteStride: {stride} is not allowed for EXPONENTIAL")
        words = np.ascontiguousarray(rows).view("<i4")
        exponent, mantissa = words >> 24, (words << 8) >> 8
        return np.ascontiguousarray(np.ldexp(mantissa.astype(np.float64), exponent).astype("<f4")).view(np.uint8)
    if kind == "OCTAHEDRAL":
        if stride not in (4, 8):
            raise InputError(f"{place}.byteStride: {stride} is not allowed for OCTAHEDRAL")
        whole: Any = np.dtype("<i1") if stride == 4 else np.dtype("<i2")
        stored = np.ascontiguousarray(rows).view(whole).astype(np.float64)
        largest = float(np.iinfo(whole).max)
        x, y, one = stored[:, 0], stored[:, 1], stored[:, 2]
        x, y = x / one, y / one
        z = 1.0 - np.abs(x) - np.abs(y)
        below = np.maximum(-z, 0.0)
        x, y = x - np.where(x >= 0.0, below, -below), y - np.where(y >= 0.0, below, -below)
        length = np.sqrt(x * x + y * y + z * z)
        made = np.round(np.stack([x, y, z], axis=1) * (largest / length[:, None]))
        result = np.concatenate([made, stored[:, 3:]], axis=1)
        return np.ascontiguousarray(np.nan_to_num(result).astype(whole)).view(np.uint8)
    if stride != 8:
        raise InputError(f"{place}.byteStride: {stride} is not allowed for QUATERNION")
    stored = np.ascontiguousarray(rows).view("<i2").astype(np.int64)
    one = (stored[:, 3] | 3).astype(np.float64)
    three = stored[:, :3] / (one * np.sqrt(2.0))[:, None]
    last = np.sqrt(np.maximum(1.0 - (three * three).sum(axis=1), 0.0))
    made = np.empty((len(stored), 4))
    which = (stored[:, 3] & 3).astype(np.int64)
    every = np.arange(len(stored))
    for k in range(3):
        made[every, (which + 1 + k) % 4] = three[:, k]
    made[every, which] = last
    return np.ascontiguousarray(np.round(made * 32767.0).astype("<i2")).view(np.uint8)
