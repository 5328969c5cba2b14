"""``ldtrefl info``: scenes and meshes."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh

from tests.cli.conftest import Done
from tests.scene.gltf.writer import Written


def test_a_scene(run: Callable[..., Done]) -> None:
    done = run("info", "scene.toml")
    assert done.status == 0 and not done.errors
    for words in ("camera: 24 x 16", "lights: none; shadows: False", "method: ldt", "torus", "4.0 GiB allowed"):
        assert words in done.output, done.output


def test_metals_of_files_and_of_the_scene_are_mirrors(run: Callable[..., Done], scene_folder: Path) -> None:
    (scene_folder / "a.mtl").write_text("newmtl chrome\nPm 1\nPr 0.1\n")
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (scene_folder / "a.obj").write_text("mtllib a.mtl\nusemtl chrome\n" + text)
    (scene_folder / "b.obj").write_text(text)
    objects = [
        ("of its file", "a", ""),
        ("rough", "a", "roughness = 1.0"),
        ("plaster", "b", ""),
        ("gold", "b", "metallic = 1.0"),
    ]
    tables = [f'[[object]]\nname = "{n}"\nmesh = "{m}.obj"\n[object.material]\n{own}\n' for n, m, own in objects]
    path = scene_folder / "mirrors.toml"
    path.write_text("[camera]\neye = [0, 0, 5]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\n" + "".join(tables))
    rows = [line.split("│") for line in run("info", "mirrors.toml").output.splitlines() if ".obj" in line]
    told = {row[1].strip(): row[4].strip() for row in rows}
    assert told == {"of its file": "yes", "rough": "no", "plaster": "no", "gold": "yes"}


def test_closed_and_open_meshes(run: Callable[..., Done], scene_folder: Path) -> None:
    assert "closed: every texel has an even number" in run("info", "genus3").output
    sheet = trimesh.Trimesh(np.array([[0, 0, 0], [1, 0, 0.1], [0, 1, 0.2]]), [[0, 1, 2]])
    sheet.export(scene_folder / "sheet.ply")
    done = run("info", "sheet.ply")
    assert "1 triangles, 3 vertices" in done.output and "texels have an odd number" in done.output


def test_memory_that_is_allowed(run: Callable[..., Done]) -> None:
    assert "2.0 GiB allowed" in run("info", "scene.toml", "--memory", "2G").output
    assert run("info", "scene.toml", "--memory", "1K").status == 2


def test_a_gltf_file_lists_its_nodes(run: Callable[..., Done], scene_folder: Path) -> None:
    file = Written()
    file.quad()
    file.tree["nodes"][0]["name"] = "sheet"
    file.save(scene_folder)
    done = run("info", "a.glb")
    assert done.status == 0 and "sheet" in done.output
    (scene_folder / "b.glb").write_bytes(b"glTF")
    done = run("info", "b.glb")
    assert done.status == 2 and done.errors == ["ldtrefl: b.glb: it is cut off"]


def test_a_preset_brings_its_lights(run: Callable[..., Done], scene_folder: Path) -> None:
    text = (scene_folder / "scene.toml").read_text() + '\n[environment]\npreset = "sky"\n'
    (scene_folder / "sky.toml").write_text(text)
    assert "lights: those of the preset 'sky'" in run("info", "sky.toml").output


def test_a_mesh_file_lists_its_materials(run: Callable[..., Done], scene_folder: Path) -> None:
    """By the names that ``parts`` takes, each once."""
    (scene_folder / "a.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl chrome trim\nPm 1\nPr 0.25\n")
    (scene_folder / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\n"
        "usemtl red\ng a\nf 1 2 3\nusemtl chrome trim\nf 1 3 2\nusemtl red\ns 2\nf 1 2 3\n"
    )
    done = run("info", "a.obj")
    assert done.status == 0 and "vertices have colours" in done.output and "2 materials" in done.output, done.output
    rows = [line.split() for line in done.output.splitlines() if "opaque" in line]
    assert [row[1:-1] for row in rows] == [
        [*"red │ 1 0 0 │ 0 │ 1 │ opaque │ both │ none".split()],
        [*"chrome trim │ 1 1 1 │ 1 │ 0.25 │ opaque │ both │ none".split()],
    ]
    assert "materials" not in run("info", "genus3").output
