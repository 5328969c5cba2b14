"""The README's commands are those that run here."""

from pathlib import Path

from ldtrefl import shapes
from ldtrefl.methods import all_methods

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
