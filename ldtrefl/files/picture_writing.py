"""Pictures written to files: PNG (sRGB, 8 bits) and EXR (linear float32), by OpenImageIO."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import xxhash

from ldtrefl.base.errors import InputError
from ldtrefl.base.standard_error import caught_stderr
from ldtrefl.files.atomic_write import replaceable, writable_folder, written_whole
from ldtrefl.files.picture_reading import BYTES_AT_ONCE, read_rows
from ldtrefl.files.srgb import srgb_from_linear

WRITABLE = (".png", ".exr")
"""Endings of the names of pictures that can be written."""


def check_writable(path: str | Path) -> Path:
    """``path``, if a picture can be written there: asked before any work is spent on it.

    Raises:
        InputError: wrong ending; a folder, a pipe, a device or a protected file in its place; or a folder that is
            missing or closed.
    """
    path = Path(path)
    if path.suffix.lower() not in WRITABLE:
        raise InputError(f"{path}: a picture's name ends in {' or '.join(WRITABLE)}")
    folder = replaceable(path).parent
    if not folder.is_dir():
        raise InputError(f"{path}: the folder {folder} does not exist")
    try:
        writable_folder(folder)
    except InputError as error:
        raise error.within(str(path)) from None
    return path


def save_image(path: str | Path, image: np.ndarray) -> None:
    """Write linear ``(h, w, 3)`` radiance, row 0 at the top, as PNG (encoded to sRGB, clipped) or EXR (float32).

    The file is read back and compared: the libraries that write do not notice every full disk.

    Raises:
        InputError: the path cannot be written, or the image is not ``(h, w, 3)``.
    """
    path = check_writable(path)
    image = np.asarray(image, np.float32)
    if image.ndim != 3 or image.shape[2] != 3 or image.size == 0:
        raise InputError(f"{path}: an image is (height, width, 3), got {image.shape}")
    is_png = path.suffix.lower() == ".png"
    with written_whole(path) as scratch, caught_stderr():
        digest = _write(scratch, image, is_png)
        if digest is None or digest != _digest_of_file(scratch, image.shape, is_png):
            raise InputError(f"{path}: could not be written ({oiio.geterror() or 'is the disk full?'})")


def _encode(rows: np.ndarray, is_png: bool) -> np.ndarray:
    """Rows of an image as the file holds them."""
    return np.round(srgb_from_linear(rows) * 255.0).astype(np.uint8) if is_png else np.ascontiguousarray(rows)


def _write(path: Path, image: np.ndarray, is_png: bool) -> bytes | None:
    """Write a file: a hash of the pixels that it should hold, None if the writer has reported a fault."""
    height, width, channels = image.shape
    spec = oiio.ImageSpec(width, height, channels, oiio.UINT8 if is_png else oiio.FLOAT)
    spec.attribute("oiio:ColorSpace", "sRGB" if is_png else "linear")
    writer = oiio.ImageOutput.create(str(path))
    if not (writer and writer.open(str(path), spec)):
        return None
    digest = xxhash.xxh3_128()
    is_good = True
    step = max(1, BYTES_AT_ONCE // image[0].nbytes)
    for top in range(0, height, step):
        rows = _encode(image[top : top + step], is_png)
        digest.update(rows.data)
        is_good = is_good and writer.write_scanlines(top, top + len(rows), 0, rows)
    return digest.digest() if writer.close() and is_good else None


def _digest_of_file(path: Path, shape: tuple[int, ...], is_png: bool) -> bytes | None:
    """The same hash of the pixels that a file does hold, None if it is not an image of this shape."""
    reader = oiio.ImageInput.open(str(path))
    if reader is None:
        return None
    try:
        spec = reader.spec()
        if (spec.height, spec.width, spec.nchannels) != shape:
            return None
        digest = xxhash.xxh3_128()
        for _, rows in read_rows(reader, 0, 3, oiio.UINT8 if is_png else oiio.FLOAT):
            if rows is None:
                return None
            digest.update(np.ascontiguousarray(rows).data)
        return digest.digest()
    finally:
        reader.close()
