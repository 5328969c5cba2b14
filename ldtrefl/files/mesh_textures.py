"""Textures of mesh files: picture files, or Pillow pictures as trimesh opens them -> stored pictures.

A stored picture is explained in ``stored_picture.py``.
"""

from __future__ import annotations

import io
import weakref
from collections.abc import Iterable

import numpy as np
from PIL import Image

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.files.pillow_limit import no_pixel_limit
from ldtrefl.files.srgb import linear_from_srgb
from ldtrefl.files.stored_picture import StoredPicture

BYTES_A_PIXEL = 4 + 4 + 3
"""What Pillow takes to unpack a picture, what trimesh takes to copy it, and what is kept of it."""

WITH_ALPHA = ("RGBA", "LA", "PA", "RGBa", "La")
"""Pillow's modes of pictures with alpha."""

UNPACKED_BYTES_A_PIXEL = 12
"""What it takes to unpack a picture file, and what is kept of it."""

ROWS_AT_ONCE = 256
"""Rows of a picture that are converted at a time."""

_shared: weakref.WeakValueDictionary[str, StoredPicture] = weakref.WeakValueDictionary()
"""Key of a stored picture -> that picture, while anybody holds it."""


def texture_of(material: object) -> Image.Image | None:
    """The picture of the base colour of one of trimesh's materials; None if it has none."""
    return getattr(material, "baseColorTexture", None) or getattr(material, "image", None)


def take_memory_for_textures(materials: Iterable[object]) -> None:
    """Ask for the memory of the pictures of materials before any is unpacked. A picture counts once per material.

    Raises:
        InputError: it is more than is allowed.
    """
    for picture in map(texture_of, materials):
        if picture is not None:
            width, height = picture.size
            what = f"a texture of {width} x {height} pixels"
            budget.take(width * height * BYTES_A_PIXEL, what, "a smaller texture")


def stored_texture(picture: Image.Image, *, with_alpha: bool = False) -> StoredPicture:
    """Convert to a stored picture: of uint8, or of float32 if the picture has more than 8 bits.

    Alpha is kept ``with_alpha`` alone, and colours are not multiplied by it. Equal pictures give the same object.

    Raises:
        InputError: the picture is cut off or damaged.
    """
    width, height = picture.size
    is_deep = picture.mode.startswith("I")  # Pillow would clip, not scale, its 16 bits
    stored = np.empty((height, width, 3), np.float32 if is_deep else np.uint8)
    has_alpha = with_alpha and not is_deep and ("transparency" in picture.info or picture.mode in WITH_ALPHA)
    alpha = np.empty((height, width), np.uint8) if has_alpha else None
    try:
        for top in range(0, height, ROWS_AT_ONCE):
            rows = picture.crop((0, top, width, min(top + ROWS_AT_ONCE, height)))
            into = stored[top : top + ROWS_AT_ONCE]
            if is_deep:
                into[:] = linear_from_srgb(np.asarray(rows, np.float32)[..., None] / 65535.0)
            else:
                with_fourth = alpha is not None or "transparency" in picture.info
                values = np.asarray(rows.convert("RGBA" if with_fourth else "RGB"))
                into[:] = values[..., :3]
                if alpha is not None:
                    alpha[top : top + ROWS_AT_ONCE] = values[..., 3]
    except Exception as error:  # whatever a damaged picture provokes in a reader is the picture's fault
        raise InputError(f"a texture is cut off or damaged ({error})") from error
    made = StoredPicture(stored, alpha)
    return _shared.setdefault(made.key, made)


def unpacked_picture(data: bytes, *, with_alpha: bool) -> StoredPicture:
    """A picture file (PNG, JPEG, WebP) as a stored picture.

    Raises:
        InputError: it is of another kind, damaged, or larger than is allowed.
    """
    with no_pixel_limit():
        try:
            picture = Image.open(io.BytesIO(data))
        except Exception as error:  # whatever a damaged picture provokes in a reader is the picture's fault
            raise InputError("not a picture that can be read (PNG, JPEG or WebP)") from error
        width, height = picture.size
        budget.take(
            UNPACKED_BYTES_A_PIXEL * width * height, f"a texture of {width} x {height} pixels", "a smaller texture"
        )
        return stored_texture(picture, with_alpha=with_alpha)
