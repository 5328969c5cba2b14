"""Pictures in files: PNG (sRGB, 8 bits), EXR (linear float), and difference pictures.

In memory an image is ``(height, width, 3)`` float32, linear radiance, row 0 at the top. Files are read and written by
OpenImageIO, a few rows at a time.

A *stored* picture (``files/stored_picture.py``) is what textures and environments are kept as: pictures of 8 bits stay
as they are, sRGB, 3 bytes a pixel; all others become linear floats, 12 bytes a pixel.

What a file means by its numbers:

- Floats are linear and integers are encoded as sRGB, unless the file says the opposite of itself (PNG's ``gAMA`` of 1,
  TIFF's and EXR's colour space). Other gammas and profiles count as sRGB, as in glTF.
- Colours are not multiplied by alpha, and alpha is left out. (In EXR they are stored multiplied, and stay so.)
- Of an EXR the channels R, G and B are taken, of its first part and first layer that has them; else Y, or the first
  channel, as grey.
- A picture stands as it is stored: a camera's note to turn it (EXIF orientation) is not followed.
- Negative values stay.
"""

from __future__ import annotations

import functools
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import xxhash

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.base.standard_error import caught_stderr
from ldtrefl.files.pillow_limit import format_and_size
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.files.whole import replaceable, writable_folder, written_whole

WRITABLE = (".png", ".exr")

BYTES_AT_ONCE = 32 << 20
"""Of a picture that is read or written: some rows of the largest."""

HEADER_FIRST = (
    *(b"v/1\x01", b"\x89PNG", b"#?", b"II*\0", b"MM\0*", b"II+\0", b"MM\0+", b"BM"),
    *(b"P1", b"P2", b"P3", b"P4", b"P5", b"P6", b"PF", b"Pf"),
)
"""How files begin (EXR, PNG, HDR, TIFF, BMP, PNM) of which OpenImageIO reads the header alone when it opens them."""
UNPACKED_AT_ONCE = {"JPEG2000": 12}
"""Bytes a pixel that it takes to unpack others, which it may do when it opens them: 4 if not said here."""


def _as_stored() -> oiio.ImageSpec:
    """How pictures are opened: their colours not multiplied by alpha. Made each time: what a module keeps of
    OpenImageIO's is reported as lost when the program ends."""
    options = oiio.ImageSpec()
    options.attribute("oiio:UnassociatedAlpha", 1)
    return options


def srgb_from_linear(linear: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1 encoding of linear values, clipped to 0..1 first."""
    x = np.clip(linear, 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055).astype(np.float32)


def linear_from_srgb(encoded: np.ndarray) -> np.ndarray:
    """Inverse of :func:`srgb_from_linear` on 0..1."""
    x = np.asarray(encoded, np.float32)
    return np.where(x <= 0.04045, x / 12.92, np.power((np.maximum(x, 0.0) + 0.055) / 1.055, 2.4)).astype(np.float32)


@functools.cache
def decoded_bytes() -> np.ndarray:
    """(256,) float32: the linear value of every byte of a stored picture."""
    table = linear_from_srgb(np.arange(256, dtype=np.float32) * np.float32(1.0 / 255.0))
    table.flags.writeable = False
    return table


def load_image(path: str | Path) -> np.ndarray:
    """Read a picture as ``(h, w, 3)`` float32, linear.

    Raises:
        InputError: the file is missing, not a picture, larger than allowed, or holds values that are not finite.
    """
    stored = _read(Path(path))
    if stored.dtype != np.uint8:
        return stored
    _take(f"{path}: as floats a", stored.shape[1], stored.shape[0], np.float32)
    return decoded_bytes()[stored]


def stored_picture(path: str | Path) -> StoredPicture:
    """Read a picture as it is stored.

    A file is read once while anybody holds its picture, and again only when it has changed.

    Raises:
        InputError: as :func:`load_image`.
    """
    path = Path(path)
    try:
        status = path.stat()
    except (OSError, ValueError):
        return StoredPicture(_read(path))
    key = (str(path.resolve()), status.st_mtime_ns, status.st_size)
    picture = _pictures.get(key)
    if picture is None:
        picture = _pictures[key] = StoredPicture(_read(path))
    return picture


_pictures: weakref.WeakValueDictionary[tuple[str, int, int], StoredPicture] = weakref.WeakValueDictionary()


def _read(path: Path) -> np.ndarray:
    """A picture as it is stored, three channels."""
    if not path.is_file():
        raise InputError(f"{path}: no such picture")
    _ask_for_unpacking(path)
    with caught_stderr():  # the formats' own libraries print what they find
        try:
            reader = oiio.ImageInput.open(str(path), _as_stored())
            if reader is None:
                oiio.geterror()
                raise _unreadable(path)
            try:
                return _read_colors(reader, path)
            finally:
                reader.close()
        except UnicodeDecodeError as error:  # a damaged name, or a message about one
            raise _unreadable(path) from error


def _ask_for_unpacking(path: Path) -> None:
    """Ask for the memory that opening a file may take, if it is of a format that may be unpacked then.

    Raises:
        InputError: it is more than is allowed, or the file is of no format whose size can be told.
    """
    try:
        with path.open("rb") as file:
            if file.read(4).startswith(HEADER_FIRST):
                return
        kind, width, height = format_and_size(path)
    except Exception as error:  # whatever a damaged file provokes in a reader is the file's fault
        raise _unreadable(path) from error
    needed = width * height * UNPACKED_AT_ONCE.get(kind, 4)
    budget.take(needed, f"{path}: unpacking {width} x {height} pixels", "a smaller picture")


def _unreadable(path: Path) -> InputError:
    return InputError(f"{path}: not a picture that can be read (EXR, HDR, PNG or JPEG)")


def _read_colors(reader: Any, path: Path) -> np.ndarray:
    spec = reader.spec()
    if spec.deep or spec.depth > 1 or min(spec.width, spec.height, spec.nchannels) < 1:
        raise InputError(f"{path}: a flat picture is needed, not {spec.width} x {spec.height} x {spec.depth} pixels")
    is_linear = _is_linear(spec)
    dtype = np.uint8 if spec.format == oiio.UINT8 and not is_linear else np.float32
    _take(f"{path}: a", spec.width, spec.height, dtype)
    channels = _color_channels([name.lower() for name in spec.channelnames])
    first, end = min(channels), max(channels) + 1
    picture = np.empty((spec.height, spec.width, 3), dtype)
    for top, rows in _row_by_row(reader, first, end, oiio.UINT8 if dtype is np.uint8 else oiio.FLOAT):
        if rows is None:
            raise InputError(f"{path}: the picture is cut off or damaged")
        into = picture[top : top + len(rows)]
        for k in range(3):
            into[..., k] = rows[..., channels[k % len(channels)] - first]
        if dtype is np.float32:
            if not np.isfinite(into).all():
                raise InputError(f"{path}: the picture holds values that are not finite")
            if not is_linear:
                into[:] = linear_from_srgb(into)
    return picture


def _take(what: str, width: int, height: int, dtype: Any) -> None:
    needed = width * height * 3 * np.dtype(dtype).itemsize
    budget.take(needed, f"{what} picture of {width} x {height} pixels", "a smaller picture")


def _is_linear(spec: Any) -> bool:
    """Whether a file's numbers are linear: floats are, integers are not, unless it says so itself."""
    space = spec.get_string_attribute("oiio:ColorSpace").lower()
    if spec.format in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE):
        return not space.startswith("srgb")
    return space.startswith("lin")


