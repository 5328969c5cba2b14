"""What the benchmark measures with: its rays, its judge, its ratios; never a time."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmark_parts import ratios, report, rivals, tables
from benchmark_parts.models import model
from benchmark_parts.rays import KINDS, RAYS, Rays, enters, kinds_of, second_bounce
from benchmark_parts.result import RaysRow
from benchmark_parts.rivals import Embreex, Rival, available
from benchmark_parts.truth import EDGE, Model, errors_of, truth

ROOT = Path(__file__).parent.parent.parent
FEW = 2000
"""Rays of a kind."""


def rays_of(name: str) -> dict[str, Rays]:
    mesh = model(name)
    assert mesh is not None
    Embreex.load()
    scene = Embreex(mesh.vertices, mesh.faces)
    return {rays.kind: rays for rays in kinds_of(mesh, lambda o, d: scene.hits(Rays("", o, d)), FEW)}


def test_kinds_of_rays_are_what_they_say() -> None:
    mesh = model("knot 10 k")
    assert mesh is not None
    kinds = rays_of("knot 10 k")
    scene = Embreex(mesh.vertices, mesh.faces)
    hits = {kind: float((scene.hits(rays)[1] >= 0).mean()) for kind, rays in kinds.items()}
    assert 0.1 < hits["mirror, few hits"] < 0.3 < hits["mirror, many hits"] < 0.8
    assert enters(mesh.box, kinds["mirror, many hits"].origins, kinds["mirror, many hits"].directions).all()
    assert set(kinds) == set(KINDS) - {"close-up"}
    assert {kind for kind, rays in kinds.items() if rays.any_hit} == {"shadow", "random, any hit"}
    for kind, rays in kinds.items():
        assert rays.origins.dtype == rays.directions.dtype == np.float32
        assert np.allclose(np.linalg.norm(rays.directions, axis=1), 1.0, atol=1e-6)
        assert 0.4 * FEW < len(rays.origins) < 1.3 * FEW, kind


def test_mirror_rays_of_few_hits_are_those_of_earlier_reports() -> None:
    rays = next(rays for rays in kinds_of_sphere() if rays.kind == "mirror, few hits")
    assert len(rays.origins) == 101_148  # of a picture of 768 by 512


def kinds_of_sphere() -> list[Rays]:
    mesh = model("sphere")
    assert mesh is not None
    return list(kinds_of(mesh, lambda o, d: (np.full(len(o), np.inf), np.full(len(o), -1)), RAYS))


def test_an_outlier_changes_no_ray() -> None:
    without = rays_of("knot 1 k")
    for kind, rays in rays_of("knot 1 k outlier 1e3").items():
        if kind not in ("second bounce", "shadow"):
            assert np.array_equal(rays.origins, without[kind].origins), kind


def test_no_ray_starts_on_an_outlier() -> None:
    mesh = model("knot 1 k outlier 1e1")
    assert mesh is not None
    corners = mesh.vertices[mesh.faces[-1]]
    there = np.ones(1), np.array([len(mesh.faces) - 1])
    towards = np.zeros((1, 3), np.float32), corners.mean(axis=0)[None]
    assert len(second_bounce(mesh, lambda o, d: there, *towards)[0]) == 0


def two_sheets() -> Model:
    """Squares of two triangles each, at z = 0 and z = 1."""
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], np.float32)
    vertices = np.concatenate([np.column_stack([square, np.full(4, z, np.float32)]) for z in (0, 1)])
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], np.int32)
    return Model("", vertices, faces, np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]]))


def downwards(*places: tuple[float, float]) -> Rays:
    origins = np.array([(x, y, 3.0) for x, y in places], np.float32)
    return Rays("", origins, np.tile(np.array([[0, 0, -1]], np.float32), (len(origins), 1)))


def test_truth_is_the_first_triangle_that_is_met() -> None:
    """Whoever is alone with it, and whatever the others say; a triangle that is beside the ray is no hit."""
    rays = downwards((0.5, -0.5), (0.5, -0.5), (2.0, 0.0), (0.5, -0.5))
    right = truth(
        two_sheets(),
        rays,
        [
            (np.array([2.0, 3.0, np.inf, 3.0]), np.array([2, 0, -1, 0])),
            (np.array([2.0, 3.0, 2.0, 3.0]), np.array([2, 0, 2, 0])),
            (np.array([2.0, 2.0, np.inf, np.inf]), np.array([2, 2, -1, -1])),
        ],
    )
    assert right.triangle.tolist() == [2, 2, -1, 0]
    assert right.t.tolist() == [2.0, 2.0, np.inf, 3.0]
    assert right.sure.all()


@pytest.mark.parametrize("outside, sure", [(0.25, False), (-0.25, False), (2.0, True), (-2.0, True)])
def test_rays_within_rounding_of_an_edge_are_judged_by_nobody(outside: float, sure: bool) -> None:
    """``outside`` times ``EDGE`` beyond the square's right edge; farther off there is a right answer."""
    mesh = two_sheets()
    mesh.vertices[:, 0] -= np.float32(1.0)  # the right edge at x = 0, where float32 is fine enough
    rays = downwards((outside * EDGE, -0.5))
    right = truth(mesh, rays, [(np.array([2.0]), np.array([2])), (np.array([np.inf]), np.array([-1]))])
    assert bool(right.sure[0]) is sure
    assert int(right.triangle[0]) == (-1 if outside > 1.0 else 2)


