"""Meshes of very different sizes in one: float64 decides what is right."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from stress_cases import outliers
from stress_cases.outcomes import Outcome
from stress_cases.truth import brute_force

import ldtrefl
from ldtrefl.ldt.exact import build


def test_an_outlier_changes_no_answer_and_a_wrong_one_is_found() -> None:
    """The stress test's case with few rays, and its judge with a hit that is missing, moved, and too many."""
    outcomes = outliers.run(400, 0)
    assert len(outcomes) == 3 * (3 * 6 * 2 + 1)
    assert all(o.passed for o in outcomes), [o for o in outcomes if not o.passed]
    mesh = outliers.with_outlier("beside", 1e4)
    origins, directions = outliers.rays_to_knot(400, 2.0, 1)
    true_t, _ = brute_force(mesh, origins, directions)
    hits = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, directions)
    hit, miss = np.flatnonzero(np.isfinite(true_t))[0], np.flatnonzero(np.isinf(true_t))[0]
    for ray, t, triangle in ((hit, np.inf, -1), (hit, 1.001 * true_t[hit], 0), (miss, 1.0, 0)):
        changed = dataclasses.replace(hits, t=hits.t.copy(), triangle=hits.triangle.copy())
        changed.t[ray], changed.triangle[ray] = t, triangle
        assert not outliers.judge_outlier(Outcome(), mesh, changed, true_t, origins, directions).passed


def test_doubted_hits_come_to_an_end() -> None:
    """Past a patch's back a search goes on by the horizon; where that is less than t's rounding, it must end too."""
    program = """
import numpy as np, ldtrefl
from ldtrefl.scene import shapes
knot = shapes.make("torus_knot", {"segments": [2000, 125]})
maps = ldtrefl.peel(knot.vertices, knot.faces)
assert maps.tree.patches and maps.tree.view.front != 0.0
maps.tree.view.horizon = 0.0
rng = np.random.default_rng(0)
inside = knot.vertices[rng.integers(0, len(knot.vertices), 50_000)] * 0.999
hits = maps.trace(inside, rng.normal(size=inside.shape))
print((hits.triangle >= 0).sum())
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 10_000


def test_more_triangles_than_memory_allows_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    vertices = np.random.default_rng(0).uniform(-1, 1, (3000, 3))
    monkeypatch.setattr(build, "MOST_RECORDS", 10)
    with pytest.raises(ldtrefl.InputError, match="the mesh has 1000 triangles, too many to search"):
        ldtrefl.peel(vertices, np.arange(3000).reshape(-1, 3))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e9, 1e20, 1e38, 1e90])
def test_a_bulk_too_small_to_be_seen_is_no_trouble(size: float) -> None:
    """A damaged coordinate makes the mesh's box so large that the rest of it is less than float32 has numbers for."""
    mesh = outliers.with_outlier("beside", size)
    camera = ldtrefl.Camera(eye=(0, -5, 1), look_at=(0, 0, 0), width=16, height=16)
    ball = ldtrefl.Object(shape="sphere", params={"segments": [16, 8]}, material=ldtrefl.Material(mirror=0.9))
    thing = ldtrefl.Object(mesh=mesh, fit=2.0, translate=(1.5, 0, 0))
    lit = {
        "lighting": ldtrefl.Lighting(shadows=True),
        "lights": (ldtrefl.Light(kind="point", position=(0, -3, 3), intensity=4),),
    }
    scene = ldtrefl.Scene(camera=camera, objects=(ball, thing), **lit)
    for method in ("ldt", "bvh"):
        assert np.isfinite(ldtrefl.render(scene, method).image).all()
