"""Case 13: processes killed while they write; no half file is ever read as a whole one."""

from __future__ import annotations

import os
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

import ldtrefl
from ldtrefl.files.map_cache import MapCache
from ldtrefl.files.picture_reading import load_image
from ldtrefl.scene import shapes

from .outcomes import Outcome

NAME = "13 kills"
STARTING = 0.02
"""Seconds that a forked child may take before it writes."""

WRITES = 3.0
"""Times that a child could write its file before it is killed at the latest."""

LEAST_KILLS = 8
"""Of each kind of file, however small the counts."""

FOUND = 0.2
"""Share of the kills after which a file must be there: where none ever is, none is ever looked at."""


Writer = Callable[[Path], None]
"""Writes a file."""

Check = Callable[[Path], bool]
"""Reads a file, and says whether it is whole."""


def run(rays: int, pictures: int) -> list[Outcome]:
    """A kill for every two of ``pictures`` pixels, of each kind of file."""
    kills = max(LEAST_KILLS, pictures // 2)
    # Threads of a parent do not live on in its children, which would wait for them and write nothing.
    oiio.attribute("threads", 1)
    oiio.attribute("exr_threads", -1)
    ldtrefl.set_threads(1)
    generator = np.random.default_rng(13)
    outcomes = []
    with tempfile.TemporaryDirectory() as folder:
        for name, (write, is_whole) in writers(generator).items():
            outcomes.append(killed_writing(Path(folder) / name, write, is_whole, kills, generator))
    ldtrefl.set_threads()
    return outcomes


def writers(generator: np.random.Generator) -> dict[str, tuple[Writer, Check]]:
    """By the name of a file: what writes it, and what says whether it is whole."""
    image = generator.uniform(0, 1, (300, 400, 3)).astype(np.float32)
    mesh = shapes.make("torus_knot", {"segments": [96, 16]})
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, 128, search="linear")

    def write_image(path: Path) -> None:
        ldtrefl.save_image(path, image)

    def image_is_whole(path: Path) -> bool:
        return load_image(path).shape == image.shape

    def maps_are_whole(path: Path) -> bool:
        return ldtrefl.LayeredDepthTexture.load(path).start.numpy()[-1] == maps.fragment_count

    def store_entry(path: Path) -> None:
        arrays = {"start": maps.start.numpy(), "depth": maps.depth.numpy()}
        MapCache(path.parent).store(path.stem, arrays, {})

    def entry_is_whole(path: Path) -> bool:
        entry = MapCache(path.parent).load(path.stem)
        return entry is not None and len(entry.arrays["depth"]) == maps.fragment_count

    return {
        "picture.png": (write_image, image_is_whole),
        "picture.exr": (write_image, image_is_whole),
        "maps.npz": (maps.save, maps_are_whole),
        "cache.ldtmaps": (store_entry, entry_is_whole),
    }


def killed_writing(path: Path, write: Writer, is_whole: Check, kills: int, generator: np.random.Generator) -> Outcome:
    """Kill a child ``kills`` times at random moments while it writes one file over and over, and look at the file."""
    start = time.perf_counter()
    write(path)
    seconds = time.perf_counter() - start
    outcome = Outcome(NAME, path.name, "writer", limit=f"whole or absent; there in >= {100 * FOUND:g}%")
    absent = 0
    for _ in range(kills):
        path.unlink(missing_ok=True)
        child = forked_writer(path, write)
        # While it writes for the first time, or over what it has written before.
        time.sleep(float(generator.uniform(0.0, STARTING + WRITES * seconds)))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        outcome.tried += 1
        if not path.exists():
            absent += 1
        elif not is_whole(path):
            outcome.defects += 1
    outcome.what += f" ({absent} absent)"
    outcome.passed = outcome.defects == 0 and outcome.tried - absent >= FOUND * outcome.tried
    outcome.seconds = time.perf_counter() - start
    return outcome


def forked_writer(path: Path, write: Writer) -> int:
    """The process number of a child that writes a file until it is killed."""
    child = os.fork()
    if child == 0:
        try:
            while True:
                write(path)
        finally:
            os._exit(1)
    return child
