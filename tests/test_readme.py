"""README, docs/ and their kin: what they show runs as it stands, and what they name exists."""

import fnmatch
import inspect
import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

import ldtrefl
from ldtrefl.cli import commands as command_files
from ldtrefl.cli.program import main
from ldtrefl.frame.skip_options import skip_names
from ldtrefl.methods import all_methods
from ldtrefl.scene import shapes
from tests import documents
from tests.documents import PAGES, ROOT, Block

Complaints = Callable[[], list[str]]

SCENE_REFERENCE = ROOT / "docs" / "scenes.md"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the files that pages speak of."""
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    knot = shapes.make("torus_knot")
    trimesh.Trimesh(knot.vertices, knot.faces, process=False).export(tmp_path / "statue.ply")
    ldtrefl.save_image(tmp_path / "wood.png", np.full((4, 4, 3), 0.5, np.float32))
    return tmp_path


@pytest.fixture
def complaints(folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Complaints:
    """Says what has been printed on standard error; code of pages runs in ``folder``."""
    monkeypatch.chdir(folder)
    capfd.readouterr()

    def lines() -> list[str]:
        said = capfd.readouterr().err.splitlines()
        return [line for line in said if not line.startswith("ldtrefl: compiling kernels")]

    return lines


def test_every_fenced_block_is_run_or_is_plain_text() -> None:
    """However it is indented or fenced: one that the tests below do not find would go stale unseen."""
    lines = [line.strip() for page in PAGES for line in page.read_text().splitlines()]
    languages = [line.lstrip("`~").strip() for line in lines if line.startswith(("```", "~~~"))][::2]
    found = {language: len(documents.blocks(language)) for language in ("python", "toml")}
    assert all(found.values()) and found == {name: languages.count(name) for name in set(languages) - {""}}


@pytest.mark.parametrize("block", documents.blocks("python"), ids=str)
def test_python_runs_as_it_stands(block: Block, folder: Path, complaints: Complaints) -> None:
    before = set(folder.iterdir())
    exec(compile(block.code, str(block), "exec"), {"__name__": "__main__"})
    assert not complaints()
    written = {path.name for path in set(folder.iterdir()) - before}
    expected = re.findall(r'(?:save_image|save)\(f?"([^"]+)"', block.code)
    assert all(fnmatch.filter(written, re.sub(r"{.*?}", "*", name)) for name in expected), written


@pytest.mark.parametrize("block", documents.commands(), ids=str)
def test_commands_run_as_they_stand(block: Block, complaints: Complaints) -> None:
    arguments = shlex.split(block.code)
    assert main(arguments) == 0 and not complaints()
    if "-o" in arguments:
        assert Path(arguments[arguments.index("-o") + 1]).exists()


def scene_of(block: Block) -> str:
    """A scene file: the block, or the page's first one with the block added."""
    first = next(other for other in documents.blocks("toml") if other.page == block.page)
    return block.code if "[camera]" in block.code else first.code + block.code


@pytest.mark.parametrize("block", documents.blocks("toml"), ids=str)
def test_scenes_load(block: Block, folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    (folder / "scene.toml").write_text(scene_of(block))
    scene = ldtrefl.load_scene(folder / "scene.toml")
    assert scene.objects and not caplog.records


def test_the_scene_reference_is_not_burnt_white(folder: Path) -> None:
    """The newcomer's first picture: a statue, seen in a mirror ball, nothing of it clipped."""
    first = next(block for block in documents.blocks("toml") if block.page == SCENE_REFERENCE)
    (folder / "scene.toml").write_text(first.code)
    frame = ldtrefl.render(ldtrefl.load_scene(folder / "scene.toml"))
    assert (frame.image >= 1.0).any(axis=2).mean() < 1e-4
    assert frame.reflector_mask.mean() > 0.1 and frame.image[frame.reflector_mask].mean() > 0.2
    assert frame.hits is not None
    seen = frame.hits.object[frame.reflector_mask] == 0
    assert 0.01 < seen.mean() < 0.5


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_file_that_a_page_names_exists(page: Path) -> None:
    missing = {str(path.relative_to(ROOT)) for path in documents.named_files(page) if not path.exists()}
    assert not missing


def test_ci_runs_the_readmes_test_command() -> None:
    readme, ci = (ROOT / "README.md").read_text(), (ROOT / ".ci" / "run").read_text()
    command = next(line.strip() for line in readme.splitlines() if line.endswith("bin/pytest"))
    assert command in ci.splitlines()


def test_every_page_of_docs_is_in_the_readme() -> None:
    readme = (ROOT / "README.md").read_text()
    assert all(f"`docs/{page.name}`" in readme for page in PAGES if page.parent == ROOT / "docs")


def rows_of(page: str, heading: str) -> dict[str, str]:
    """Of the table whose first column has this heading: the name at the start of each row, and the row."""
    table = re.search(rf"^\| {heading} \|.*\n\|[-|]+\|\n((?:\|.*\n)+)", (ROOT / page).read_text(), re.MULTILINE)
    assert table is not None
    return {line.split("`")[1]: line for line in table[1].splitlines()}


def test_tables_list_what_there_is() -> None:
    """What is new may be missing there, so that it needs no other file; what is gone may not be left."""
    assert set(rows_of("README.md", "method")) <= set(all_methods())
    assert set(rows_of("docs/skips.md", "skip")) == set(skip_names())
    files = {path.stem for path in Path(command_files.__file__).parent.glob("*.py")} - {"__init__"}
    assert set(rows_of("docs/command_line.md", "command")) <= files
    assert set(rows_of("docs/scenes.md", "scene")) <= {path.name for path in (ROOT / "scenes").glob("*.toml")}


def test_the_table_of_shapes_has_their_parameters() -> None:
    for name, row in rows_of("docs/scenes.md", "shape").items():
        for option, parameter in inspect.signature(shapes.all_shapes()[name].make).parameters.items():
            assert f"`{option} = {json.dumps(parameter.default)}`" in row


def test_every_key_of_a_scene_is_in_the_reference() -> None:
    text = SCENE_REFERENCE.read_text()
    for kind in ("Camera", "Environment", "Lighting", "Light", "Object", "Material", "Picture", "Reflection"):
        for key in getattr(ldtrefl, kind).__dataclass_fields__:
            assert re.search(rf"\b{key} = |`{key}`|\[(object|lighting)\.{key}\]", text), f"{kind}.{key}"


def test_architecture_names_what_is_there() -> None:
    """Classes, functions and fields, by names that the package has."""
    page = (ROOT / "docs" / "architecture.md").read_text()
    source = "\n".join(path.read_text() for path in (ROOT / "ldtrefl").rglob("*.py"))
    quoted = re.findall(r"`([A-Za-z_][\w.]*?)(?:\(\))?`", page)
    names = {name.rpartition(".")[2] for name in quoted if not name.endswith((".py", ".h", ".md"))}
    missing = {name for name in names if not re.search(rf"\b(def|class) {name}\b|^    {name}: ", source, re.MULTILINE)}
    assert names and not missing
