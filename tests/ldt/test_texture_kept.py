"""Maps that a layered depth texture keeps on disk: the same answers, and made anew when they are not sound."""

import numpy as np
import pytest
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.files.map_cache import MapCache, current_cache
from ldtrefl.files.map_file import Entry
from ldtrefl.ldt.peel import peel_mesh
from ldtrefl.scene import shapes
from ldtrefl.world.device_mesh import DeviceMesh

KNOT = {"segments": [300, 40]}


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
    monkeypatch.setattr("ldtrefl.ldt.exact.binary_tree.CELLS_PER_ROOT", 0.05)
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
