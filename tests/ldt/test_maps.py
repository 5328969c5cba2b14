"""Sorted maps: packed and unpacked, from arrays in any order, and checked before they are read."""

import itertools

import numpy as np
import pytest

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.ldt.maps import Maps, check_fragments, check_order
from ldtrefl.scene import shapes

NAMES = ("start", "depth", "reference")
DEVICE = launch.resolve_device(None)


@pytest.fixture
def texture() -> ldtrefl.LayeredDepthTexture:
    mesh = shapes.make("torus")
    return ldtrefl.peel(mesh.vertices, mesh.faces, 32, search="linear")


def test_packed_maps_are_the_same_maps(texture: ldtrefl.LayeredDepthTexture) -> None:
    arrays, _ = texture.sorted_maps.packed()
    check_fragments(texture.frame, len(texture.geometry.faces), arrays)
    check_order(arrays)
    again = Maps.unpacked(texture.frame, arrays, DEVICE)
    assert again.nbytes == texture.sorted_maps.nbytes
    for name in NAMES:
        np.testing.assert_array_equal(getattr(again, name).numpy(), arrays[name])
    np.testing.assert_array_equal(again.occupancy.cells.numpy(), texture.sorted_maps.occupancy.cells.numpy())


def test_texels_of_arrays_are_sorted(texture: ldtrefl.LayeredDepthTexture) -> None:
    arrays = {name: getattr(texture, name).numpy() for name in NAMES}
    shuffled = {name: array.copy() for name, array in arrays.items()}
    for first, end in itertools.pairwise(arrays["start"]):
        for name in ("depth", "reference"):
            shuffled[name][first:end] = arrays[name][first:end][::-1]
    with pytest.raises(ValueError, match="out of order"):
        check_order(shuffled)
    again = Maps.from_arrays(texture.frame, shuffled, DEVICE)
    for name in NAMES:
        np.testing.assert_array_equal(getattr(again, name).numpy(), arrays[name])


def changed(array: np.ndarray, place: int, value: float) -> np.ndarray:
    """A copy with another number in one place."""
    copied = array.copy()
    copied[place] = value
    return copied


def test_every_array_is_checked(texture: ldtrefl.LayeredDepthTexture) -> None:
    arrays, _ = texture.sorted_maps.packed()
    start, depth, reference = (arrays[name] for name in NAMES)
    count, two = len(texture.geometry.faces), int(np.flatnonzero(np.diff(start) > 1)[0])
    wrong = {
        "start": [
            start[:-1],
            changed(start, 0, 1),
            changed(start, -1, 2**31 - 1),
            changed(start, 5, -(2**31)),
            2 * start,
        ],
        "depth": [depth[:-1], changed(depth, 0, np.nan), depth.astype(np.float64), changed(depth, start[two], 1e9)],
        "reference": [reference[1:], changed(reference, 3, -1), changed(reference, 3, 2 * count)],
    }
    for name, others in wrong.items():
        for other in others:
            with pytest.raises(ValueError):
                check_fragments(texture.frame, count, {**arrays, name: other})
                check_order({**arrays, name: other})