def _color_channels(names: list[str]) -> tuple[int, ...]:
    """The numbers of red, green and blue, or of one channel that is grey, by the channels' names in small letters."""
    layers = [name.removesuffix("r") for name in names if name == "r" or name.endswith(".r")]
    for layer in sorted(layers, key=bool):  # the one without a name first
        if {layer + "g", layer + "b"} <= set(names):
            return tuple(names.index(layer + color) for color in "rgb")
    if "y" in names or len(names) < 3:
        return (names.index("y") if "y" in names else 0,)
    return 0, 1, 2


def _row_by_row(reader: Any, first: int, end: int, kind: Any) -> Iterator[tuple[int, np.ndarray | None]]:
    """(number of the first row, ``(rows, width, channels)``) from the top down; None for rows that cannot be read."""
    spec = reader.spec()
    height = spec.tile_height if spec.tile_width else 1
    step = height * max(1, BYTES_AT_ONCE // (4 * spec.width * (end - first) * height))
    for top in range(0, spec.height, step):
        bottom = min(top + step, spec.height)
        y0, y1 = spec.y + top, spec.y + bottom
        if spec.tile_width:
            rows = reader.read_tiles(0, 0, spec.x, spec.x + spec.width, y0, y1, spec.z, spec.z + 1, first, end, kind)
        else:
            rows = reader.read_scanlines(0, 0, y0, y1, spec.z, first, end, kind)
        yield top, None if rows is None else np.asarray(rows).reshape(bottom - top, spec.width, end - first)


def check_writable(path: str | Path) -> Path:
    """Refuse an output file that cannot be written, before any work is spent on it.

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
    """Write linear ``(h, w, 3)`` radiance as PNG (encoded to sRGB, clipped) or EXR (linear float32).

    What stands in the file is read back and compared: the libraries that write do not notice every full disk.

    Raises:
        InputError: the path cannot be written, or the image is not ``(h, w, 3)``.
    """
    path = check_writable(path)
    image = np.asarray(image, np.float32)
    if image.ndim != 3 or image.shape[2] != 3 or image.size == 0:
        raise InputError(f"{path}: an image is (height, width, 3), got {image.shape}")
    is_png = path.suffix.lower() == ".png"
    with written_whole(path) as scratch, caught_stderr():
        digest = _written(scratch, image, is_png)
        if digest is None or digest != _digest_of(scratch, image.shape, is_png):
            raise InputError(f"{path}: could not be written ({oiio.geterror() or 'is the disk full?'})")


def _encoded(rows: np.ndarray, is_png: bool) -> np.ndarray:
    """Rows of an image as they stand in the file."""
    return np.round(srgb_from_linear(rows) * 255.0).astype(np.uint8) if is_png else np.ascontiguousarray(rows)


def _written(path: Path, image: np.ndarray, is_png: bool) -> bytes | None:
    """Write a file; a hash of what should stand in it, None if something was said against it."""
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
        rows = _encoded(image[top : top + step], is_png)
        digest.update(rows.data)
        is_good = is_good and writer.write_scanlines(top, top + len(rows), 0, rows)
    return digest.digest() if writer.close() and is_good else None


def _digest_of(path: Path, shape: tuple[int, ...], is_png: bool) -> bytes | None:
    """The same hash of what does stand in a file, None if it is not an image of this shape."""
    reader = oiio.ImageInput.open(str(path))
    if reader is None:
        return None
    try:
        spec = reader.spec()
        if (spec.height, spec.width, spec.nchannels) != shape:
            return None
        digest = xxhash.xxh3_128()
        for _, rows in _row_by_row(reader, 0, 3, oiio.UINT8 if is_png else oiio.FLOAT):
            if rows is None:
                return None
            digest.update(np.ascontiguousarray(rows).data)
        return digest.digest()
    finally:
        reader.close()


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
