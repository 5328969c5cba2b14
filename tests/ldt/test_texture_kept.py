"""Maps that a layered depth texture keeps on disk: the same answers, and made anew when they are not sound."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.files.map_cache import MapCache, current_cache, keep_maps_in
from ldtrefl.files.map_file import Entry
from ldtrefl.ldt.exact.check import check_tree
from ldtrefl.ldt.peel import check_fragments, check_order
from ldtrefl.ldt.texel_frame import texel_frame
from ldtrefl.ldt.texture import peel_mesh
from ldtrefl.scene import shapes
from ldtrefl.world.device_mesh import DeviceMesh

KNOT = {"segments": [300, 40]}


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


def test_a_damaged_file_is_made_anew(cache: MapCache) -> None:
    mesh = shapes.make("torus_knot", KNOT)
    ldtrefl.peel(mesh.vertices, mesh.faces)
    path, size, _ = cache.files()[0]
    path.write_bytes(path.read_bytes()[: size // 2])
    assert not ldtrefl.peel(mesh.vertices, mesh.faces).from_cache
    assert ldtrefl.peel(mesh.vertices, mesh.faces).from_cache


def test_a_tree_of_other_constants_is_not_taken_for_current(cache: MapCache, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shapes.make("torus_knot", KNOT)
    ldtrefl.peel(mesh.vertices, mesh.faces)
    monkeypatch.setattr("ldtrefl.ldt.exact.build.CELLS_PER_ROOT", 0.05)
    other = ldtrefl.peel(mesh.vertices, mesh.faces)
    assert not other.from_cache and len(cache.files()) == 2


def stored(quality: str = "exact", search: str = "exact", trusted: bool = False) -> tuple[DeviceMesh, Entry, MapCache]:
    """A mesh, and what the cache in use holds of its maps."""
    cache = current_cache()
    assert cache is not None
    geometry = DeviceMesh(shapes.make("torus_knot", {"segments": [130, 40]}), launch.resolve_device("cpu"))
    peel_mesh(geometry, 32, quality=quality, search=search, trusted=trusted)
    entry = cache.load(cache.files()[-1][0].stem)
    assert entry is not None
    return geometry, entry, cache


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
