"""The page that compares all methods: pictures, differences, a wipe between any two, and figures, scene by scene.

    python tools/comparison.py                 # some minutes; writes tools/results/comparison/index.html
    python tools/comparison.py --scenes teapot,paper/kettle --methods ldt,fermat -o FOLDER     # seconds

The page is one file, and needs nothing beside it. What it says of each method, when to choose it and what it fails at,
is taken from the method's own file. Scenes are those of ``scenes/`` and ``scenes/paper/``. Those whose meshes are not
in LDTREFL_MESH_PATH are left out by name.
"""

from __future__ import annotations

import argparse
import gc
import sys
import time
from pathlib import Path

import warp as wp
from benchmark_parts import cores
from comparison_parts.entries import entries
from comparison_parts.measuring import SceneOutcome, compared, fitted
from comparison_parts.page import Circumstances, page

import ldtrefl
from ldtrefl.base.errors import InputError, unknown_name
from ldtrefl.cli.options import parsed_size
from ldtrefl.device.launch import thread_count
from ldtrefl.files.atomic_write import written_whole

ROOT = Path(__file__).parent.parent
SCENES = ROOT / "scenes"
RESULTS = ROOT / "tools" / "results" / "comparison"


def scene_names() -> list[str]:
    """All scenes of the page: ``teapot``, ``paper/kettle``."""
    paths = [*sorted(SCENES.glob("*.toml")), *sorted((SCENES / "paper").glob("*.toml"))]
    return [str(path.relative_to(SCENES).with_suffix("")) for path in paths]


def _arguments() -> argparse.Namespace:
    def names(text: str) -> list[str]:
        return [name.strip() for name in text.split(",") if name.strip()]

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=names, help="with commas between; default: all")
    parser.add_argument("--methods", type=names, default=[], help="with commas between; default: all")
    parser.add_argument("--size", default="288x192", help="WxH, into which each picture is fitted; default: 288x192")
    parser.add_argument("-o", "--output", type=Path, help="folder to write to; default of a full run: " + str(RESULTS))
    given = parser.parse_args()
    if given.output is None:
        if given.scenes or given.methods:
            parser.error("only a full run writes into tools/results: say where with -o")
        given.output = RESULTS
    return given


def main() -> None:
    """Render all that is wanted, and write the page."""
    given, begun = _arguments(), time.perf_counter()
    size, methods = parsed_size(given.size), entries(given.methods)
    assert size is not None
    outcomes: list[SceneOutcome] = []
    missing: list[str] = []
    for name in given.scenes or scene_names():
        if name not in scene_names():
            raise unknown_name("scene", name, scene_names())
        start = time.perf_counter()
        try:
            scene = fitted(ldtrefl.load_scene(SCENES / f"{name}.toml"), size)
        except InputError as error:
            if "LDTREFL_MESH_PATH" not in str(error):
                raise
            missing.append(f"{name}, whose meshes are not in LDTREFL_MESH_PATH")
            print(f"left out: {missing[-1]}", file=sys.stderr)
            continue
        gc.collect()
        gc.freeze()  # all that is there: else it would be searched for garbage before each measurement of memory
        outcomes.append(compared(name, scene, methods))
        gc.unfreeze()
        print(f"{name}: {time.perf_counter() - start:.1f} s", flush=True)
    if not outcomes:
        raise InputError("no scene is left")
    machine = f"{cores.processor()}, Warp {wp.__version__}"
    written = page(outcomes, methods, Circumstances(machine, thread_count(), size, tuple(missing)))
    given.output.mkdir(parents=True, exist_ok=True)
    with written_whole(given.output / "index.html") as scratch:
        scratch.write_text(written, encoding="utf-8")
    spent = time.perf_counter() - begun
    print(f"{given.output / 'index.html'}: {len(written) / 1e6:.1f} MB, {len(outcomes)} scenes, in {spent:.0f} s")


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(f"comparison.py: {error}")
