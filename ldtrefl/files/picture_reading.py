"""Pictures read from files of any kind that OpenImageIO knows: EXR, HDR, PNG, JPEG, TIFF and others.

In memory an image is ``(height, width, 3)`` float32, linear radiance, row 0 at the top. A file is read a few rows at a
time, so that no second copy of it is ever held.

Textures and environments are kept as *stored pictures* (``stored_picture.py``). Pictures of 8 bits stay as they are,
sRGB, 3 bytes a pixel. All others become linear floats, 12 bytes a pixel.

What the numbers in a file mean:

- Floats are linear and integers are encoded as sRGB, unless the file itself says the opposite (PNG's ``gAMA`` of 1,
  TIFF's and EXR's colour space). Other gammas and profiles count as sRGB, as in glTF.
- Colours are not multiplied by alpha, and alpha is left out. (EXR files hold multiplied colours, which stay so.)
- Of an EXR the channels R, G and B are taken, from its first part and the first layer that has them. If none has, Y or
  else the first channel is taken as grey.
- A picture is not turned: a camera's note that it should be (EXIF orientation) is not followed.
- Negative values stay.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from PIL import Image

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.base.standard_error import caught_stderr
from ldtrefl.files.pillow_limit import no_pixel_limit
from ldtrefl.files.srgb import linear_from_srgb, linear_of_bytes
from ldtrefl.files.stored_picture import StoredPicture

BYTES_AT_ONCE = 32 << 20
"""Bytes of a picture that are read or written at a time: some rows of the largest picture."""

OPENED_BY_HEADER = (
    *(b"v/1\x01", b"\x89PNG", b"#?", b"II*\0", b"MM\0*", b"II+\0", b"MM\0+", b"BM"),
    *(b"P1", b"P2", b"P3", b"P4", b"P5", b"P6", b"PF", b"Pf"),
)
"""First bytes of the formats (EXR, PNG, HDR, TIFF, BMP, PNM) of which OpenImageIO reads only the header on opening."""

UNPACKED_BYTES_A_PIXEL = {"JPEG2000": 12}
"""Bytes a pixel that OpenImageIO may take to unpack a file of another format on opening, by Pillow's name of the
format."""

USUAL_UNPACKED_BYTES_A_PIXEL = 4
"""The same for formats that are not listed."""


def _opening_options() -> oiio.ImageSpec:
    """How files are opened: colours not multiplied by alpha. Made for each file, as OpenImageIO reports objects that a
    module keeps as lost when the program ends."""
    options = oiio.ImageSpec()
    options.attribute("oiio:UnassociatedAlpha", 1)
    return options


def load_image(path: str | Path) -> np.ndarray:
    """Read a picture as ``(h, w, 3)`` float32, linear. The array is the caller's own.

    Raises:
        InputError: the file is missing, not a picture, larger than allowed, or holds values that are not finite.
    """
    stored = _read(Path(path))
    if stored.dtype != np.uint8:
        return stored
    _take_memory(f"{path}: as floats a", stored.shape[1], stored.shape[0], np.float32)
    return linear_of_bytes()[stored]


def stored_picture(path: str | Path) -> StoredPicture:
    """Read a picture as it is stored.

    While anybody holds the result, later calls return the same object, unless the file has changed.

    Raises:
        InputError: as :func:`load_image`.
    """
    path = Path(path)
    try:
        status = path.stat()
    except (OSError, ValueError):
        return StoredPicture(_read(path))
    key = (str(path.resolve()), status.st_mtime_ns, status.st_size)
    picture = _shared.get(key)
    if picture is None:
        picture = _shared[key] = StoredPicture(_read(path))
    return picture


_shared: weakref.WeakValueDictionary[tuple[str, int, int], StoredPicture] = weakref.WeakValueDictionary()
"""(path, time of the last change in ns, bytes) of a file -> its stored picture, while anybody holds it."""


def _read(path: Path) -> np.ndarray:
    """The pixels of a stored picture; what it raises is said in :func:`load_image`."""
    if not path.is_file():
        raise InputError(f"{path}: no such picture")
    _take_memory_for_opening(path)
    with caught_stderr():  # the formats' own libraries print what they find
        try:
            reader = oiio.ImageInput.open(str(path), _opening_options())
            if reader is None:
                oiio.geterror()
                raise _unreadable(path)
            try:
                return _read_colors(reader, path)
            finally:
                reader.close()
        except UnicodeDecodeError as error:  # a damaged name, or a message about one
            raise _unreadable(path) from error


def _take_memory_for_opening(path: Path) -> None:
    """Ask for the memory that opening a file may take: files of some formats are unpacked then.

    Raises:
        InputError: it is more than is allowed, or the file is of no format whose size can be told.
    """
    try:
        with path.open("rb") as file:
            if file.read(4).startswith(OPENED_BY_HEADER):
                return
        with no_pixel_limit(), Image.open(path) as picture:
            kind, (width, height) = str(picture.format), picture.size
    except Exception as error:  # whatever a damaged file provokes in a reader is the file's fault
        raise _unreadable(path) from error
    needed = width * height * UNPACKED_BYTES_A_PIXEL.get(kind, USUAL_UNPACKED_BYTES_A_PIXEL)
    budget.take(needed, f"{path}: unpacking {width} x {height} pixels", "a smaller picture")


def _unreadable(path: Path) -> InputError:
    return InputError(f"{path}: not a picture that can be read (EXR, HDR, PNG or JPEG)")


def _read_colors(reader: oiio.ImageInput, path: Path) -> np.ndarray:
    """The three colour channels of an open file, as a stored picture's pixels."""
    spec = reader.spec()
    if spec.deep or spec.depth > 1 or min(spec.width, spec.height, spec.nchannels) < 1:
        raise InputError(f"{path}: a flat picture is needed, not {spec.width} x {spec.height} x {spec.depth} pixels")
    is_linear = _is_linear(spec)
    dtype = np.uint8 if spec.format == oiio.UINT8 and not is_linear else np.float32
    _take_memory(f"{path}: a", spec.width, spec.height, dtype)
    channels = _color_channels([name.lower() for name in spec.channelnames])
    first, end = min(channels), max(channels) + 1
    picture = np.empty((spec.height, spec.width, 3), dtype)
    for top, rows in read_rows(reader, first, end, oiio.UINT8 if dtype is np.uint8 else oiio.FLOAT):
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


