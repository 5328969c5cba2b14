"""Standard error: what native libraries print there past Python is filtered, and what the package logs is printed."""

from __future__ import annotations

import atexit
import fcntl
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

PIECE_BYTES = 1 << 16
"""Of what was caught, read at a time."""

PIPE_BYTES = 4096
"""What a pipe takes in one write, whoever else writes (Linux's ``PIPE_BUF``)."""


class _Catching:
    """Standard error put aside in a file. The descriptor is the whole process's: it is put aside once, however many
    threads are inside a block.

    The file stays open from block to block, as a thread may be in the middle of a write to it when standard error is
    put back. What arrives so late is printed after a later block, or at the end of the process.
    """

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.blocks = 0  # threads' blocks that are open
        self.usual = -1  # a duplicate of the usual descriptor; -1 if nothing is caught
        self.file = -1  # descriptor of the file that stands in for it; -1 before the first block
        self.printed = 0  # bytes of that file that are dealt with

    def begin(self) -> None:
        """Enter a block; the first one puts standard error aside."""
        self.blocks += 1
        if self.blocks > 1:
            return
        usual = -1
        try:
            usual = os.dup(STDERR)
            if self.file < 0:
                self.file, self.printed = _scratch_file(), 0
                # Every write goes to the end, whoever else writes.
                fcntl.fcntl(self.file, fcntl.F_SETFL, fcntl.fcntl(self.file, fcntl.F_GETFL) | os.O_APPEND)
            os.dup2(self.file, STDERR)
        except OSError:
            # Standard error is closed, or there is no room for a file: nothing is caught, nothing is changed.
            if usual >= 0:
                os.close(usual)
            return
        self.usual = usual

    def end(self) -> None:
        """Leave a block; the last one puts standard error back and prints what others than libraries wrote."""
        self.blocks -= 1
        if self.blocks or self.usual < 0:
            return
        # Most of it first, so that it stands before what threads print as soon as standard error is back.
        self.print_caught(self.usual)
        os.dup2(self.usual, STDERR)
        os.close(self.usual)
        self.usual = -1
        self.print_caught()

    def print_caught(self, descriptor: int = STDERR) -> None:
        """Print what was caught and has not been printed, but for ``CHATTER``, to a descriptor."""
        if self.file < 0 or (descriptor == STDERR and self.usual >= 0):
            return
        caught = b""
        while piece := os.pread(self.file, PIECE_BYTES, self.printed + len(caught)):
            caught += piece
        self.printed += len(caught)
        # In short pieces of whole lines: a pipe takes each in one, whatever another thread writes meanwhile.
        text = b""
        with suppress(OSError):
            for line in [*CHATTER.sub(b"", caught).splitlines(keepends=True), b""]:
                if not line or len(text) + len(line) > PIPE_BYTES:
                    while text:
                        text = text[os.write(descriptor, text) :]
                text += line

    def after_fork_in_child(self) -> None:
        """Forget all blocks: their threads do not exist here, and the parent prints what was caught."""
        if self.usual >= 0:
            os.dup2(self.usual, STDERR)
            os.close(self.usual)
        if self.file >= 0:
            os.close(self.file)
        self.blocks, self.usual, self.file, self.printed = 0, -1, -1, 0
        self.lock.release()


_catching = _Catching()
atexit.register(_catching.print_caught)
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
