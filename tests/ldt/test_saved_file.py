"""A layered depth texture in a file of its own: what is wrong with a file is said in one line that names it."""

import os
import zipfile
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.scene import shapes


def test_save_and_load_round_trip(tmp_path: Path) -> None:
    mesh = shapes.make("genus3", {"grid": 32})
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution=48)
    maps.save(tmp_path / "maps.npz")
    again = ldtrefl.LayeredDepthTexture.load(tmp_path / "maps.npz")
    assert again.frame == maps.frame
    for name in ("start", "depth", "reference"):
        np.testing.assert_array_equal(getattr(again, name).numpy(), getattr(maps, name).numpy())
    rays = np.array([[0, 0, 3]], np.float32), np.array([[0.1, 0.1, -1]], np.float32)
    assert again.trace(*rays).t == maps.trace(*rays).t
    assert [path.name for path in tmp_path.iterdir()] == ["maps.npz"]


def test_damaged_maps_are_refused(tmp_path: Path) -> None:
    mesh = shapes.make("box")
    path = tmp_path / "maps.npz"
    ldtrefl.peel(mesh.vertices, mesh.faces, resolution=16).save(path)
    whole = path.read_bytes()
    for length in range(0, len(whole), 97):
        path.write_bytes(whole[:length])
        with pytest.raises(ldtrefl.InputError, match=r"maps\.npz: not a layered depth texture that can be read"):
            ldtrefl.LayeredDepthTexture.load(path)
    path.write_bytes(whole)
    stored = dict(np.load(path))
    stored["reference"] = stored["reference"] + 10**6
    np.savez(path, **stored)
    with pytest.raises(ldtrefl.InputError, match="damaged"):
        ldtrefl.LayeredDepthTexture.load(path)
    with pytest.raises(ldtrefl.InputError, match=r"none\.npz: .*No such file"):
        ldtrefl.LayeredDepthTexture.load(tmp_path / "none.npz")


def npz(path: Path, **changes: object) -> Path:
    """A saved layered depth texture with other arrays; None leaves one out."""
    mesh = shapes.make("torus_knot", {"segments": [24, 6]})
    ldtrefl.peel(mesh.vertices, mesh.faces, 16, search="linear").save(path)
    with np.load(path) as good:
        arrays = {name: good[name] for name in good.files}
    arrays |= changes
    np.savez(path, allow_pickle=True, **{name: array for name, array in arrays.items() if array is not None})
    return path


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start": None}, "start"),
        ({"format": np.array([1, 2])}, "format is int64 of shape"),
        ({"format": np.int64(9)}, "format 9, this version reads 1"),
        ({"vertices": np.array([object()])}, "vertices is object"),
        ({"vertices": np.full((175, 3), np.nan)}, "vertex 0 is not finite"),
        ({"normals": np.full((175, 3), np.nan, np.float32)}, "not finite"),
        ({"size": np.array([2**40, 1, 1])}, "texels, 1 to 4096 allowed"),
        ({"size": np.array([0, 16, 16])}, "texels, 1 to 4096 allowed"),
        ({"scale": np.float64("nan")}, "not finite"),
        ({"scale": np.float64(0)}, "not finite"),
        ({"offset": np.array([0, np.inf, 0])}, "not finite"),
        ({"start": np.zeros(5, np.int32)}, "texels"),
        ({"reference": np.zeros(5, np.int32)}, "fragments for other texels"),
        ({"depth": np.zeros(5, np.float64)}, "depth is float64"),
    ],
)
def test_wrong_saved_maps(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    path = npz(tmp_path / "a.npz", **changes)
    with pytest.raises(ldtrefl.InputError, match=message) as caught:
        ldtrefl.LayeredDepthTexture.load(path)
    assert str(path) in str(caught.value)


def test_saved_maps_that_are_no_archive(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    os.mkfifo(path)
    with pytest.raises(ldtrefl.InputError, match="not a plain file"):
        ldtrefl.LayeredDepthTexture.load(path)
    path.unlink()
    for name in (tmp_path / "none.npz", tmp_path, "nul\0"):
        with pytest.raises(ldtrefl.InputError, match="not a layered depth texture"):
            ldtrefl.LayeredDepthTexture.load(name)
    whole = npz(path).read_bytes()
    for length in (*range(0, len(whole), 997), len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(ldtrefl.InputError):
            ldtrefl.LayeredDepthTexture.load(path)


def test_an_archive_that_unpacks_to_more_than_is_allowed(tmp_path: Path) -> None:
    npz(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as good:
        arrays = {name: good[name] for name in good.files}
    np.savez_compressed(tmp_path / "b.npz", **{**arrays, "depth": np.zeros(3 << 20, np.float32)})
    assert (tmp_path / "b.npz").stat().st_size < 1 << 18
    budget.set_memory_limit(8 << 20)
    with pytest.raises(ldtrefl.InputError, match=r"needs 12\.\d MiB, allowed are 8\.0 MiB"):
        ldtrefl.LayeredDepthTexture.load(tmp_path / "b.npz")
    # An array that says that it is longer than what is packed.
    with zipfile.ZipFile(tmp_path / "a.npz") as archive, zipfile.ZipFile(tmp_path / "c.npz", "w") as crafted:
        for name in archive.namelist():
            data = archive.read(name)
            if name == "depth.npy":
                data = b"\x93NUMPY\1\0\x76\0" + b"{'descr': '<f4', 'fortran_order': False, 'shape': (1073741824,), }"
                data = data.ljust(127) + b"\n"
            crafted.writestr(name, data)
    with pytest.raises(ldtrefl.InputError, match="depth is not as long as it says"):
        ldtrefl.LayeredDepthTexture.load(tmp_path / "c.npz")
