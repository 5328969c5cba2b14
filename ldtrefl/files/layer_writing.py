"""Layers written as one EXR of one part, under the names that other programs look for.

``beauty`` is the channels R, G, B and ``alpha`` A, which every program opens as the picture: Nuke as ``rgba``, Blender
as ``Combined``. ``depth`` is Z: Nuke's ``depth``, Blender's ``Depth``. Every other layer is its own name, a dot, and
one letter for each channel: ``direct.R``, ``normal.X``. Blender takes nothing longer for a channel, and would take what
stands before another dot for a group of layers, so the names themselves have none.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from ldtrefl.base.errors import InputError, printable
from ldtrefl.files.picture_writing import check_writable
from ldtrefl.files.verified_rows import write_verified

CHANNELS = {
    "beauty": ("R", "G", "B"),
    "alpha": ("A",),
    "depth": ("Z",),
    "normal": ("normal.X", "normal.Y", "normal.Z"),
    "hit_distance": ("hit_distance.Z",),
}
"""Layer -> names of its channels, where they are others than ``NAME.R``, ``NAME.G``, ``NAME.B`` or ``NAME.X``."""

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
"""What a layer may be called."""


def check_layers_writable(path: str | Path) -> Path:
    """``path``, if layers can be written there: asked before any work is spent on them.

    Raises:
        InputError: as :func:`check_writable`; or the name does not end in .exr.
    """
    path = Path(path)
    if path.suffix.lower() != ".exr":
        raise InputError(f"{path}: layers are written as EXR: the name must end in .exr")
    return check_writable(path)


def save_layers(path: str | Path, layers: Mapping[str, np.ndarray]) -> None:
    """Write layers, such as those of ``Frame.layers``, as one EXR of float32 channels.

    Args:
        path: where; the name ends in .exr.
        layers: names, and arrays (h, w, 3) or (h, w) of one size, row 0 at the top.

    Raises:
        InputError: the path cannot be written, or a layer's name or array is not allowed.
    """
    path = check_layers_writable(path)
    if not layers:
        raise InputError(f"{path}: there are no layers to write")
    arrays = {name: np.asarray(layer, np.float32) for name, layer in layers.items()}
    size = next(iter(arrays.values())).shape[:2]
    names: list[str] = []
    for name, array in arrays.items():
        if not NAME.fullmatch(name):
            raise InputError(
                f"{path}: layer '{printable(name)}': a name is letters, digits and _, and begins with none"
            )
        if array.shape not in (size, (*size, 3)) or array.size == 0 or len(size) != 2:
            raise InputError(f"{path}: layer '{name}': an array is (height, width) or (height, width, 3), all alike")
        names += _channels(path, name, 1 if array.ndim == 2 else 3)
    write_verified(path, _spec(size, names), lambda top, bottom: _interleaved(arrays, top, bottom))


def _channels(path: Path, name: str, count: int) -> tuple[str, ...]:
    """The names of a layer's channels."""
    found = CHANNELS.get(name, tuple(f"{name}.{letter}" for letter in ("X" if count == 1 else "RGB")))
    if len(found) != count:
        raise InputError(f"{path}: layer '{name}': it has {len(found)} channels, not {count}")
    return found


def _spec(size: tuple[int, ...], names: list[str]) -> oiio.ImageSpec:
    """What OpenImageIO is told of the file."""
    height, width = size
    spec = oiio.ImageSpec(width, height, len(names), oiio.FLOAT)
    spec.channelnames = tuple(names)
    spec.alpha_channel = names.index("A") if "A" in names else -1
    spec.z_channel = names.index("Z") if "Z" in names else -1
    spec.attribute("oiio:ColorSpace", "linear")
    return spec


def _interleaved(arrays: Mapping[str, np.ndarray], top: int, bottom: int) -> np.ndarray:
    """(rows, width, channels) of all layers."""
    rows = [array[top:bottom] for array in arrays.values()]
    return np.concatenate([part[..., None] if part.ndim == 2 else part for part in rows], axis=2)
