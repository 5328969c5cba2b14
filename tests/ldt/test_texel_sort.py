"""Fragments in their texels: sorted, however many there are."""

import itertools

import numpy as np

import ldtrefl


def test_texels_are_sorted_by_depth_then_triangle() -> None:
    """Random triangles stacked hundreds deep, many with equal depths: long texels go through heap sort."""
    rng = np.random.default_rng(1)
    height = np.repeat(rng.integers(0, 60, 300) / 30.0, 3)
    xy = np.tile(np.array([[-1, -1], [3, -1], [-1, 3]], float), (300, 1))
    maps = ldtrefl.peel(np.column_stack([xy, height]), np.arange(900).reshape(-1, 3), resolution=16)
    start, depth, reference = (x.numpy() for x in (maps.start, maps.depth, maps.reference))
    assert np.diff(start).max() == 300
    for first, end in itertools.pairwise(start):
        order = np.lexsort((reference[first:end], depth[first:end]))
        np.testing.assert_array_equal(order, np.arange(end - first))
