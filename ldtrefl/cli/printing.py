"""What commands print on standard output."""

from __future__ import annotations

import functools
import sys

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ldtrefl.base.errors import printable
from ldtrefl.frame.result import Frame

PIPE_WIDTH = 200
"""Columns for tables where standard output is no terminal, which would say how wide it is."""


class ReaderGone(Exception):
    """Nobody reads standard output any more."""


class _Console(Console):
    def on_broken_pipe(self) -> None:
        """Rich calls this where the reader has gone; its own method ends the process with status 1."""
        _console.cache_clear()  # this one holds what could not be written
        raise ReaderGone


@functools.cache
def _console(width: int | None) -> _Console:
    return _Console(highlight=False, markup=False, emoji=False, soft_wrap=True, width=width)


def say(*parts: str | Text | Table) -> None:
    """Print a line, or a table.

    Text is printed as it is: names come from files, and may look like rich's markup or hold what a terminal would obey.
    Lines are not broken.
    """
    console = _console(None if sys.stdout.isatty() else PIPE_WIDTH)
    console.print(*(printable(part) if isinstance(part, str) else part for part in parts))


def stage_times(frame: Frame) -> str:
    """The seconds of a frame's stages, in words."""
    return ", ".join(f"{name} {seconds:.3f}" for name, seconds in frame.stats.seconds.items())
