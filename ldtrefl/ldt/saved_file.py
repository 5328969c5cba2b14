"""A layered depth texture in a file of its own (NumPy's ``.npz``): its mesh, its box of texels and its maps.

A file may come from anybody: all of it is checked before a kernel reads what it points to.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ldtrefl.base.errors import InputError
from ldtrefl.files.atomic_write import written_whole
from ldtrefl.files.npz import Expected, read_arrays
from ldtrefl.ldt.maps import Maps, check_fragments
from ldtrefl.ldt.options import MOST_TEXELS
from ldtrefl.ldt.texel_frame import TexelFrame
from ldtrefl.scene.mesh import Mesh

FORMAT = 1
"""Goes up when what files hold changes."""

SAVED: Expected = {
    "format": (np.int64, ()),
    "vertices": (np.float64, (None, 3)),
    "faces": (np.int32, (None, 3)),
    "normals": (np.float32, (None, 3)),
    "size": (np.int64, (3,)),
    "scale": (np.float64, ()),
    "offset": (np.float64, (3,)),
    "start": (np.int32, (None,)),
    "depth": (np.float32, (None,)),
    "reference": (np.int32, (None,)),
}
"""The arrays of a file: type and shape, None where any number will do."""

LARGEST = 1e30
"""A scale and an offset that are read lie below this: they are handed to kernels as float32."""


def write_file(path: str | Path, mesh: Mesh, frame: TexelFrame, maps: Maps) -> None:
    """Write maps and their mesh to one file, whole or not at all.

    Raises:
        InputError: the file cannot be written.
    """
    arrays = {
        "format": np.int64(FORMAT),
        "vertices": mesh.vertices,
        "faces": mesh.faces,
        "normals": mesh.normals,
        "size": np.array(frame.size),
        "scale": np.float64(frame.scale),
        "offset": np.array(frame.offset),
        "start": maps.start.numpy(),
        "depth": maps.depth.numpy(),
        "reference": maps.reference.numpy(),
    }
    with written_whole(path) as scratch, scratch.open("wb") as file:
        np.savez(file, **arrays)


def read_file(path: str | Path) -> tuple[Mesh, TexelFrame, dict[str, np.ndarray]]:
    """The mesh, the box of texels, and the arrays of the maps, whose texels need not be sorted.

    Raises:
        InputError: the file is missing, damaged, of another format, or larger than the memory allowed.
    """
    try:
        arrays = read_arrays(path, SAVED)
        if arrays["format"] != FORMAT:
            raise InputError(f"format {arrays['format']}, this version reads {FORMAT}")
        mesh, frame = _mesh_and_frame(arrays)
        check_fragments(frame, len(mesh.faces), arrays)
    except (ValueError, KeyError) as error:  # an InputError is a ValueError
        raise InputError(f"{path}: not a layered depth texture that can be read ({error})") from None
    return mesh, frame, arrays


def _mesh_and_frame(arrays: dict[str, np.ndarray]) -> tuple[Mesh, TexelFrame]:
    """What the arrays of a file say of the mesh and of its box of texels.

    Raises:
        ValueError: it cannot be.
    """
    mesh = Mesh(arrays["vertices"], arrays["faces"], arrays["normals"])
    x, y, z = (int(n) for n in arrays["size"])
    scale, offset = float(arrays["scale"]), arrays["offset"]
    if not (min(x, y, z) >= 1 and max(x, y, z) <= MOST_TEXELS):
        raise ValueError(f"{x} x {y} x {z} texels, 1 to {MOST_TEXELS} allowed")
    if not (np.isfinite(arrays["normals"]).all() and 0.0 < scale < LARGEST and (np.abs(offset) < LARGEST).all()):
        raise ValueError("a normal, the scale or the offset is not finite")
    return mesh, TexelFrame((x, y, z), scale, (float(offset[0]), float(offset[1]), float(offset[2])))
