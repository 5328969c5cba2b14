"""Rows of pixels written by OpenImageIO, then read back and compared: the libraries that write do not notice every full
disk."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import xxhash

from ldtrefl.base.errors import InputError
from ldtrefl.base.standard_error import caught_stderr
from ldtrefl.files.atomic_write import written_whole
from ldtrefl.files.picture_reading import read_rows

BYTES_AT_ONCE = 8 << 20
"""Bytes of radiance that are worked on at a time: to develop it takes ten times as much."""

Rows = Callable[[int, int], np.ndarray]
"""``rows(top, bottom)``: the (bottom - top, width, channels) pixels of some rows, as the file holds them."""


def write_verified(path: str | Path, spec: oiio.ImageSpec, rows: Rows) -> None:
    """Write a file, some rows at a time, whole or not at all.

    Raises:
        InputError: it cannot be written, or does not hold what it should.
    """
    with written_whole(path) as scratch, caught_stderr():
        digest = _write(scratch, spec, rows)
        if digest is None or digest != _digest_of_file(scratch, spec):
            raise InputError(f"{path}: could not be written ({oiio.geterror() or 'is the disk full?'})")


def blocks(height: int, row_bytes: int) -> Iterator[tuple[int, int]]:
    """(first row, row after the last) of parts of a picture that are worked on at a time, from the top."""
    step = max(1, BYTES_AT_ONCE // row_bytes)
    return ((top, min(top + step, height)) for top in range(0, height, step))


def _write(path: Path, spec: oiio.ImageSpec, rows: Rows) -> bytes | None:
    """Write a file: a hash of the pixels that it should hold, None if the writer has reported a fault."""
    writer = oiio.ImageOutput.create(str(path))
    if not (writer and writer.open(str(path), spec)):
        return None
    digest = xxhash.xxh3_128()
    is_good = True
    for top, bottom in blocks(spec.height, 4 * spec.width * spec.nchannels):
        block = np.ascontiguousarray(rows(top, bottom))
        digest.update(block.data)
        is_good = is_good and writer.write_scanlines(top, bottom, 0, block)
    return digest.digest() if writer.close() and is_good else None


def _digest_of_file(path: Path, spec: oiio.ImageSpec) -> bytes | None:
    """The same hash of the pixels that a file does hold, None if its image is another one's."""
    options = oiio.ImageSpec()
    options.attribute("oiio:UnassociatedAlpha", 1)
    reader = oiio.ImageInput.open(str(path), options)
    if reader is None:
        return None
    try:
        found = reader.spec()
        if (found.height, found.width) != (spec.height, spec.width):
            return None
        if sorted(found.channelnames) != sorted(spec.channelnames):
            return None
        order = [found.channelnames.index(name) for name in spec.channelnames]
        digest = xxhash.xxh3_128()
        for _, rows in read_rows(reader, 0, len(order), spec.format):
            if rows is None:
                return None
            digest.update(np.ascontiguousarray(rows[..., order]).data)
        return digest.digest()
    finally:
        reader.close()
