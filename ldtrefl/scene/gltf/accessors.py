"""Accessors (glTF 2.0, 3.6.2): typed arrays in the bytes of buffers."""

from __future__ import annotations

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.container import Document, Table

COMPONENTS = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
"""NumPy's type of each ``componentType``."""

SHAPES = {
    "SCALAR": (1, 1),
    "VEC2": (2, 1),
    "VEC3": (3, 1),
    "VEC4": (4, 1),
    "MAT2": (2, 2),
    "MAT3": (3, 3),
    "MAT4": (4, 4),
}
"""(rows, columns) of each ``type``."""

MOST = 1 << 31
"""Elements of an accessor, at most: they are numbered by int32."""


def elements(document: Document, number: object, place: str) -> np.ndarray:
    """The elements of an accessor as they are stored, (count,) or (count, components); a matrix is in rows.

    Args:
        document: the asset.
        number: of the accessor.
        place: what refers to it.

    Raises:
        InputError: there is none, it is not sound, or reaches beyond its buffer view.
    """
    entry = document.entry("accessors", number, place)
    where = f"accessors[{number}]"
    count = document.whole(entry, "count", where)
    dtype, (rows, columns) = _type_of(entry, where)
    if count > MOST:
        raise InputError(f"{where}.count: at most {MOST} elements are allowed, got {count}")
    width = rows * columns
    # The result, and what conversions need.
    budget.take(2.0 * count * width * dtype.itemsize, f"{where} of {count} elements")
    if entry.get("bufferView") is None:
        made = np.zeros((count, width), dtype)
    else:
        made = _in_view(document, entry, where, count, dtype, rows, columns)
    if entry.get("sparse") is not None:
        made = _replaced(document, document.table(entry["sparse"], f"{where}.sparse"), where, made, (rows, columns))
    if columns > 1:  # stored column by column
        made = np.ascontiguousarray(made.reshape(count, columns, rows).transpose(0, 2, 1)).reshape(count, width)
    return made[:, 0] if width == 1 else made


def values(document: Document, number: object, place: str) -> np.ndarray:
    """The elements of an accessor as float64; ``normalized`` integers become fractions (3.6.2.2)."""
    stored = elements(document, number, place)
    is_normalized = document.entry("accessors", number, place).get("normalized") is True
    return fractions(stored) if is_normalized else stored.astype(np.float64)


def fractions(stored: np.ndarray) -> np.ndarray:
    """Integers as fractions of their type's largest, float64, by the equations of 3.6.2.2; floats as they are."""
    found = stored.astype(np.float64)
    if stored.dtype.kind in "iu":
        found = np.maximum(found / np.iinfo(stored.dtype).max, -1.0)
    return found


def _type_of(entry: Table, where: str) -> tuple[np.dtype, tuple[int, int]]:
    kind, shape = entry.get("componentType"), entry.get("type")
    if not isinstance(kind, int) or kind not in COMPONENTS:
        raise InputError(f"{where}.componentType: allowed are {', '.join(map(str, COMPONENTS))}, got {kind!r:.40}")
    if not isinstance(shape, str) or shape not in SHAPES:
        raise InputError(f"{where}.type: allowed are {', '.join(SHAPES)}, got {shape!r:.40}")
    return np.dtype(COMPONENTS[kind]).newbyteorder("<"), SHAPES[shape]


def _in_view(
    document: Document, entry: Table, where: str, count: int, dtype: np.dtype, rows: int, columns: int
) -> np.ndarray:
    """(count, rows * columns) elements in a buffer view; of matrices the padding after a column is left out."""
    number = entry.get("bufferView")
    data = document.view(number, f"{where}.bufferView")
    view = document.entry("bufferViews", number, where)
    first = document.whole(entry, "byteOffset", where, 0)
    # Columns of matrices begin at multiples of four bytes (3.6.2.4).
    column = rows * dtype.itemsize
    column_stride = column + -column % 4 if columns > 1 else column
    size = columns * column_stride
    stride = document.whole(view, "byteStride", f"bufferViews[{number}]", size) or size
    if stride < size:
        raise InputError(f"bufferViews[{number}].byteStride: {stride} is less than an element of {where}, {size} bytes")
    needed = first + stride * (count - 1) + (columns - 1) * column_stride + column if count else 0
    if needed > len(data):
        raise InputError(f"{where}: it ends at byte {needed} of a buffer view of {len(data)}")
    if count == 0:
        return np.zeros((0, rows * columns), dtype)
    shape, strides = (count, columns, rows), (stride, column_stride, dtype.itemsize)
    found = np.ndarray(shape, dtype, buffer=data, offset=first, strides=strides)
    return np.array(found.reshape(count, columns * rows), dtype.newbyteorder("="))


def _replaced(document: Document, sparse: Table, where: str, made: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """The elements, some of them replaced (3.6.2.3)."""
    place = f"{where}.sparse"
    count = document.whole(sparse, "count", place)
    indices = document.table(sparse.get("indices"), f"{place}.indices")
    kind = indices.get("componentType")
    if kind not in (5121, 5123, 5125):
        raise InputError(f"{place}.indices.componentType: allowed are 5121, 5123, 5125, got {kind!r:.40}")
    of = {"count": count, "componentType": kind, "type": "SCALAR"} | _where(indices)
    numbers = _in_view(document, of, f"{place}.indices", count, *_plain(of, f"{place}.indices"))[:, 0].astype(np.int64)
    if count and (numbers.max() >= len(made) or (np.diff(numbers) <= 0).any()):
        raise InputError(f"{place}.indices: they should rise, and be less than {len(made)}")
    dtype = made.dtype.newbyteorder("<")
    of = {"count": count} | _where(document.table(sparse.get("values"), f"{place}.values"))
    made = made.astype(made.dtype.newbyteorder("="))
    made[numbers] = _in_view(document, of, f"{place}.values", count, dtype, *shape)
    return made


def _plain(entry: Table, where: str) -> tuple[np.dtype, int, int]:
    dtype, (rows, columns) = _type_of(entry, where)
    return dtype, rows, columns


def _where(table: Table) -> Table:
    """Where the numbers of a sparse accessor lie, as an accessor says it."""
    return {key: table[key] for key in ("bufferView", "byteOffset") if key in table}
