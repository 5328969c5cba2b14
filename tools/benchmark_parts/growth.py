"""The memory that work takes: what a process grows by, and the most it grows by meanwhile."""

from __future__ import annotations

import ctypes
import gc
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from .result import Memory

SECONDS = 300.0
"""After which a process is given up."""


def growth_of(make: Callable[[], object]) -> Memory:
    """What this process grows by when ``make`` is called, while what it returns is kept.

    Whatever is made for the first time brings code and pools with it: make something small of its kind before.
    """
    give_back()
    Path("/proc/self/clear_refs").write_text("5")  # the peak counts from now
    before = _status("VmRSS")
    made = make()
    found: Memory = {"kept": max(_status("VmRSS") - before, 0), "peak": max(_status("VmHWM") - before, 0)}
    del made
    return found


def give_back() -> None:
    """Give the system back what is free, so that it does not count as kept."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)


def growth_in_own_process(module: str, *arguments: str) -> Memory:
    """What a module of this folder prints as JSON on its last line, in a process of its own."""
    command = [sys.executable, "-m", f"benchmark_parts.{module}", *arguments]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=SECONDS, check=True)
    found: Memory = json.loads(done.stdout.splitlines()[-1])
    return found


def _status(key: str) -> int:
    """Bytes of a line of this process's status."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith(f"{key}:"))
