"""Pictures written to files: PNG and EXR by OpenImageIO, JPEG and WebP by Pillow."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from PIL import Image

from ldtrefl.base.errors import InputError
from ldtrefl.files.atomic_write import replaceable, writable_folder, written_whole
from ldtrefl.files.picture_format import JPEG, LOSSY, QUALITY, WRITABLE, PictureFormat
from ldtrefl.files.tone_mapping import ToneMapping
from ldtrefl.files.verified_rows import blocks, write_verified

LONGEST_SIDES = {".webp": 16383, ".jpg": 65535, ".jpeg": 65535}
"""Pixels along a side that a format can hold, by the ending of the file's name."""


def check_writable(path: str | Path) -> Path:
    """``path``, if a picture can be written there: asked before any work is spent on it.

    Raises:
        InputError: wrong ending; a folder, a pipe, a device or a protected file in its place; or a folder that is
            missing or closed.
    """
    path = Path(path)
    if path.suffix.lower() not in WRITABLE:
        raise InputError(f"{path}: a picture's name ends in {', '.join(WRITABLE[:-1])} or {WRITABLE[-1]}")
    folder = replaceable(path).parent
    if not folder.is_dir():
        raise InputError(f"{path}: the folder {folder} does not exist")
    try:
        writable_folder(folder)
    except InputError as error:
        raise error.within(str(path)) from None
    return path


def save_image(
    path: str | Path,
    image: np.ndarray,
    *,
    exposure: float = 0.0,
    tone_mapping: ToneMapping = "none",
    bits: int = 8,
    quality: int | None = None,
    dither: bool | None = None,
) -> None:
    """Write linear radiance as PNG, JPEG or WebP (what a display shows, encoded to sRGB) or EXR (float32, as it is).

    Args:
        path: where. The ending of its name says what is written.
        image: ``(h, w, 3)``, row 0 at the top; or ``(h, w, 4)`` with alpha in the last channel, by which the others are
            multiplied, such as ``Frame.cutout``. A JPEG cannot hold alpha.
        exposure: stops; each shows everything twice as bright.
        tone_mapping: "none" (cut off at 1), "agx" (as Blender 4) or "aces" (ACES 1.3).
        bits: of a channel of a PNG, 8 or 16.
        quality: of JPEG and WebP, 1 to 100, 92 if not given. A WebP of 100 loses nothing.
        dither: whether a PNG's values are dithered, or rounded. If not given, those of 8-bit tone-mapped pictures are
            dithered.

    Raises:
        InputError: the path cannot be written, the image is of another shape, or an option is not allowed or does not
            go with the file's ending.
    """
    path = check_writable(path)
    options = {"exposure": exposure, "tone_mapping": tone_mapping, "bits": bits, "quality": quality, "dither": dither}
    chosen, ending = PictureFormat.checked(path, **options), path.suffix.lower()
    image = np.asarray(image, np.float32)
    if image.ndim != 3 or image.shape[2] not in (3, 4) or image.size == 0:
        raise InputError(f"{path}: an image is (height, width, 3 or 4), got {image.shape}")
    if ending in JPEG and image.shape[2] == 4:
        raise InputError(f"{path}: a JPEG cannot be transparent, PNG, WebP and EXR can")
    if max(image.shape[:2]) > LONGEST_SIDES.get(ending, max(image.shape)):
        raise InputError(f"{path}: has {max(image.shape[:2])} pixels along a side, at most {LONGEST_SIDES[ending]} fit")
    if ending == ".exr":
        write_verified(path, _spec(image, oiio.FLOAT), lambda top, bottom: image[top:bottom])
    elif ending in LOSSY:
        data = _compressed(path, image, chosen)
        with written_whole(path) as scratch:
            scratch.write_bytes(data)
    else:
        spec = _spec(image, oiio.UINT8 if chosen.bits == 8 else oiio.UINT16)
        write_verified(path, spec, lambda top, bottom: chosen.encoded(image[top:bottom], top))


def _spec(image: np.ndarray, kind: oiio.BASETYPE) -> oiio.ImageSpec:
    """What OpenImageIO is told of a file."""
    height, width, channels = image.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    spec.attribute("oiio:ColorSpace", "linear" if kind == oiio.FLOAT else "sRGB")
    if channels == 4 and kind != oiio.FLOAT:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    return spec


def _compressed(path: Path, image: np.ndarray, chosen: PictureFormat) -> bytes:
    """The bytes of a JPEG or a WebP. Colours are as sharp as brightness: mirrors show edges between colours."""
    parts = [chosen.encoded(image[top:bottom]) for top, bottom in blocks(len(image), image[0].nbytes)]
    data, quality = io.BytesIO(), QUALITY if chosen.quality is None else chosen.quality
    picture = Image.fromarray(np.concatenate(parts))
    try:
        if path.suffix.lower() in JPEG:
            picture.save(data, "JPEG", quality=quality, subsampling=0)
        else:
            picture.save(data, "WEBP", quality=quality, lossless=quality == 100)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: could not be written ({error})") from error
    return data.getvalue()