def _take_memory(what: str, width: int, height: int, dtype: type[np.uint8] | type[np.float32]) -> None:
    """Ask for the memory of an array ``(height, width, 3)``."""
    needed = width * height * 3 * np.dtype(dtype).itemsize
    budget.take(needed, f"{what} picture of {width} x {height} pixels", "a smaller picture")


def _is_linear(spec: oiio.ImageSpec) -> bool:
    """Whether a file's numbers are linear: floats are, integers are not, unless it says so itself."""
    space = spec.get_string_attribute("oiio:ColorSpace").lower()
    if spec.format in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE):
        return not space.startswith("srgb")
    return space.startswith("lin")


def _color_channels(names: list[str]) -> tuple[int, ...]:
    """The numbers of red, green and blue, or of one grey channel, from the channels' names in small letters."""
    layers = [name.removesuffix("r") for name in names if name == "r" or name.endswith(".r")]
    for layer in sorted(layers, key=bool):  # the one without a name first
        if {layer + "g", layer + "b"} <= set(names):
            return tuple(names.index(layer + color) for color in "rgb")
    if "y" in names or len(names) < 3:
        return (names.index("y") if "y" in names else 0,)
    return 0, 1, 2


def read_rows(
    reader: oiio.ImageInput, first: int, end: int, kind: oiio.BASETYPE
) -> Iterator[tuple[int, np.ndarray | None]]:
    """Read channels ``first`` to ``end - 1`` of an open file as values of ``kind``, some rows at a time from the top.

    Yields:
        (number of the first row, ``(rows, width, channels)``); None in place of rows that cannot be read.
    """
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
