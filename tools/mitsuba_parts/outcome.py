"""What comparisons are asked on the command line, and how they write what they found."""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Iterable, Sequence
from pathlib import Path

from ldtrefl.files.atomic_write import written_whole

RESULTS = Path(__file__).parent.parent / "results"
"""Where full runs write to, if nothing else is said."""


def arguments(description: str | None, scenes: Iterable[str], quick: str) -> argparse.Namespace:
    """``only``, a list of names, or None; ``quick``; ``output``, a folder, or None to write on the screen.

    Args:
        description: what the tool does.
        scenes: the names that ``--only`` may have, of scenes or of parts.
        quick: what ``--quick`` makes.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help=quick)
    parser.add_argument("--only", choices=list(scenes), action="append", help="this one alone; may be repeated")
    parser.add_argument("-o", "--output", type=Path, help="folder to write to; default of a full run: tools/results")
    given = parser.parse_args()
    if given.output is None and not (given.quick or given.only):
        given.output = RESULTS
    return given


def write_report(folder: Path | None, name: str, page: str, rows: Sequence[object]) -> None:
    """Write a page, ``name``.md, and its rows, dataclasses, ``name``.json; without a folder the page alone, on the
    screen."""
    if folder is None:
        print(page)
        return
    folder.mkdir(parents=True, exist_ok=True)
    figures = json.dumps([dataclasses.asdict(row) for row in rows], indent=1)  # type: ignore[call-overload]
    for ending, text in (("json", figures), ("md", page)):
        with written_whole(folder / f"{name}.{ending}") as scratch:
            scratch.write_text(text)
