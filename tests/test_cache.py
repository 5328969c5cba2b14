"""Maps on disk: the same answers, whole or absent, never trusted when damaged, and no more than the limit."""

import logging
import multiprocessing
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from stress_cases.judge import rays_about

import ldtrefl
from ldtrefl import shapes
from ldtrefl.cache import HEADER, MapCache, keep_maps_in, key_of
from ldtrefl.cli import main

from .conftest import SMALL_SCENE

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


def test_keys_tell_arrays_and_options_apart() -> None:
    a, b = np.arange(6.0), np.arange(6.0).reshape(2, 3)
    keys = {key_of([a], {}), key_of([b], {}), key_of([a, a], {}), key_of([a], {"r": 1}), key_of([a + 1e-12], {})}
    assert len(keys) == 5 and key_of([a.copy()], {}) in keys


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
