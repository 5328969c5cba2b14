"""Case 17: small inputs that ask for much, or that are not what they seem, each given to the program in a process.

Every trial must end with the status that stands beside it, in time, with little memory, with at most one line on
standard error, and with no file left behind. Memory is that of the whole process, half a GiB of which is the program.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from .outcomes import Outcome

NAME = "17 hostile inputs"
SECONDS = 20
"""Five that the program promises, its start, and a margin for a machine that does other things, too."""
MEMORY = 1 << 30
"""What a refusal may take: half a GiB for the program, a largest scene file's 300 MiB, and room."""

SCENE = """
[camera]
eye = [0.0, -5.0, 1.0]
look_at = [0.0, 0.0, 0.0]
width = 24
height = 16

[[object]]
name = "NAME"
shape = "sphere"
params = { segments = [16, 8] }
[object.material]
mirror = [0.9, 0.9, 0.9]

[[object]]
shape = "torus"
params = { segments = [16, 8] }
translate = [1.5, -1.5, 0.0]
"""


@dataclass(frozen=True)
class Trial:
    """One command."""

    what: str
    words: str
    """Words of the shell after the program's name."""
    status: int = 2
    scene: str = SCENE
    """What ``case.toml`` holds."""


def run(rays: int, pictures: int) -> list[Outcome]:
    """``rays`` is not used; all trials, or one for each of ``pictures`` pixels."""
    outcomes = []
    for kind, trials in (("scene files", scenes()), ("shapes", shapes()), ("commands", commands())):
        step = max(1, len(trials) // pictures)
        outcome = Outcome(NAME, kind, "command line")
        outcome.limit = (
            f"the status that is right, at most one line, < {MEMORY >> 20} MiB, <= {SECONDS} s, nothing left"
        )
        slowest, largest = 0.0, 0
        for trial in trials[::step]:
            fault, seconds, memory = attempt(trial)
            slowest, largest = max(slowest, seconds), max(largest, memory)
            outcome.tried += 1
            outcome.seconds += seconds
            if fault:
                outcome.defects += 1
                print(f"{trial.what}: {fault}")
        outcome.what += f" (slowest {slowest:.1f} s, {largest >> 20} MiB)"
        outcome.passed = outcome.defects == 0
        outcomes.append(outcome)
    return outcomes


def scenes() -> list[Trial]:
    """Texts that are too much for a reader of TOML, or for what reads the values."""
    render = "render case.toml"

    def with_line(what: str, line: str, status: int = 2) -> Trial:
        return Trial(what, render, status, SCENE.replace("width = 24", f"width = 24\n{line}"))

    one_object = SCENE[SCENE.index("[[object]]") :]
    return [
        with_line("50,000 dots in a key", "a." * 50_000 + "a = 1"),
        with_line("50,000 dots in a table", "[" + "a." * 50_000 + "a]"),
        with_line("50,000 dots between quotes", ".".join(['"a"'] * 50_000) + " = 1"),
        with_line("3,000 brackets", "fov_y = " + "[" * 3000),
        with_line("100,000 brackets", "fov_y = " + "[" * 100_000 + "]" * 100_000),
        with_line("30,000 braces", "fov_y = " + "{ a = " * 30_000),
        with_line("5,000 digits", "fov_y = " + "1" * 5000),
        with_line("a million digits", "fov_y = " + "1" * 1_000_000),
        with_line("a million hexadecimal digits", "fov_y = 0x" + "f" * 1_000_000),
        with_line("a million digits behind a point", "fov_y = 1." + "1" * 1_000_000),
        with_line("100,000 keys", "\n".join(f"k{i} = 1" for i in range(100_000))),
        with_line("a million numbers", "fov_y = [" + "1," * 1_000_000 + "]"),
        with_line("brackets in a comment", "# " + "[" * 100_000, 0),
        with_line("a long string", 'fov_y = "' + "[" * 100_000 + '"'),
        with_line("a string without end", 'fov_y = """' + "[" * 100_000),
        with_line("fov_y 1e-300", "fov_y = 1e-300"),
        Trial("4 MiB of objects", render, 0, SCENE + one_object * 17_000),
        Trial("10 MiB of comments", render, 2, SCENE + "#\n" * (5 << 20)),
        Trial("10,000 lights", render, 2, SCENE + '[[light]]\nkind = "point"\n' * 10_000),
        Trial("scale 1e-300", render, 2, SCENE + "scale = 1e-300\n"),
        Trial("fit times scale", render, 2, SCENE + "fit = 1e-10\nscale = 1e-10\n"),
        Trial(
            "a direction of 1e38", render, 2, SCENE + '[[light]]\nkind="directional"\nradiance=1\ndirection=[1e38,0,0]'
        ),
        Trial("NUL", render, 2, SCENE + "\0"),
        Trial("UTF-16", render, 2, SCENE.encode("utf-16-le").decode("latin-1")),
    ]


def shapes() -> list[Trial]:
    """Parameters within their limits that would take tens of gigabytes."""

    def of(shape: str, params: str) -> Trial:
        changed = SCENE.replace('"torus"\nparams = { segments = [16, 8] }', f'"{shape}"\nparams = {{ {params} }}')
        return Trial(f"{shape} {params}", "render case.toml", 2, changed)

    many = "".join(
        f'[[object]]\nshape = "torus_knot"\nparams = {{ segments = [1000, {100 + i}] }}\n' for i in range(200)
    )
    return [
        of("torus_knot", "segments = [8192, 8192]"),
        of("torus", "segments = [8192, 8192]"),
        of("sphere", "segments = [8192, 4096]"),
        of("bowl", "segments = [8192, 4096]"),
        *(of(name, "segments = 4096") for name in ("plane", "box", "room", "hollow_box", "teapot")),
        of("wires", "count = 256, segments = 8192"),
        of("gyroid", "periods = 8.0, grid = 400"),
        of("genus3", "grid = 99999999"),
        of("box", "segments = 9" + "0" * 90),
        Trial("200 knots that add up", "info case.toml --memory 300M", 2, SCENE + many),
    ]


def commands() -> list[Trial]:
    """Streams, paths and names that are not what they seem."""
    tricky = SCENE.replace("NAME", "chair [/old] [red] :smile: \\u001b[2J")
    return [
        Trial("names like markup", "info case.toml", 0, tricky),
        Trial("names like markup, rendered", "render case.toml", 0, tricky),
        Trial("closed output", "info case.toml >&-", 0),
        Trial("all streams closed", "render case.toml >&- 2>&- <&-", 0),
        Trial("full output", "info case.toml >/dev/full", 1),
        Trial("full output of a list", "methods >/dev/full", 1),
        Trial("full error", "render none.toml 2>/dev/full", 2),
        Trial("a reader that is gone", "methods | true", 0),
        Trial("a pipe as scene", "render pipe.toml", 2),
        Trial("a pipe as mesh", "info pipe.ply", 2),
        Trial("a device as scene", "render /dev/zero", 2),
        Trial("a folder as scene", "render .", 2),
        Trial("3,000 brackets in --set", f"render case.toml --set resolution={'[' * 3000}", 2),
        Trial("5,000 digits in --set", f"render case.toml --set resolution={'1' * 5000}", 2),
        Trial("dots in --set", f"render case.toml --set 'resolution={{{'a.' * 9000}a=1}}'", 2),
        Trial("--memory of no size", "render case.toml --memory lots", 2),
        Trial("--memory of many digits", f"render case.toml --memory {'9' * 5000}", 2),
        Trial("too little memory", "render case.toml --memory 1K", 2),
    ]


WATCHER = """
import resource, subprocess, sys
status = subprocess.call(["bash", "-o", "pipefail", "-c", sys.argv[1]])
with open(sys.argv[2], "w") as file:
    print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss << 10, file=file)
sys.exit(status)
"""
"""Runs a command of the shell and writes the bytes it took. It is small: a process counts its parent's memory."""


def attempt(trial: Trial) -> tuple[str, float, int]:
    """(what is wrong, seconds, bytes) of a trial in a folder of its own."""
    with tempfile.TemporaryDirectory() as name, tempfile.NamedTemporaryFile("r") as measured:
        folder = Path(name)
        (folder / "case.toml").write_text(trial.scene)
        for pipe in ("pipe.toml", "pipe.ply"):
            os.mkfifo(folder / pipe)
        before = {path.name for path in folder.iterdir()}
        words = f"{sys.executable} -m ldtrefl {trial.words}"
        start = time.perf_counter()
        with subprocess.Popen(
            [sys.executable, "-S", "-c", WATCHER, words, measured.name],
            cwd=folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=True,
        ) as child:
            try:
                _, text = child.communicate(timeout=SECONDS)
            except subprocess.TimeoutExpired:
                os.killpg(child.pid, signal.SIGKILL)
                _, text = child.communicate()
        seconds, memory = time.perf_counter() - start, int(measured.read() or 0)
        left = {path.name for path in folder.iterdir()} - before - ({"case.png"} if trial.status == 0 else set())
    fault = ""
    if child.returncode != trial.status:
        fault = f"status {child.returncode}, right is {trial.status}: {text.strip()[-200:]}"
    elif len(text.splitlines()) > 1 or "Traceback" in text:
        fault = f"{len(text.splitlines())} lines on error: {text.strip()[-200:]}"
    elif left:
        fault = f"left {sorted(left)} behind"
    elif memory > MEMORY:
        fault = f"{memory >> 20} MiB"
    return fault, seconds, memory
