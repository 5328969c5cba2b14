"""A progress bar for what takes long."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from ldtrefl.device.progress import progress_to

SHOWN_AFTER = 1.0
"""Seconds before the bar is shown."""


@contextmanager
def progress_bar() -> Iterator[None]:
    """Show on standard error how far the launches inside this block are, once the block has taken a second.

    Nothing is shown where standard error is no terminal.
    """
    if not sys.stderr.isatty():
        yield
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    progress = Progress(*columns, console=Console(stderr=True), transient=True)
    task = progress.add_task("starting", total=1.0)
    begun = time.perf_counter()

    def show(stage: str, fraction: float) -> None:
        if time.perf_counter() - begun > SHOWN_AFTER:
            progress.start()
        progress.update(task, description=stage, completed=fraction)

    try:
        with progress_to(show):
            yield
    finally:
        progress.stop()
