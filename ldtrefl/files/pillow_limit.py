"""The size of a picture by its header (Pillow), and Pillow's own limit of sizes out of the way."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from PIL import Image


@dataclass
class _Limit:
    """Pillow's own limit while nobody is inside :func:`no_pixel_limit`, and how many are."""

    lock: threading.Lock = field(default_factory=threading.Lock)
    inside: int = 0
    kept: int | None = None


_limit = _Limit()


@contextmanager
def no_pixel_limit() -> Iterator[None]:
    """Pillow opens pictures of any size inside this block: here the memory allowed is the limit (``budget.py``).

    Pillow warns of large pictures and refuses larger ones, which readers of meshes take for missing ones.
    """
    with _limit.lock:
        if not _limit.inside:
            _limit.kept = Image.MAX_IMAGE_PIXELS
        _limit.inside += 1
        Image.MAX_IMAGE_PIXELS = None
    try:
        yield
    finally:
        with _limit.lock:
            _limit.inside -= 1
            if not _limit.inside:
                Image.MAX_IMAGE_PIXELS = _limit.kept


def format_and_size(path: Path) -> tuple[str, int, int]:
    """(Pillow's name of the format, width, height) of a picture in a file that is not unpacked; an exception of any
    kind if Pillow cannot tell."""
    with no_pixel_limit(), Image.open(path) as picture:
        return str(picture.format), *picture.size
