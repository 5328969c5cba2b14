"""Texts with a byte order mark are read as those without, also in UTF-16."""

import codecs
from pathlib import Path

import numpy as np
import pytest
import trimesh

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.scene.readers.byte_order_marks import without_mark

MARKS = {"utf-8": codecs.BOM_UTF8, "utf-16-le": codecs.BOM_UTF16_LE, "utf-16-be": codecs.BOM_UTF16_BE}


@pytest.mark.parametrize("encoding", MARKS)
def test_a_mark_says_how_a_text_is_encoded(encoding: str) -> None:
    text = "newmtl Grün\n日\n"
    assert without_mark(MARKS[encoding] + text.encode(encoding)) == text.encode()
    assert without_mark(b"v 1 2 3\n") == b"v 1 2 3\n" and without_mark(b"") == b""


def test_its_memory_is_asked_for() -> None:
    budget.set_memory_limit(1 << 20)
    with budget.account(), pytest.raises(ldtrefl.InputError, match="its text needs"):
        without_mark(codecs.BOM_UTF16_LE + bytes(1 << 20))


@pytest.mark.parametrize("encoding", MARKS)
@pytest.mark.parametrize("kind", ["obj", "off", "ply", "stl_ascii"])
def test_texts_of_every_kind(tmp_path: Path, kind: str, encoding: str) -> None:
    box = trimesh.creation.box()
    text = box.export(file_type=kind, **({"encoding": "ascii"} if kind == "ply" else {}))
    text = text if isinstance(text, str) else text.decode()
    name = f"box.{kind.partition('_')[0]}"
    (tmp_path / name).write_bytes(MARKS[encoding] + text.replace("\n", "\r\n").encode(encoding))
    mesh = ldtrefl.load_mesh(tmp_path / name)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], box.triangles)


def test_materials_in_utf_16(tmp_path: Path) -> None:
    text = "mtllib a.mtl\nusemtl Grün\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (tmp_path / "a.obj").write_text(text, "utf-16")
    (tmp_path / "a.mtl").write_text("newmtl Grün\nKd 0 1 0\n", "utf-16")
    material = ldtrefl.load_mesh(tmp_path / "a.obj").parts[0].material
    assert material.name == "Grün" and material.base_color == (0, 1, 0)


def test_a_binary_file_that_begins_like_a_mark(tmp_path: Path) -> None:
    """The header of a binary STL file may hold anything."""
    data = trimesh.creation.box().export(file_type="stl")
    (tmp_path / "a.stl").write_bytes(codecs.BOM_UTF16_LE + data[2:])
    assert len(ldtrefl.load_mesh(tmp_path / "a.stl").faces) == 12
