"""Maps on disk: the same answers, whole or absent, never trusted when damaged, and no more than the limit."""

import importlib.util
import logging
import multiprocessing
import os
import shutil
import stat
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.cli.commands import main
from ldtrefl.device import launch
from ldtrefl.files.fingerprint import fingerprint
from ldtrefl.files.map_cache import HEADER, Entry, MapCache, current_cache, keep_maps_in, key_of
from ldtrefl.ldt.exact.check import check_tree
from ldtrefl.ldt.peel import check_fragments, check_order
from ldtrefl.ldt.texel_frame import texel_frame
from ldtrefl.ldt.texture import peel_mesh
from ldtrefl.scene import shapes
from ldtrefl.world.device_mesh import DeviceMesh
from tests.conftest import SMALL_SCENE

KNOT = {"segments": [300, 40]}
SCENE = SMALL_SCENE.replace("segments = [16, 8] }\ntranslate", "segments = [150, 50] }\ntranslate")
"""The torus has 15,000 triangles: enough to be kept."""


@pytest.fixture
def cache(tmp_path: Path) -> Iterator[MapCache]:
    kept = MapCache(tmp_path / "maps")
    keep_maps_in(kept)
    yield kept
    keep_maps_in(None)


@pytest.mark.parametrize("search", ["exact", "linear"])
def test_second_time_comes_from_the_file_bit_for_bit(cache: MapCache, search: str) -> None:
    mesh = shapes.make("torus_knot", KNOT)
    rays = rays_about(mesh, 5000)
    first = ldtrefl.peel(mesh.vertices, mesh.faces, search=search)
    second = ldtrefl.peel(mesh.vertices, mesh.faces, search=search)
    assert not first.from_cache and second.from_cache and len(cache.files()) == 1
    a, b = (maps.trace(*rays, search=search) for maps in (first, second))
    for name in ("t", "normal", "triangle", "barycentrics"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    assert first.nbytes == second.nbytes
    # Another mesh, and other options, are other files.
    ldtrefl.peel(mesh.vertices * 1.001, mesh.faces, search=search)
    ldtrefl.peel(mesh.vertices, mesh.faces, 128, search=search)
    assert len(cache.files()) == 3


def small_entry(cache: MapCache) -> bytes:
    cache.store("a" * 32, {"x": np.arange(5, dtype=np.int32), "y": np.ones((2, 3), np.float32)}, {"n": 3})
    return cache.path("a" * 32).read_bytes()


def test_a_file_cut_at_any_length_is_not_trusted(cache: MapCache, caplog: pytest.LogCaptureFixture) -> None:
    whole = small_entry(cache)
    assert cache.load("a" * 32) is not None
    for length in range(len(whole)):
        cache.path("a" * 32).write_bytes(whole[:length])
        assert cache.load("a" * 32) is None, length
    cache.path("a" * 32).write_bytes(whole + b"x")
    assert cache.load("a" * 32) is None
    warnings = [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]
    assert len(warnings) == len(whole) + 1 and not any("\n" in line for line in warnings)


def test_a_changed_byte_is_found(cache: MapCache) -> None:
    whole = bytearray(small_entry(cache))
    for place in range(len(whole)):
        whole[place] ^= 0x40
        cache.path("a" * 32).write_bytes(whole)
        assert cache.load("a" * 32) is None, place
        whole[place] ^= 0x40
    assert len(whole) > HEADER.size


def test_a_damaged_file_is_made_anew(cache: MapCache) -> None:
    mesh = shapes.make("torus_knot", KNOT)
    ldtrefl.peel(mesh.vertices, mesh.faces)
    path, size, _ = cache.files()[0]
    path.write_bytes(path.read_bytes()[: size // 2])
    assert not ldtrefl.peel(mesh.vertices, mesh.faces).from_cache
    assert ldtrefl.peel(mesh.vertices, mesh.faces).from_cache


def test_the_limit_removes_what_was_not_used_for_longest(tmp_path: Path) -> None:
    cache = MapCache(tmp_path, limit=5000)
    for i in range(3):
        cache.store(f"{i}" * 32, {"x": np.zeros(300, np.float32)}, {})
        os.utime(cache.path(f"{i}" * 32), (i, i))
    assert cache.load("0" * 32) is not None  # used just now
    cache.store("3" * 32, {"x": np.zeros(300, np.float32)}, {})
    assert [path.stem[0] for path, _, _ in cache.files()] == ["2", "0", "3"]
    assert cache.clear() == 3 and not cache.files()


def write_often(folder: Path) -> None:
    cache = MapCache(folder)
    for i in range(200):
        cache.store("b" * 32, {"x": np.full(2000, i)}, {})


def test_two_processes_write_at_once(tmp_path: Path) -> None:
    writers = [multiprocessing.get_context("spawn").Process(target=write_often, args=(tmp_path,)) for _ in range(2)]
    cache = MapCache(tmp_path)
    for writer in writers:
        writer.start()
    found = 0
    while any(writer.is_alive() for writer in writers):
        entry = cache.load("b" * 32)
        if entry is not None:
            found += 1
            assert (entry.arrays["x"] == entry.arrays["x"][0]).all()
    assert [writer.exitcode for writer in writers] == [0, 0] and found > 0
    assert cache.load("b" * 32) is not None and len(list(tmp_path.iterdir())) == 1


def test_keys_tell_meshes_and_options_apart() -> None:
    keys = {key_of("a", {}), key_of("b", {}), key_of("a", {"r": 1}), key_of("a", {"r": 2})}
    assert len(keys) == 4 and key_of("a", {"r": 1}) in keys


def test_command_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene, folder = tmp_path / "scene.toml", str(tmp_path / "kept")
    scene.write_text(SCENE)
    command = ["render", str(scene), "-o", str(tmp_path / "a.png"), "--stats"]
    assert main([*command, "--no-cache"]) == 0
    assert main([*command, "--cache", folder]) == 0
    assert "1 objects peeled" in capfd.readouterr().out
    assert main([*command, "--cache", folder]) == 0
    assert "1 from the cache" in capfd.readouterr().out
    assert main(["cache", "info", "--cache", folder]) == 0
    assert "1 files" in capfd.readouterr().out
    assert main(["cache", "clear", "--cache", folder]) == 0
    assert main([*command, "--cache", folder, "--no-cache"]) == 2
    assert main([*command, "--cache", str(scene)]) == 2
    assert "\n" not in capfd.readouterr().err.strip().splitlines()[-1]


def stored(quality: str = "exact", search: str = "exact", trusted: bool = False) -> tuple[DeviceMesh, Entry, MapCache]:
    """A mesh, and what the cache in use holds of its maps."""
    cache = current_cache()
    assert cache is not None
    geometry = DeviceMesh(shapes.make("torus_knot", {"segments": [130, 40]}), launch.resolve_device("cpu"))
    peel_mesh(geometry, 32, quality=quality, search=search, trusted=trusted)
    return geometry, cache.load(cache.files()[-1][0].stem), cache


def changed(array: np.ndarray, place: int, value: float) -> np.ndarray:
    """A copy with another number in one place."""
    copied = array.copy()
    copied[place] = value
    return copied


def as_float(bits: int) -> float:
    """The float32 of these bits."""
    return float(np.int32(bits).view(np.float32))


@pytest.mark.parametrize("trusted", [False, True])
def test_a_tree_is_checked_in_every_field(cache: MapCache, trusted: bool) -> None:
    quality = "balanced" if trusted else "exact"
    geometry, entry, _ = stored(quality, trusted=trusted)
    count = len(geometry.faces)
    check_tree(entry.arrays, entry.values, count)
    assert (entry.values["half_patch"] > 0.0) == trusted
    nodes, rows = entry.arrays["nodes"], entry.arrays["rows"]
    children = np.ascontiguousarray(nodes.reshape(-1, 56)[:, 48:]).view(np.int32)
    boxes = nodes.reshape(-1, 56)[:, :8]
    of_block, lane = np.argwhere(children < 0)[-1]
    block = 56 * int(of_block) + 48 + int(lane)
    code = int(~children[of_block, lane])
    inner = 48 + int(np.flatnonzero((children[0] > 0) & (boxes[0] < 1e29))[0])
    unused = np.argwhere(boxes > 1e29)[0]
    number = 8 * ((code >> 1) + (6 if code & 1 else 9))
    wrong = {
        "nodes": [nodes[:-56], nodes[:-1], nodes[:0], nodes.astype(np.float64), nodes.reshape(1, -1)]
        + [changed(nodes, block, as_float(~bits)) for bits in (code + 2, code ^ 1, 2**31 - 1, code - 2, 0)]
        + [changed(nodes, block, as_float(child)) for child in (0, len(children) - 1, len(children), 2**30)]
        + [changed(nodes, inner, as_float(child)) for child in (0, len(children), 2**30, -(2**31))]
        + [changed(nodes, 56 * int(unused[0]) + int(unused[1]), 0.0)],
        "rows": [rows[:-8], rows[:-80], rows[:-1], rows.astype(np.float64), rows.reshape(2, -1)]
        + [changed(rows, number, as_float(bits)) for bits in (count, 2**30, -1, -(2**31))],
    }
    for name, others in wrong.items():
        for other in others:
            with pytest.raises((ValueError, KeyError, TypeError)):
                check_tree({**entry.arrays, name: other}, entry.values, count)
    for name in entry.arrays:
        with pytest.raises(KeyError):
            check_tree({n: a for n, a in entry.arrays.items() if n != name}, entry.values, count)
    for name, others in {
        "low": [[0.0, float("nan"), 0.0], [1e30] * 3, [99.0] * 3, "low"],
        "high": [[float("inf")] * 3, [-99.0] * 3, [0.0, 0.0]],
        "front": [0.5, float("nan"), None],
        "half_patch": [-1.0, float("inf")] + ([0.0] if trusted else []),
        "horizon": [-1.0, float("nan")] + ([0.0, 1e-30] if entry.values["front"] else []),
        "records": [-1, 1.5, 2**40, True],
    }.items():
        for value in others:
            with pytest.raises((ValueError, TypeError)):
                check_tree(entry.arrays, {**entry.values, name: value}, count)
        with pytest.raises(KeyError):
            check_tree(entry.arrays, {n: v for n, v in entry.values.items() if n != name}, count)


def test_a_tree_that_is_too_deep_is_refused(cache: MapCache) -> None:
    """Nodes one in the other: a ray would leave more behind than it can hold."""
    for depth in (32, 33):
        nodes = np.zeros((depth, 56), np.float32)
        nodes[:, 8:16] = nodes[:, 24:32] = nodes[:, 40:48] = 1.0
        children = nodes[:, 48:].view(np.int32)
        blocks = np.arange(7 * depth).reshape(depth, 7)
        children[:, :7] = ~(2 * 10 * blocks)
        children[:, 7] = np.arange(1, depth + 1)
        children[-1, 7] = ~(2 * 10 * 7 * depth)
        rows = np.zeros((70 * depth + 10) * 8, np.float32)
        values = {"low": [0.0] * 3, "high": [1.0] * 3, "front": 0.0, "half_patch": 0.0, "horizon": 0.0, "records": 1}
        arrays = {"nodes": nodes.reshape(-1), "rows": rows}
        if 8 * depth <= 256:
            check_tree(arrays, values, 1)
        else:
            with pytest.raises(ValueError, match="more to come back to"):
                check_tree(arrays, values, 1)


def test_maps_are_checked_in_every_field(cache: MapCache) -> None:
    geometry, entry, _ = stored(search="linear")
    frame, count = texel_frame(geometry.mesh, 32), len(geometry.faces)
    arrays = entry.arrays
    check_fragments(frame, count, arrays)
    check_order(arrays)
    start, depth, reference = (arrays[name] for name in ("start", "depth", "reference"))
    two = int(np.flatnonzero(np.diff(start) > 1)[0])
    wrong = {
        "start": [
            start[:-1],
            changed(start, 0, 1),
            changed(start, -1, 2**31 - 1),
            changed(start, 5, -(2**31)),
            start * 2,
        ],
        "depth": [depth[:-1], changed(depth, 0, np.nan), depth.astype(np.float64), changed(depth, start[two], 1e9)],
        "reference": [reference[1:], changed(reference, 3, -1), changed(reference, 3, 2 * count)],
    }
    for name, others in wrong.items():
        for other in others:
            with pytest.raises(ValueError):
                check_fragments(frame, count, {**arrays, name: other})
                check_order({**arrays, name: other})


def test_a_crafted_file_is_made_anew(cache: MapCache, caplog: pytest.LogCaptureFixture) -> None:
    geometry, entry, _ = stored()
    key = cache.files()[0][0].stem
    rays = rays_about(geometry.mesh, 200)
    truth = peel_mesh(geometry, 32, quality="exact").trace(*rays)
    for arrays, values in (
        ({**entry.arrays, "rows": entry.arrays["rows"][:-8]}, entry.values),
        (entry.arrays, {}),
        ({}, entry.values),
    ):
        caplog.clear()
        cache.store(key, arrays, values)
        again = peel_mesh(geometry, 32, quality="exact")
        np.testing.assert_array_equal(again.trace(*rays).t, truth.t)
        said = [record.getMessage() for record in caplog.records]
        assert not again.from_cache and len(said) == 1 and "made anew" in said[0] and key in said[0]
    assert peel_mesh(geometry, 32, quality="exact").tree and len(cache.files()) == 1


@pytest.mark.parametrize(
    "module",
    [
        "geometry.fixed_raster",
        "ldt.exact.build",
        "ldt.exact.patch_check",
        "ldt.exact.patches",
        "ldt.exact.pieces",
        "ldt.exact.record_choice",
        "ldt.exact.tree",
        "ldt.exact.walk",
    ],
)
def test_every_constant_is_part_of_the_key(module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    before = fingerprint("ldt.texture")
    found = importlib.import_module(f"ldtrefl.{module}")
    own = [
        name
        for name, value in vars(found).items()
        if name[0].isupper() and name.isupper() and isinstance(value, int | float | dict)
    ]
    assert own
    for name in own:
        value = getattr(found, name)
        other = {**value, "finest": 1.0} if isinstance(value, dict) else value + 1 if abs(value) < 1e6 else 2 * value
        with monkeypatch.context() as patch:
            patch.setattr(found, name, other)
            assert fingerprint("ldt.texture") != before, name
    assert fingerprint("ldt.texture") == before


def test_a_tree_of_other_constants_is_not_taken_for_current(cache: MapCache, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shapes.make("torus_knot", KNOT)
    ldtrefl.peel(mesh.vertices, mesh.faces)
    monkeypatch.setattr("ldtrefl.ldt.exact.build.CELLS_PER_ROOT", 0.05)
    other = ldtrefl.peel(mesh.vertices, mesh.faces)
    assert not other.from_cache and len(cache.files()) == 2


def test_the_source_is_part_of_the_key(tmp_path: Path) -> None:
    """C++ and the modules far below, but not the command line."""
    copied = tmp_path / "ldtrefl"
    shutil.copytree(Path(ldtrefl.__file__).parent, copied, ignore=shutil.ignore_patterns("__pycache__"))

    def key_after(changed_file: str | None) -> str:
        if changed_file is not None:
            with (copied / changed_file).open("a") as file:
                file.write("\n")
        spec = importlib.util.spec_from_file_location("ldtrefl.files.fingerprint", copied / "files" / "fingerprint.py")
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return str(module.fingerprint("ldt.texture"))

    changed = ("ldt/exact/walk.h", "device/vectors.h", "ldt/exact/patches.py", "device/bins.py", "ldt/texture.py")
    keys = [key_after(name) for name in (None, *changed)]
    assert len(set(keys)) == len(keys) and keys[0] == fingerprint("ldt.texture")
    assert key_after("cli/commands.py") == keys[-1]


def test_the_folder_is_the_users_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = os.umask(0)
    try:
        cache = MapCache(tmp_path / "new" / "maps")
        small_entry(cache)
    finally:
        os.umask(before)
    assert stat.S_IMODE(cache.folder.stat().st_mode) == 0o700
    assert stat.S_IMODE(cache.path("a" * 32).stat().st_mode) == 0o600
    for mode in (0o770, 0o707, 0o1777):
        cache.folder.chmod(mode)
        with pytest.raises(ldtrefl.InputError, match="can be written by others"):
            MapCache(cache.folder)
    # The usual folder, made by an earlier version, is closed.
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_: str(cache.folder))
    assert MapCache().folder == cache.folder and stat.S_IMODE(cache.folder.stat().st_mode) == 0o700
    if os.geteuid() == 0:
        os.chown(cache.folder, 12345, -1)
        for folder in (None, cache.folder):
            with pytest.raises(ldtrefl.InputError, match="belongs to another user"):
                MapCache(folder)


def test_what_is_no_file_of_the_user_is_ignored(cache: MapCache, caplog: pytest.LogCaptureFixture) -> None:
    small_entry(cache)
    path = cache.path("a" * 32)
    kept = path.rename(cache.folder / "elsewhere")
    for make in (
        lambda: os.mkfifo(path),
        lambda: path.symlink_to(kept),
        path.mkdir,
        lambda: (shutil.copy(kept, path), path.chmod(0o620)),
        lambda: (shutil.copy(kept, path), os.truncate(path, 1 << 40)),
        lambda: (shutil.copy(kept, path), os.chown(path, 12345 if os.geteuid() == 0 else -1, -1), path.chmod(0o666)),
    ):
        make()
        caplog.clear()
        assert cache.load("a" * 32) is None
        assert len(caplog.records) == 1 and "\n" not in caplog.records[0].getMessage()
        path.rmdir() if path.is_dir() and not path.is_symlink() else path.unlink()


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
    try:
        with pytest.raises(ldtrefl.InputError, match=r"needs 12\.\d MiB, allowed are 8\.0 MiB"):
            ldtrefl.LayeredDepthTexture.load(tmp_path / "b.npz")
        # An array that says that it is longer than what is packed.
        with zipfile.ZipFile(tmp_path / "a.npz") as archive, zipfile.ZipFile(tmp_path / "c.npz", "w") as crafted:
            for name in archive.namelist():
                data = archive.read(name)
                if name == "depth.npy":
                    data = (
                        b"\x93NUMPY\1\0\x76\0" + b"{'descr': '<f4', 'fortran_order': False, 'shape': (1073741824,), }"
                    )
                    data = data.ljust(127) + b"\n"
                crafted.writestr(name, data)
        with pytest.raises(ldtrefl.InputError, match="depth is not as long as it says"):
            ldtrefl.LayeredDepthTexture.load(tmp_path / "c.npz")
    finally:
        budget.set_memory_limit()


@pytest.mark.parametrize("kind", ["link", "dangling link", "pipe"])
def test_what_stands_in_a_files_place_is_replaced_and_not_written_through(cache: MapCache, kind: str) -> None:
    """A link in the cache's folder leads nowhere: its target keeps its bytes, or stays absent."""
    elsewhere = cache.folder.parent / "elsewhere"
    if kind == "link":
        elsewhere.write_bytes(b"mine")
    place = cache.path("a" * 32)
    if kind == "pipe":
        os.mkfifo(place)
    else:
        place.symlink_to(elsewhere)
    assert cache.load("a" * 32) is None
    cache.store("a" * 32, {"x": np.arange(5, dtype=np.int32)}, {})
    assert not place.is_symlink() and place.is_file() and cache.load("a" * 32) is not None
    assert elsewhere.read_bytes() == b"mine" if kind == "link" else not elsewhere.exists()


def test_a_folder_in_a_files_place_is_one_line(cache: MapCache, caplog: pytest.LogCaptureFixture) -> None:
    cache.path("a" * 32).mkdir()
    assert cache.load("a" * 32) is None
    cache.store("a" * 32, {"x": np.arange(5, dtype=np.int32)}, {})
    assert [record.levelno for record in caplog.records] == [logging.WARNING]
    assert cache.path("a" * 32).is_dir() and len(list(cache.folder.iterdir())) == 1
