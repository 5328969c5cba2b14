"""The stress test's cases (``tools/stress.py``) with small counts, each held to its own limits."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from stress import CASES, load
from stress_cases.judge import EXACT, Truth, judge, rays_about

import ldtrefl
from ldtrefl import shapes

IN_THIS_PROCESS = [name for name in CASES if name not in ("files", "kills")]


@pytest.mark.parametrize("name", IN_THIS_PROCESS)
def test_case_keeps_its_limits(name: str) -> None:
    size = CASES[name][1]
    outcomes = load(name).run(size.rays, size.pictures)
    beyond = [f"{o.what}, {o.by}: {o}" for o in outcomes if not o.passed]
    assert outcomes and not beyond, beyond[0]
    assert sum(o.non_finite for o in outcomes) == 0


def test_files_and_kills_keep_their_limits() -> None:
    """These fork, so they get a process of their own, in which no threads run."""
    tool = Path(__file__).parent.parent / "tools" / "stress.py"
    command = [sys.executable, str(tool), "--quick", "--only", "files", "--only", "kills"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_defect_is_found() -> None:
    """The judge must see a tracer that loses one triangle, moves another, and answers NaN once."""
    mesh = shapes.make("torus_knot", {"segments": [32, 8]})
    origins, directions = rays_about(mesh, 500, 1)
    truth = Truth(mesh)
    true_t = truth.hits(origins, directions)
    hits = ldtrefl.peel(mesh.vertices, mesh.faces).trace(origins, directions)
    assert judge(truth, origins, directions, true_t, hits, EXACT).passed
    first, second, third = np.flatnonzero(np.isfinite(true_t))[[5, 50, 100]]
    for ray, value in ((first, np.inf), (second, 0.9 * hits.t[second]), (third, np.nan)):
        t, triangle = hits.t.copy(), hits.triangle.copy()
        t[ray], triangle[ray] = value, -1 if value == np.inf else triangle[ray]
        wrong = ldtrefl.Hits(t, hits.normal, triangle, hits.barycentrics, hits.invalid)
        assert not judge(truth, origins, directions, true_t, wrong, EXACT).passed
