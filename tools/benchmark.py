"""Run time against error: layered depth textures, Warp's BVH and Embree on the same rays and the same scenes.

Everything is timed in turn in one process (A B A B ...), with compilation and a first round outside the clock; figures
are medians, with the fastest and slowest beside them in the JSON. Threads are stated with every figure.

    python tools/benchmark.py            # 10 minutes; writes tools/results/benchmark.json, .md and plots
    python tools/benchmark.py --quick    # one minute, small meshes, for the shape of the output

Real meshes are taken from LDTREFL_MESH_PATH where they are. The rays are those of a 768 x 512 camera, reflected off a
sphere beside the object; the truth is the BVH where Embree, in robust mode, agrees with it.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from pathlib import Path

import warp as wp
from benchmark_parts.common import KNOTS, REAL, ROOT, SCAN
from benchmark_parts.frames import error_against_time, error_targets, frame_stages
from benchmark_parts.meshes import rays_on_meshes
from benchmark_parts.paper import paper_tables
from benchmark_parts.report import draw_plots, reading
from benchmark_parts.threads import thread_scaling

import ldtrefl
from ldtrefl.errors import InputError
from ldtrefl.files import written_whole


def main() -> None:
    """Run all parts and write JSON, Markdown and plots."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small meshes, few rounds")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "tools" / "results", help="folder to write to")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    quick, rounds = arguments.quick, 2 if arguments.quick else 9
    names = ["knot 1 k", "knot 10 k"] if quick else [*KNOTS, *REAL, SCAN]
    result = {
        "machine": f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Warp {wp.__version__}",
        "quick": quick,
        "meshes": rays_on_meshes(names, *((192, 128) if quick else (768, 512)), rounds),
        "error_against_time": error_against_time(quick, rounds),
        "stages": frame_stages(quick, rounds),
        "error_targets": error_targets(quick, rounds),
        "scaling": thread_scaling(quick, rounds),
        "paper": paper_tables(quick, rounds),
    }
    ldtrefl.set_threads()
    for name, text in (("benchmark.json", json.dumps(result, indent=1)), ("benchmark.md", reading(result))):
        with written_whole(arguments.output / name) as scratch:
            scratch.write_text(text)
    draw_plots(result, arguments.output)
    print(f"written to {arguments.output}")


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(f"benchmark.py: {error}")
