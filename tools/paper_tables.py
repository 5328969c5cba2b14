"""Every figure and table that the papers print with numbers, made again on this machine, their numbers beside ours.

    python tools/paper_tables.py                 # ten minutes; writes tools/results/paper_tables.json and .md
    python tools/paper_tables.py --only szabo    # a part of it, on the screen; files only where -o says
    python tools/paper_tables.py --quick         # small pictures, few rounds: a minute, on the screen

Parts: zhang (layered depth textures), roger (Fermat's principle), estalella (bisectors in the image), szabo (adaptive
tessellation), and ours (what ours adds to the last two). Models of LDTREFL_MESH_PATH are left out where they are
missing. Times are of this machine's CPU, beside those of GPUs of 2005 to 2009: what they have in common is how they
grow.
"""

from __future__ import annotations

import datetime
import sys
from collections.abc import Callable

import warp as wp
from benchmark_parts import cores
from mitsuba_parts.outcome import arguments, write_report
from paper_parts import estalella, ours, roger, szabo, zhang
from paper_parts.table import Table, markdown

from ldtrefl.base.errors import InputError
from ldtrefl.device.launch import thread_count

PARTS: dict[str, Callable[[bool], list[Table]]] = {
    "zhang": zhang.tables,
    "roger": roger.tables,
    "estalella": estalella.tables,
    "szabo": szabo.tables,
    "ours": ours.tables,
}

EXPLANATION = """\
Each table has the figures that a paper prints beside those of the same thing made here. Times are medians of frames of
this machine's CPU, with one sample of each pixel; what is compiled is left out of them.
"""


def page(found: list[Table]) -> str:
    """The report."""
    machine = f"Ours: {cores.processor()}, {thread_count()} threads, Warp {wp.__version__}."
    head = f"# The papers' tables\n\n{datetime.date.today().isoformat()}. {machine}\n\n{EXPLANATION}\n"
    return head + "\n".join(markdown(table) for table in found)


def main() -> None:
    """Make the tables that are wanted, and write the report."""
    given = arguments(__doc__, PARTS, "small pictures and few rounds")
    found: list[Table] = []
    for name in given.only or PARTS:
        found += PARTS[name](given.quick)
        print(f"{name}: done", file=sys.stderr, flush=True)
    write_report(given.output, "paper_tables", page(found), found)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(f"paper_tables.py: {error}")