def test_errors_are_percent_of_true_hits_and_texels() -> None:
    rays = downwards(*[(0.5, -0.5)] * 4, (2.0, 0.0))
    hit, miss = (2.0, 2), (np.inf, -1)
    true = [hit] * 4 + [miss]
    right = truth(two_sheets(), rays, [tuple(map(np.array, zip(*true, strict=True)))])  # type: ignore[list-item]
    answer = [hit, (2.0 + 1 / 64, 3), miss, hit, hit]
    wrong = errors_of(tuple(map(np.array, zip(*answer, strict=True))), right)  # type: ignore[arg-type]
    assert (wrong["wrong_hits"], wrong["wrong_misses"]) == (25.0, 25.0)
    assert wrong["p999"] == pytest.approx(1.0, rel=0.01)
    rounded = 2.0 * (1.0 + 2e-7), 2
    assert errors_of(tuple(map(np.array, zip(*[rounded] * 5, strict=True))), right)["p999"] == 0.0  # type: ignore[arg-type]
    assert wrong["same_triangle"] == pytest.approx(200 / 3)


def row(mesh: str, **milliseconds: float) -> RaysRow:
    """Two kinds of 1,000 rays, the second twice as slow, and an any-hit one; a tracer's times."""
    kinds = {}
    for i, kind in enumerate(("one", "two", "any")):
        times = {tracer: {"median": (i + 1) * time} for tracer, time in milliseconds.items()}
        forms = {"numpy": {}, "kernel": times}
        kinds[kind] = {"rays": 1000, "any_hit": kind == "any", "milliseconds": {"1": forms}}
    return {"mesh": mesh, "triangles": 1, "kinds": kinds}


def test_ratios_are_of_the_times_that_they_name() -> None:
    base, larger, outlier = "knot 96 k", "knot 2 M", "knot 96 k outlier 1e3"
    rows = [row(base, ldt=2.0, bvh=5.0), row(larger, ldt=3.0, bvh=2.0), row(outlier, ldt=8.0)]
    summary = [entry for entry in ratios.rival_over_ours(rows, ["bvh"], "1") if entry["form"] == "kernel"]
    assert summary[0]["over"]["bvh"] == {"closest": 2.5, "least": 2.5, "any_hit": 2.5}
    assert ratios.larger_over_smaller(rows, ["ldt"], "1")["kernel"]["ldt"]["two"] == pytest.approx(1.5)
    assert ratios.with_outlier_over_without(rows, ["ldt"], "1") == [
        {"mesh": "knot 96 k outlier 1e3", "form": "kernel", "tracer": "ldt", "median": 4.0, "worst": 4.0}
    ]
    assert len(ratios.slower_than_bvh(rows, ["1"])) == 3


def test_fastest_rounds_take_the_medians_place() -> None:
    timed = {"rows": [{"ldt": {"median": 2.0, "min": 1.0, "max": 3.0}}], "other": 5}
    assert report.of_fastest(timed) == {"rows": [{"ldt": {"median": 1.0, "min": 1.0, "max": 3.0}}], "other": 5}


def test_a_rival_that_does_not_start_is_named_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    class Absent(Rival):
        name = "absent"

        @classmethod
        def load(cls) -> None:
            raise ImportError("No module named 'absent'\nmore")

    monkeypatch.setattr(rivals, "RIVALS", (Absent, Embreex))
    found, notes = available(["absent", "embreex"])
    assert found == [Embreex]
    assert notes == ["absent: cannot run here: ImportError: No module named 'absent'"]


def test_tables_have_a_cell_for_every_column() -> None:
    lines = tables.table(["a", "b"], [["1", "2"], ["3", "-"]])
    assert lines == ["| a | b |", "|---|---|", "| 1 | 2 |", "| 3 | - |", ""]


def test_benchmark_writes_what_it_promises(tmp_path: Path) -> None:
    """A quick run: the shape of the output, never the times."""
    command = [sys.executable, str(ROOT / "tools" / "benchmark.py"), "--quick", "-o", str(tmp_path)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    kinds = ("error_against_time", "time_against_triangles", "build_against_triangles", "bytes_against_triangles")
    plots = {f"{kind}.png" for kind in kinds}
    assert {path.name for path in tmp_path.iterdir()} == plots | {"benchmark.json", "benchmark.md"}
    result = json.loads((tmp_path / "benchmark.json").read_text())
    parts = {"rays", "build", "memory", "error_against_time", "stages", "error_targets", "scaling", "paper"}
    parts |= {"rival_frames", "start"}
    assert {"machine", "threads", "tracers", "notes"} | parts <= set(result)
    assert all(result[part] for part in parts)
    for row in result["rays"]:
        assert len(row["kinds"]) >= 8
        for kind in row["kinds"].values():
            wrong = kind["errors"]["ldt exact"]
            assert wrong["wrong_hits"] + wrong["wrong_misses"] <= 0.01
            assert {"median", "min", "max"} <= set(kind["milliseconds"]["1"]["kernel"]["bvh"])
    memory = {point["curve"]: point["memory"] for point in result["error_against_time"] if point["memory"]}
    assert set(memory) == {"ldt balanced", "planar"}  # the others' takes too long for a quick run
    assert all(0 < entry["kept"] <= entry["peak"] for entry in memory.values())
    report = (tmp_path / "benchmark.md").read_text()
    assert all(row["mesh"] in report for row in result["rays"])
    assert all(note in report for note in result["notes"])
