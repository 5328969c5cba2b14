"""How long the command line takes from process to picture, with kernels compiled and without."""

from __future__ import annotations

import functools
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

from timing import summary, timed_in_turn

from ldtrefl.base.errors import InputError

from .checkout_frames import environment_of
from .frame_scenes import TEAPOT
from .result import StartRow

CACHES = {"WARP_CACHE_PATH": "kernels", "XDG_CACHE_HOME": "caches"}
"""Variables that name folders of caches, and their folders here: kernels, and maps that are kept."""


def starts(checkouts: Mapping[str, Path], rounds: int, quick: bool) -> list[StartRow]:
    """Renders of the teapot by each checkout, in turn: the first with empty caches, then ``rounds`` that use them.

    A quick run shares the caches of this user, and compiles nothing.
    """
    with tempfile.TemporaryDirectory() as folder:
        jobs = {
            label: functools.partial(_render, checkout, None if quick else Path(folder) / label)
            for label, checkout in checkouts.items()
        }
        rows: list[StartRow] = []
        if not quick:
            first = {label: summary([1000.0 * job()]) for label, job in jobs.items()}
            rows.append({"what": "empty caches, kernels are compiled", "checkouts": first})
        rows.append({"what": "kernels compiled before", "checkouts": timed_in_turn(jobs, rounds)})
    return rows


def _render(checkout: Path, caches: Path | None) -> float:
    """Seconds of a process that renders the teapot.

    Raises:
        InputError: it cannot.
    """
    environment = environment_of(checkout.resolve())
    if caches is not None:
        environment |= {variable: str(caches / inner) for variable, inner in CACHES.items()}
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "ldtrefl", "render", str(TEAPOT), "-o", f"{folder}/teapot.png"]
        start = time.perf_counter()
        done = subprocess.run(command, env=environment, cwd=checkout, capture_output=True, text=True, check=False)
        seconds = time.perf_counter() - start
    if done.returncode:
        raise InputError(f"{checkout} does not render: {(done.stderr.strip().splitlines() or ['no word'])[-1]}")
    return seconds
