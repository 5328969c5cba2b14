"""Standard error: what native libraries print there past Python is filtered, and what the package logs is printed."""

from __future__ import annotations

import logging
import os
import re
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

CHATTER = re.compile(
    b"(?:"
    b"libpng (?:error|warning):"  # of a damaged PNG, which is refused in a line of our own
    b"|Failed to add object file:"  # LLVM, of a damaged kernel cache: likewise
    b"|Warp CUDA warning: Could not find or load the NVIDIA CUDA driver"  # no news on a machine without a GPU
    b")[^\n]*\n?"
)
"""What native libraries print and nobody needs to see, up to the end of the line. It need not be at the line's
beginning: another thread may have begun that."""

STDERR = 2
"""The file descriptor of standard error."""


class _Catching:
    """Standard error put aside in a file. The descriptor is the whole process's: it is put aside once, however many
    threads are inside a block."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.blocks = 0  # threads' blocks that are open
        self.usual = -1  # a duplicate of the usual descriptor; -1 if nothing is caught
        self.caught = -1  # of the file that stands in for it meanwhile

    def begin(self) -> None:
        """Enter a block; the first one puts standard error aside."""
        self.blocks += 1
        if self.blocks > 1:
            return
        opened: list[int] = []
        try:
            opened.append(os.dup(STDERR))
            opened.append(_scratch_file())
            os.dup2(opened[1], STDERR)
        except OSError:
            # Standard error is closed, or there is no room for a file: nothing is caught, nothing is changed.
            for descriptor in opened:
                os.close(descriptor)
            return
        self.usual, self.caught = opened

    def end(self) -> None:
        """Leave a block; the last one puts standard error back and prints what others than libraries wrote."""
        self.blocks -= 1
        if self.blocks or self.usual < 0:
            return
        os.dup2(self.usual, STDERR)
        size = os.lseek(self.caught, 0, os.SEEK_END)
        os.lseek(self.caught, 0, os.SEEK_SET)
        with open(self.caught, "rb") as file:
            caught = file.read(size)
        os.close(self.usual)
        self.usual = self.caught = -1
        # What else was printed meanwhile, by other threads, belongs where it was meant to go.
        rest = CHATTER.sub(b"", caught)
        with suppress(OSError):
            while rest:
                rest = rest[os.write(STDERR, rest) :]

    def after_fork_in_child(self) -> None:
        """Forget all blocks: their threads do not exist here, and the parent prints what was caught."""
        if self.usual >= 0:
            os.dup2(self.usual, STDERR)
            os.close(self.usual)
            os.close(self.caught)
        self.blocks, self.usual, self.caught = 0, -1, -1
        self.lock.release()


_catching = _Catching()
# No thread is in the middle of begin or end while another forks.
os.register_at_fork(
    before=_catching.lock.acquire,
    after_in_parent=_catching.lock.release,
    after_in_child=_catching.after_fork_in_child,
)


@contextmanager
def caught_stderr() -> Iterator[None]:
    """Drop the ``CHATTER`` that native libraries print on standard error inside this block.

    Any number of threads may be inside at once, and blocks may stand in one another. All else that is printed
    meanwhile, by whichever thread, is printed when the last block ends. Nothing is caught where standard error is
    closed.
    """
    with _catching.lock:
        _catching.begin()
    try:
        yield
    finally:
        with _catching.lock:
            _catching.end()


def _scratch_file() -> int:
    """The descriptor of a new file without a name."""
    if hasattr(os, "memfd_create"):
        return os.memfd_create("ldtrefl-stderr")
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


class _StderrHandler(logging.Handler):
    """Writes to what ``sys.stderr`` is at that moment, so that a progress bar that has taken it over stays whole."""

    def emit(self, record: logging.LogRecord) -> None:
        with suppress(AttributeError, OSError, ValueError):
            sys.stderr.write(f"ldtrefl: {record.getMessage()}\n")
            sys.stderr.flush()


@contextmanager
def log_on_stderr() -> Iterator[None]:
    """Print what the package logs, notices included, inside this block: for the command line.

    Without it a program sees notices only if it sets logging up for ``logging.getLogger("ldtrefl")``.
    """
    log, handler = logging.getLogger("ldtrefl"), _StderrHandler()
    level = log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(level)
