"""Files beside a mesh: plain ones alone are read, and a mesh is read again when one of them changes, comes or goes."""

import os
import time
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

import ldtrefl
from ldtrefl import InputError

OBJ = "mtllib a.mtl\nusemtl paint\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


def written(path: Path, data: str | bytes) -> None:
    """Write a file, whose time of change differs from those before it however coarse the clock is."""
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    written.clock += 10**9  # type: ignore[attr-defined]
    os.utime(path, ns=(written.clock, written.clock))  # type: ignore[attr-defined]


written.clock = time.time_ns()  # type: ignore[attr-defined]


def test_files_beside_a_mesh_are_plain_files(tmp_path: Path) -> None:
    """A pipe, a folder or a device in place of a glTF's buffer is a line, and nobody waits for a writer."""
    trimesh.creation.icosphere(1).export(tmp_path / "ball.gltf")
    buffer = next(path for path in tmp_path.iterdir() if path.suffix == ".bin")
    buffer.unlink()
    os.mkfifo(buffer)
    with pytest.raises(InputError, match=rf"ball\.gltf: .*'{buffer.name}' beside it is not a file"):
        ldtrefl.load_mesh(tmp_path / "ball.gltf")
    buffer.unlink()
    buffer.mkdir()
    with pytest.raises(InputError, match=rf"ball\.gltf: .*'{buffer.name}' beside it is not a file"):
        ldtrefl.load_mesh(tmp_path / "ball.gltf")


def color_of(mesh: ldtrefl.Mesh) -> tuple[float, ...]:
    return mesh.parts[0].material.base_color


def test_a_changed_mtl_file_is_read_again(tmp_path: Path) -> None:
    """Of the same size, while the first mesh is still in use; what has not changed stays the same mesh."""
    written(tmp_path / "a.obj", OBJ)
    written(tmp_path / "a.mtl", "newmtl paint\nKd 1 0 0\n")
    first = ldtrefl.load_mesh(tmp_path / "a.obj")
    assert color_of(first) == (1, 0, 0) and ldtrefl.load_mesh(tmp_path / "a.obj") is first
    written(tmp_path / "a.mtl", "newmtl paint\nKd 0 1 0\n")
    second = ldtrefl.load_mesh(tmp_path / "a.obj")
    assert color_of(second) == (0, 1, 0) and color_of(first) == (1, 0, 0)
    assert ldtrefl.load_mesh(tmp_path / "a.obj") is second


def test_a_file_that_comes_or_goes_is_noticed(tmp_path: Path) -> None:
    written(tmp_path / "a.obj", OBJ)
    without = ldtrefl.load_mesh(tmp_path / "a.obj")
    written(tmp_path / "a.mtl", "newmtl paint\nKd 1 0 0\n")
    held = ldtrefl.load_mesh(tmp_path / "a.obj")
    assert color_of(without) == (1, 1, 1) and color_of(held) == (1, 0, 0)
    (tmp_path / "a.mtl").unlink()
    assert color_of(ldtrefl.load_mesh(tmp_path / "a.obj")) == (1, 1, 1)


def test_a_changed_picture_is_read_again(tmp_path: Path) -> None:
    """In a whole scene, as somebody sees it who edits a picture and renders again."""
    written(tmp_path / "a.obj", OBJ)
    written(tmp_path / "a.mtl", "newmtl paint\nmap_Kd a.bmp\n")
    scenes = []
    for shade in (10, 200):
        Image.new("RGB", (4, 4), (shade,) * 3).save(tmp_path / "new.bmp")
        written(tmp_path / "a.bmp", (tmp_path / "new.bmp").read_bytes())
        scenes.append(ldtrefl.load_scene(tmp_path / "a.obj"))
    textures = [scene.objects[0].geometry.parts[0].material.base_texture for scene in scenes]
    assert [int(texture.picture.pixels.max()) for texture in textures if texture is not None] == [10, 200]


def test_a_changed_buffer_of_a_gltf_file_is_read_again(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(1)
    ball.export(tmp_path / "ball.gltf")
    buffer = next(path for path in tmp_path.iterdir() if path.suffix == ".bin")
    first = ldtrefl.load_mesh(tmp_path / "ball.gltf")
    values = buffer.read_bytes()
    at = values.find(np.float32(ball.vertices[0, 0]).tobytes())
    written(buffer, values[:at] + np.float32(-0.25).tobytes() + values[at + 4 :])
    second = ldtrefl.load_mesh(tmp_path / "ball.gltf")
    assert (second.vertices == -0.25).any() and not (first.vertices == -0.25).any()
