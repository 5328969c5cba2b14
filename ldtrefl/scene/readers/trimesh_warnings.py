"""The warnings that trimesh logs while it reads a file. Where a program has set up no logging they would be printed,
tracebacks included."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager


class _Collector(logging.Handler):
    """Collects the warnings that are logged by the thread that made it."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []
        self._thread = threading.get_ident()

    def emit(self, record: logging.LogRecord) -> None:
        if record.thread == self._thread:
            cause = record.exc_info[1] if record.exc_info else None
            self.lines.append(record.getMessage() + (f" ({cause})" if cause else ""))


@contextmanager
def trimesh_warnings() -> Iterator[list[str]]:
    """The warnings that trimesh gives in this thread inside this block, a line each."""
    log, collector = logging.getLogger("trimesh"), _Collector()
    log.addHandler(collector)
    try:
        yield collector.lines
    finally:
        log.removeHandler(collector)
