"""Pictures that the readers of mesh files hand over, as Pillow opened them, made stored pictures."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np
from PIL import Image

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.files.pictures import linear_from_srgb
from ldtrefl.files.stored_picture import StoredPicture

BYTES_A_PIXEL = 4 + 4 + 3
"""What Pillow takes to unpack a picture, what trimesh does to copy it, and what is kept of it."""

ROWS_AT_ONCE = 256

_by_content: weakref.WeakValueDictionary[str, StoredPicture] = weakref.WeakValueDictionary()


def picture_of(material: Any) -> Image.Image | None:
    """The picture of a mesh file's base colour; None without one."""
    return getattr(material, "baseColorTexture", None) or getattr(material, "image", None)


def take_pictures(materials: list[Any]) -> None:
    """Ask for the memory of the pictures of materials, of each as often as it is there, before any is unpacked.

    Raises:
        InputError: it is more than is allowed.
    """
    for picture in map(picture_of, materials):
        if picture is not None:
            width, height = picture.size
            what = f"a texture of {width} x {height} pixels"
            budget.take(width * height * BYTES_A_PIXEL, what, "a smaller texture")


def stored_from_pillow(picture: Image.Image) -> StoredPicture:
    """A stored picture: uint8, or float32 of pictures of more than 8 bits.

    Alpha is left out, and colours are not multiplied by it. For pictures that are the same, the same one is returned.

    Raises:
        InputError: the picture is cut off or damaged.
    """
    width, height = picture.size
    is_deep = picture.mode.startswith("I")  # Pillow would clip, not scale, its 16 bits
    stored = np.empty((height, width, 3), np.float32 if is_deep else np.uint8)
    try:
        for top in range(0, height, ROWS_AT_ONCE):
            rows = picture.crop((0, top, width, min(top + ROWS_AT_ONCE, height)))
            into = stored[top : top + ROWS_AT_ONCE]
            if is_deep:
                into[:] = linear_from_srgb(np.asarray(rows, np.float32)[..., None] / 65535.0)
            else:
                into[:] = np.asarray(rows.convert("RGBA" if "transparency" in picture.info else "RGB"))[..., :3]
    except Exception as error:  # whatever a damaged picture provokes in a reader is the picture's fault
        raise InputError(f"a texture is cut off or damaged ({error})") from error
    made = StoredPicture(stored)
    return _by_content.setdefault(made.key, made)
