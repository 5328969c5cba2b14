"""Pillow's own limit of the sizes of pictures, out of the way: the memory allowed is the limit here."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from PIL import Image


@dataclass
class _Limit:
    """The limit is the whole process's: however many threads lift it, it is put aside once."""

    lock: threading.Lock = field(default_factory=threading.Lock)
    blocks: int = 0
    """Threads' blocks of :func:`no_pixel_limit` that are open."""
    usual: int | None = None
    """Pillow's limit while there are any."""


_limit = _Limit()


@contextmanager
def no_pixel_limit() -> Iterator[None]:
    """Pillow opens pictures of any size inside this block: here the memory allowed is the limit (``budget.py``).

    Pillow warns of large pictures, and refuses larger ones. Readers of meshes take those for missing ones.
    """
    with _limit.lock:
        if not _limit.blocks:
            _limit.usual = Image.MAX_IMAGE_PIXELS
        _limit.blocks += 1
        Image.MAX_IMAGE_PIXELS = None
    try:
        yield
    finally:
        with _limit.lock:
            _limit.blocks -= 1
            if not _limit.blocks:
                Image.MAX_IMAGE_PIXELS = _limit.usual
