"""Who wants to know how far the launches of a thread are, and in which stage of a frame that thread is."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Observer = Callable[[str, float], None]
"""Called with the name of the stage, and how far its present launch is, from 0 to 1."""


class _Watch(threading.local):
    """One for each thread."""

    observer: Observer | None = None
    stage: str = ""


_watch = _Watch()


@contextmanager
def progress_to(observer: Observer) -> Iterator[None]:
    """Report the launches of this thread to ``observer(stage, fraction of the launch)`` inside this block."""
    before, _watch.observer = _watch.observer, observer
    try:
        yield
    finally:
        _watch.observer = before


@contextmanager
def in_stage(name: str) -> Iterator[None]:
    """Report the launches of this thread as parts of stage ``name`` inside this block."""
    outer, _watch.stage = _watch.stage, name
    try:
        report(0.0)
        yield
    finally:
        _watch.stage = outer


def is_watched() -> bool:
    """Whether anyone wants to know of this thread's launches."""
    return _watch.observer is not None


def report(fraction: float) -> None:
    """Say how far the present launch of this thread is, from 0 to 1, if anyone wants to know."""
    if _watch.observer is not None:
        _watch.observer(_watch.stage, fraction)
