"""``ldtrefl render``: pictures and statistics."""

from collections.abc import Callable
from pathlib import Path

import pytest

import ldtrefl
from tests.cli.conftest import Done
from tests.scene.gltf.writer import Written


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "scene.png: 24 x 16"),
        (("-o", "a.exr", "--method", "bvh", "--threads", "1"), "a.exr: 24 x 16"),
        (("-o", "a.png", "--set", "resolution=32", "--set", "search=linear", "--no-cache"), "march"),
        (("--stats", "--cache", "maps"), "pixels see a reflector"),
    ],
)
def test_it_renders(run: Callable[..., Done], scene_folder: Path, options: tuple[str, ...], said: str) -> None:
    done = run("render", "scene.toml", *options)
    assert done.status == 0 and said in done.output and not done.errors, done
    (picture,) = [path for path in scene_folder.iterdir() if path.suffix in (".png", ".exr")]
    assert ldtrefl.load_image(picture).shape == (16, 24, 3)


def test_stats_say_what_was_skipped(run: Callable[..., Done], scene_folder: Path) -> None:
    lines = run("render", "scene.toml", "--stats").output.splitlines()
    said = ["of 384 pixels see a reflector", "reflector triangles", "rays reflected", "not searched", "searches"]
    assert all(words in line for words, line in zip(said, lines[1:-1], strict=True))
    assert "1 objects peeled" in lines[-1]
    path = scene_folder / "scene.toml"
    path.write_text(path.read_text().replace("look_at = [0.0, 0.0, 0.0]", "look_at = [0.0, -9.0, 0.0]"))
    assert run("render", "scene.toml", "--stats").output.splitlines()[1:] == [
        "0 of 384 pixels see a reflector",
        "no reflector in view: nothing culled, peeled or traced",
    ]


OBJ = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def test_a_mesh_on_a_stage_and_its_scene_file(run: Callable[..., Done], scene_folder: Path) -> None:
    """The scene file that is written makes the same picture."""
    (scene_folder / "thing.obj").write_text(OBJ)
    stage = ("--on", "mirror-ball", "--up", "-y", "--turn", "35", "--mirror", "self", "--size", "36x24")
    done = run("render", "thing.obj", *stage, "--save-scene", "made.toml")
    assert done.status == 0 and "thing.png: 36 x 24" in done.output and not done.errors, done
    made = (scene_folder / "made.toml").read_text()
    assert 'up_axis = "-y"' in made and "rotate = [0.0, 0.0, 1.0, 35.0]" in made
    assert run("render", "made.toml").status == 0
    assert (scene_folder / "made.png").read_bytes() == (scene_folder / "thing.png").read_bytes()


def test_a_lenient_render_saves_a_lenient_scene(run: Callable[..., Done], scene_folder: Path) -> None:
    file = Written(extensionsUsed=["ACME_hats"], extensionsRequired=["ACME_hats"])
    file.quad()
    file.save(scene_folder, "hats.glb")
    options = ("--lenient", "--size", "36x24", "--save-scene", "made.toml")
    assert run("render", "hats.glb", *options).status == 0
    assert run("render", "made.toml").status == 0
    assert (scene_folder / "made.png").read_bytes() == (scene_folder / "hats.png").read_bytes()


def test_a_mesh_by_itself_says_what_is_up(run: Callable[..., Done], scene_folder: Path) -> None:
    (scene_folder / "thing.obj").write_text(OBJ)
    done = run("render", "thing.obj")
    assert done.status == 0 and "its y axis points up; --up names another" in done.output
    assert ldtrefl.load_image(scene_folder / "thing.png").shape in ((768, 512, 3), (512, 768, 3))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("thing.obj", "--on", "ball"), "unknown stage 'ball' (allowed: chrome, mirror-ball, mirror-floor, studio)"),
        (("scene.toml", "--on", "studio"), "scene.toml: 'on' goes with a mesh file, this is a scene file"),
        (("scene.toml", "--turn", "30"), "scene.toml: 'turn' goes with a mesh file, this is a scene file"),
        (("scene.toml", "--save-scene", "a.toml"), "--save-scene goes with a mesh file, scene.toml is a scene file"),
        (("thing.obj", "--save-scene", "a.txt"), "a.txt: a scene file's name ends in .toml"),
        (("thing.fbx",), "thing.fbx: no such mesh"),
    ],
)
def test_what_does_not_go_together_is_one_line(
    run: Callable[..., Done], scene_folder: Path, arguments: tuple[str, ...], message: str
) -> None:
    (scene_folder / "thing.obj").write_text(OBJ)
    done = run("render", *arguments)
    assert done.status == 2 and len(done.errors) == 1 and message in done.errors[0]
    assert not (scene_folder / "thing.png").exists()
