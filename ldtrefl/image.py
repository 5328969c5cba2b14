"""Pictures in files: PNG (sRGB, 8 bits), EXR (linear float), and difference pictures.

In memory an image is ``(height, width, 3)`` float32, linear radiance, row 0 at the top. Files are read and written by
OpenImageIO.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from ldtrefl.errors import InputError
from ldtrefl.files import writable_folder, written_whole
from ldtrefl.native import caught_stderr

WRITABLE = (".png", ".exr")
LINEAR_FORMATS = ("openexr", "hdr")
MAX_READ_PIXELS = 1 << 28
"""Pixels that a picture which is read may have: a header that asks for more is broken or hostile."""


def srgb_from_linear(linear: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1 encoding of linear values, clipped to 0..1 first."""
    x = np.clip(linear, 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055).astype(np.float32)


def linear_from_srgb(encoded: np.ndarray) -> np.ndarray:
    """Inverse of :func:`srgb_from_linear` on 0..1."""
    x = np.asarray(encoded, np.float32)
    return np.where(x <= 0.04045, x / 12.92, np.power((x + 0.055) / 1.055, 2.4)).astype(np.float32)


def load_image(path: str | Path) -> np.ndarray:
    """Read a picture as ``(h, w, 3)`` float32, linear: EXR and HDR as they are, other formats decoded from sRGB.

    Raises:
        InputError: the file is missing, not a picture, or holds values that are not finite.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such picture")
    with caught_stderr():  # the formats' own libraries print what they find
        reader = oiio.ImageInput.open(str(path))
        if reader is None:
            oiio.geterror()
            raise InputError(f"{path}: not a picture that can be read (EXR, HDR, PNG or JPEG)")
        try:
            spec = reader.spec()
            if not 0 < spec.width * spec.height <= MAX_READ_PIXELS:
                raise InputError(f"{path}: {spec.width} x {spec.height} pixels, at most {MAX_READ_PIXELS} allowed")
            pixels = reader.read_image(oiio.FLOAT)
            linear = reader.format_name() in LINEAR_FORMATS
        finally:
            reader.close()
    if pixels is None:
        raise InputError(f"{path}: the picture is cut off or damaged")
    pixels = np.asarray(pixels, np.float32).reshape(spec.height, spec.width, -1)
    rgb = np.repeat(pixels[..., :1], 3, axis=2) if pixels.shape[2] < 3 else pixels[..., :3]
    if not np.isfinite(rgb).all():
        raise InputError(f"{path}: the picture holds values that are not finite")
    return np.ascontiguousarray(rgb if linear else linear_from_srgb(rgb))


def check_writable(path: str | Path) -> Path:
    """Refuse an output file that cannot be written, before any work is spent on it.

    Raises:
        InputError: wrong ending, a folder in its place, or a folder that is missing or closed.
    """
    path = Path(path)
    if path.suffix.lower() not in WRITABLE:
        raise InputError(f"{path}: a picture's name ends in {' or '.join(WRITABLE)}")
    if path.is_dir():
        raise InputError(f"{path}: is a folder, a file name is needed")
    folder = path.parent
    if not folder.is_dir():
        raise InputError(f"{path}: the folder {folder} does not exist")
    try:
        writable_folder(folder)
    except InputError as error:
        raise error.within(str(path)) from None
    return path


def save_image(path: str | Path, image: np.ndarray) -> None:
    """Write linear ``(h, w, 3)`` radiance as PNG (encoded to sRGB, clipped) or EXR (linear float32).

    Raises:
        InputError: the path cannot be written, or the image is not ``(h, w, 3)``.
    """
    path = check_writable(path)
    image = np.asarray(image, np.float32)
    if image.ndim != 3 or image.shape[2] != 3 or image.size == 0:
        raise InputError(f"{path}: an image is (height, width, 3), got {image.shape}")
    if path.suffix.lower() == ".png":
        pixels = np.round(srgb_from_linear(image) * 255.0).astype(np.uint8)
        spec = oiio.ImageSpec(image.shape[1], image.shape[0], 3, oiio.UINT8)
        spec.attribute("oiio:ColorSpace", "sRGB")
    else:
        pixels = np.ascontiguousarray(image)
        spec = oiio.ImageSpec(image.shape[1], image.shape[0], 3, oiio.FLOAT)
        spec.attribute("oiio:ColorSpace", "linear")
    with written_whole(path) as scratch:
        writer = oiio.ImageOutput.create(str(scratch))
        if not (writer and writer.open(str(scratch), spec) and writer.write_image(pixels) and writer.close()):
            raise InputError(f"{path}: could not be written ({oiio.geterror() or 'disk full?'})")


def difference_image(image: np.ndarray, reference: np.ndarray, gain: float = 4.0) -> np.ndarray:
    """The signed difference as a picture: grey where equal, red where ``image`` is brighter, blue where darker.

    Differences are taken of luminance (Rec. 709) of the sRGB-encoded images, times ``gain``. Returns linear radiance.
    """
    weights = np.array([0.2126, 0.7152, 0.0722], np.float32)
    delta = gain * ((srgb_from_linear(image) - srgb_from_linear(reference)) @ weights)
    encoded = np.full((*delta.shape, 3), 0.5, np.float32)
    encoded[..., 0] += 0.5 * np.clip(delta, -1, 1)
    encoded[..., 1] -= 0.5 * np.clip(np.abs(delta), 0, 1)
    encoded[..., 2] -= 0.5 * np.clip(delta, -1, 1)
    return linear_from_srgb(np.clip(encoded, 0, 1))
