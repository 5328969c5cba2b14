"""The files in archives: found, and none larger than is allowed."""

import gzip
import io
import tarfile
import zipfile
from pathlib import Path

import pytest
import trimesh

import ldtrefl
from ldtrefl.base import budget
from tests.mesh_writers import packed

ARCHIVES = ("a.zip", "a.tar.gz", "a.tar.bz2", "a.stl.bz2", "a.stl.gz")


@pytest.mark.parametrize("name", ARCHIVES)
def test_meshes_in_archives(tmp_path: Path, name: str) -> None:
    ball = trimesh.creation.icosphere(2).export(file_type="stl")
    assert len(ldtrefl.load_mesh(packed(tmp_path / name, "a.stl", ball)).faces) == 320


@pytest.mark.parametrize("name", ARCHIVES)
def test_archives_that_unpack_to_too_much_are_refused(tmp_path: Path, name: str) -> None:
    path = packed(tmp_path / name, "a.stl", bytes(80) + (8 << 20).to_bytes(4, "little") + bytes(400 << 20))
    assert path.stat().st_size < 1 << 20
    with pytest.raises(ldtrefl.InputError, match=rf"{name}.*GiB"):
        ldtrefl.load_mesh(path)
    budget.set_memory_limit(64 << 20)
    with pytest.raises(ldtrefl.InputError, match=rf"{name}: what the archive holds needs .* allowed are 64.0 MiB"):
        ldtrefl.load_mesh(path)


def test_an_archive_whose_headers_lie_is_refused(tmp_path: Path) -> None:
    """A zip that declares less than it holds, and a tar file whose member has more zeros than it stores."""
    path = packed(tmp_path / "a.zip", "a.stl", bytes(64 << 20))
    data = bytearray(path.read_bytes())
    for place in range(len(data) - 4):
        if data[place : place + 4] == (64 << 20).to_bytes(4, "little"):
            data[place : place + 4] = (100).to_bytes(4, "little")
    path.write_bytes(data)
    with pytest.raises(ldtrefl.InputError, match=r"a\.zip"):
        ldtrefl.load_mesh(path)
    sparse = tarfile.TarInfo("a.stl")
    sparse.size = 512
    told = {"major": "1", "minor": "0", "name": "a.stl", "realsize": str(1 << 40)}
    sparse.pax_headers = {f"GNU.sparse.{key}": value for key, value in told.items()}
    whole = io.BytesIO()
    with tarfile.open(fileobj=whole, mode="w", format=tarfile.PAX_FORMAT) as archive:
        archive.addfile(sparse, io.BytesIO(b"0\n".ljust(512, b"\0")))
    (tmp_path / "a.tar.gz").write_bytes(gzip.compress(whole.getvalue()))
    with pytest.raises(ldtrefl.InputError, match=r"a\.tar\.gz.*1024\.0 GiB"):
        ldtrefl.load_mesh(tmp_path / "a.tar.gz")


@pytest.mark.parametrize("name", ["a.zip", "a.tar.gz"])
def test_archives_of_other_things(tmp_path: Path, name: str) -> None:
    with pytest.raises(ldtrefl.InputError, match="no mesh file in the archive"):
        ldtrefl.load_mesh(packed(tmp_path / name, "a.txt", b"words"))
    with pytest.raises(ldtrefl.InputError, match=name):
        ldtrefl.load_mesh(packed(tmp_path / name, "a.ply", b"ply\nno"))
    (tmp_path / name).write_bytes(b"not an archive")
    with pytest.raises(ldtrefl.InputError, match=name):
        ldtrefl.load_mesh(tmp_path / name)


@pytest.mark.parametrize("name", ["a.obj.gz", "a.obj.bz2", "a.zip"])
def test_what_a_packed_mesh_names_is_beside_it(tmp_path: Path, name: str) -> None:
    """Beside the archive of a single file, and else in the archive."""
    text = b"mtllib a.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    packed(tmp_path / name, "a.obj", text)
    materials = b"newmtl red\nKd 1 0 0\n"
    if name == "a.zip":
        with zipfile.ZipFile(tmp_path / name, "a") as archive:
            archive.writestr("a.mtl", materials)
    else:
        (tmp_path / "a.mtl").write_bytes(materials)
    assert ldtrefl.load_mesh(tmp_path / name).parts[0].material.base_color == (1, 0, 0)


def test_other_packed_files_are_no_meshes(tmp_path: Path) -> None:
    (tmp_path / "a.txt.gz").write_bytes(gzip.compress(b"words"))
    with pytest.raises(ldtrefl.InputError, match=r"a\.txt\.gz: no mesh file in the archive"):
        ldtrefl.load_mesh(tmp_path / "a.txt.gz")
