"""The README's commands and code are those that run here, and it lists every shape, method and skip."""

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
    """The newcomer's first picture shows a statue in a mirror ball, clips nothing, and gives no warning."""
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


def test_readme_lists_every_skip() -> None:
    readme = (ROOT / "README.md").read_text()
    assert all(f"| `{name}` |" in readme for name in skips.names())
