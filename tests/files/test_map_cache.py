"""The folder of maps: damaged files, its limit, its names, several writers, and whose it is."""

import logging
import multiprocessing
import os
import shutil
import stat
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.files.map_cache import MapCache, key_of


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
