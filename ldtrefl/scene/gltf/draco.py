"""Geometry that Draco has compressed (KHR_draco_mesh_compression), unpacked by DracoPy of the extra ``gltf``."""

from __future__ import annotations

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.container import Document, Table
from ldtrefl.scene.gltf.meshopt import EXTRA

BYTES_PER_BYTE = 120.0
"""Bytes that unpacking takes for a packed byte: the best that Draco packs are flat grids, two bits a vertex."""


def draco_attributes(document: Document, compressed: Table, attributes: Table, where: str) -> dict[str, np.ndarray]:
    """The attributes of a primitive by their names, (n, components) as the accessors' types have them, and ``indices``.

    Raises:
        InputError: DracoPy is not installed, or the data are damaged.
    """
    try:
        import DracoPy  # noqa: PLC0415  an extra
    except ImportError:
        raise InputError(f"{where}: its geometry is compressed by Draco ({EXTRA} lets it be read)") from None
    place = f"{where}.extensions.KHR_draco_mesh_compression"
    data = bytes(document.view(compressed.get("bufferView"), f"{place}.bufferView"))
    announced = _announced(document, attributes, where)
    budget.take(max(announced, BYTES_PER_BYTE * len(data)), f"{place}: unpacking it")
    try:
        mesh = DracoPy.decode(data)
        found = {one["unique_id"]: np.asarray(one["data"]) for one in mesh.attributes}
        faces = np.asarray(mesh.faces)
    except Exception as error:  # whatever damaged data provoke in a reader is the file's fault
        raise InputError(f"{place}: it is damaged ({type(error).__name__})") from error
    numbers = document.table(compressed.get("attributes"), f"{place}.attributes")
    result = {"indices": faces.reshape(-1)}
    for name, number in numbers.items():
        if name in attributes:
            if not isinstance(number, int) or number not in found:
                raise InputError(f"{place}.attributes.{name}: there is no attribute {number!r:.40} in its data")
            values = found[number]
            result[name] = values if values.ndim == 2 or "SCALAR" in name else values.reshape(len(values), -1)
    return result


def _announced(document: Document, attributes: Table, where: str) -> float:
    """Bytes of the attributes that a primitive says it has."""
    total = 0.0
    for name, number in attributes.items():
        entry = document.entry("accessors", number, f"{where}.attributes.{name}")
        total += 32.0 * document.whole(entry, "count", f"accessors[{number}]")
    return total
