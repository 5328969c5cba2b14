"""The README's commands are those that run here, and the tools write what they promise."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import trimesh

import ldtrefl
from ldtrefl.frame import skips
from ldtrefl.methods import all_methods
from ldtrefl.scene import shapes

ROOT = Path(__file__).parent.parent


def test_ci_runs_the_readmes_test_command() -> None:
    readme, ci = (ROOT / "README.md").read_text(), (ROOT / ".ci" / "run").read_text()
    command = next(line.strip() for line in readme.splitlines() if line.endswith("bin/pytest"))
    assert command in ci.splitlines()


def test_readme_names_only_files_that_exist() -> None:
    readme = (ROOT / "README.md").read_text()
    for name in ("docs/teapot.png", "docs/layers.png", "scenes/teapot.toml"):
        assert name in readme and (ROOT / name).is_file()


def test_readme_lists_every_shape_and_method() -> None:

    readme = (ROOT / "README.md").read_text()
    assert all(f"`{name}`" in readme for name in [*shapes.names(), *all_methods()])


def block(language: str) -> str:
    """README's one block of code in this language, as it stands."""
    (found,) = re.findall(rf"```{language}\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    return found


def test_readmes_scene_is_not_burnt_white(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The newcomer's first picture: a statue, seen in a mirror ball, nothing of it clipped, nothing complained of."""
    knot = shapes.make("torus_knot")
    trimesh.Trimesh(knot.vertices, knot.faces, process=False).export(tmp_path / "statue.ply")
    (tmp_path / "scene.toml").write_text(block("toml"))
    scene = ldtrefl.load_scene(tmp_path / "scene.toml")
    frame = ldtrefl.render(scene)
    assert (frame.image >= 1.0).any(axis=2).mean() < 1e-4
    assert frame.reflector_mask.mean() > 0.1 and frame.image[frame.reflector_mask].mean() > 0.2
    assert frame.hits is not None
    seen = frame.hits.object[frame.reflector_mask] == 0
    assert 0.01 < seen.mean() < 0.5
    assert not caplog.records


def test_readmes_python_runs_as_it_stands(tmp_path: Path) -> None:
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    code = block("python") + (
        "\nassert 3.0 < truth.t[0] < 5.0 and abs(hits.t[0] - truth.t[0]) < 1e-2"
        "\nassert hits.t[1] == truth.t[1] == float('inf')"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    assert (tmp_path / "teapot.exr").is_file()


def test_benchmark_writes_what_it_promises(tmp_path: Path) -> None:
    """The shape of the output, never the times."""
    command = [sys.executable, str(ROOT / "tools" / "benchmark.py"), "--quick", "-o", str(tmp_path)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    kinds = ("error_against_time", "time_against_triangles", "build_against_triangles", "bytes_against_triangles")
    plots = {f"{kind}.png" for kind in kinds}
    assert {path.name for path in tmp_path.iterdir()} == plots | {"benchmark.json", "benchmark.md"}
    result = json.loads((tmp_path / "benchmark.json").read_text())
    parts = {"rays", "build", "memory", "error_against_time", "stages", "error_targets", "scaling", "paper"}
    assert {"machine", "threads", "tracers", "notes"} | parts <= set(result)
    assert all(result[part] for part in parts)
    for row in result["rays"]:
        assert len(row["kinds"]) >= 8
        for kind in row["kinds"].values():
            wrong = kind["errors"]["ldt exact"]
            assert wrong["wrong_hits"] + wrong["wrong_misses"] <= 0.01
            assert {"median", "min", "max"} <= set(kind["milliseconds"]["1"]["kernel"]["bvh"])
    report = (tmp_path / "benchmark.md").read_text()
    assert all(row["mesh"] in report for row in result["rays"])
    assert all(note in report for note in result["notes"])


def test_ablation_writes_what_it_promises(tmp_path: Path) -> None:
    """Its shape, and that no skip changes a picture."""
    command = [sys.executable, str(ROOT / "tools" / "ablation.py"), "--quick", "-o", str(tmp_path)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "ablation.json").read_text())
    assert {row["skip"] for row in result["skips"]} == set(skips.names())
    assert all(row["same"] for row in result["skips"])
    assert result["culling"] and all(row["handed"] > 0 for row in result["culling"])
    assert all(row["lost"]["safe"] == 0 for row in result["culling"])
    assert all(row["handed"] <= 1.5 * row["entering"] for row in result["culling"])


def test_readme_lists_every_skip() -> None:
    readme = (ROOT / "README.md").read_text()
    assert all(f"| `{name}` |" in readme for name in skips.names())
