"""Numerical stability under stress: a case a file, each against an answer that does not depend on what is tested.

    python tools/stress.py                 # half an hour; writes tools/results/stress.json and stress.md
    python tools/stress.py --only fuzz     # one case, nothing written
    python tools/stress.py --quick         # three minutes, small counts

Every search, every quality and the ray caster are held to limits that stand in the cases' files with their reasons.
Exit status 1 if one is passed. Distances are in texels of a 256 map.
"""

from __future__ import annotations

import argparse
import importlib
import json
import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from stress_cases.outcomes import Outcome, as_dict

from ldtrefl.base.errors import InputError
from ldtrefl.files.atomic_write import written_whole


@dataclass(frozen=True)
class Size:
    """How much a case tries."""

    rays: int
    pictures: int
    """Pixels along a picture's side, or a number of files, as the case says."""


CASES: dict[str, tuple[Size, Size]] = {  # name of the module -> full and quick size
    "place": (Size(3000, 96), Size(300, 32)),
    "directions": (Size(2500, 0), Size(200, 0)),
    "origins": (Size(2000, 0), Size(200, 0)),
    "meshes": (Size(4000, 0), Size(300, 0)),
    "contact": (Size(0, 192), Size(0, 64)),
    "cameras": (Size(0, 128), Size(0, 24)),
    "reflectors": (Size(0, 128), Size(0, 32)),
    "parameters": (Size(2000, 0), Size(100, 0)),
    "invariance": (Size(20_000, 96), Size(1000, 32)),
    "motion": (Size(0, 128), Size(0, 48)),
    "fuzz": (Size(10_000_000, 0), Size(100_000, 0)),
    "files": (Size(0, 10_000), Size(0, 80)),
    "kills": (Size(0, 64), Size(0, 16)),
    "bounds": (Size(0, 1), Size(0, 7)),
    "cache_files": (Size(0, 150), Size(0, 12)),
    "histories": (Size(0, 12), Size(0, 1)),
    "hostile": (Size(0, 1000), Size(0, 3)),
    "outliers": (Size(4000, 0), Size(200, 0)),
    "shadows": (Size(0, 320), Size(0, 96)),
    "edges": (Size(1_000_000, 0), Size(20_000, 0)),
    "watertight": (Size(10_000_000, 0), Size(100_000, 0)),
    "chrome": (Size(0, 256), Size(0, 64)),
}


def load(name: str) -> ModuleType:
    """The module of a case."""
    return importlib.import_module(f"stress_cases.{name}")


def table(outcomes: list[Outcome], seconds: float) -> str:
    """The outcomes in Markdown: a summary by case and tracer, then every row."""
    lines = ["# Stress", "", f"{len(outcomes)} rows, {sum(not o.passed for o in outcomes)} beyond their limits, "]
    lines[-1] += (
        f"{sum(o.non_finite for o in outcomes)} non-finite values, {seconds:.0f} s. Distances in texels of 256."
    )
    lines += [
        "",
        "Disagree: hits too many, too few, or elsewhere. Explained: those where float64 itself gives that answer for a "
        "ray moved aside by at most the texels under *within*; the others are defects. Misnamed: hits whose triangle, "
        "barycentrics or normal are not those of the place. p99 is of all rays that hit and should, p99.9 and worst of "
        "all but the explained.",
    ]
    lines += [
        "",
        "| case | what | by | tried | wrong hits | wrong misses | disagree | explained | within | defects | ",
    ]
    lines[-1] += "misnamed | p99 | p99.9 | worst | non-finite | SSIM | s | limit |  |"
    lines += ["|" + "---|" * 19]
    for o in outcomes:
        held, shown = "" if o.passed else "**beyond**", "" if math.isnan(o.ssim) else f"{o.ssim:.5f}"
        lines.append(
            f"| {o.case} | {o.what} | {o.by} | {o.tried} | {o.wrong_hits} | {o.wrong_misses} | {o.disagree} | "
            f"{o.explained} | {o.radius:g} | {o.defects} | {o.misnamed} | {o.p99:.3g} | {o.p999:.3g} | {o.worst:.3g} | "
            f"{o.non_finite} | {shown} | {o.seconds:.1f} | {o.limit} | {held} |"
        )
    return "\n".join(lines) + "\n"


def main() -> int:
    """Run the cases and write the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small counts")
    parser.add_argument("--only", choices=CASES, action="append", help="this case alone; may be repeated")
    folder = Path(__file__).parent / "results"
    parser.add_argument("-o", "--output", type=Path, default=folder, help="folder to write to")
    arguments = parser.parse_args()
    outcomes: list[Outcome] = []
    begin = time.perf_counter()
    for name in arguments.only or CASES:
        size = CASES[name][arguments.quick]
        start = time.perf_counter()
        made = load(name).run(size.rays, size.pictures)
        failed = [o for o in made if not o.passed]
        seconds = time.perf_counter() - start
        tried = sum(o.tried for o in made)
        print(f"{made[0].case}: {len(made)} rows, {tried} tried, {len(failed)} beyond, {seconds:.0f} s")
        for o in failed:
            wrong = f"{o.wrong_hits} + {o.wrong_misses} wrong, {o.disagree} disagree, p99.9 {o.p999:.3g}, "
            wrong += f"worst {o.worst:.3g}, {o.defects} defects, {o.misnamed} misnamed"
            print(f"    {o.what}, {o.by}: {wrong}")
        sys.stdout.flush()
        outcomes += made
    if not arguments.only:
        arguments.output.mkdir(parents=True, exist_ok=True)
        report = json.dumps([as_dict(o) for o in outcomes], indent=1)
        for path, text in (("stress.json", report), ("stress.md", table(outcomes, time.perf_counter() - begin))):
            with written_whole(arguments.output / path) as scratch:
                scratch.write_text(text)
    return 1 if any(not o.passed for o in outcomes) else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except InputError as error:
        sys.exit(f"stress.py: {error}")
