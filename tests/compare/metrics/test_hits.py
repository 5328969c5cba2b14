"""Errors of hits, against errors that are planted and known on paper."""

import numpy as np
import pytest

from ldtrefl.compare.metrics import hit_errors
from tests.compare.metrics.first_hits import first_hits

TEXELS = np.array([0.25, 2.0])
"""Lengths in the world of a texel of two objects."""


def ten_by_ten() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Objects, distances and mask of a picture: 50 rays meet object 0, 10 object 1, 20 nothing; 20 are masked out."""
    objects = np.full(100, -1)
    objects[:50], objects[50:60] = 0, 1
    objects[80:] = 0
    distance = np.where(objects >= 0, 3.0 + 0.01 * np.arange(100), np.inf)
    mask = np.arange(100) < 80
    return objects.reshape(10, 10), distance.reshape(10, 10), mask.reshape(10, 10)


def test_hits_misses_and_objects_that_are_wrong_are_counted() -> None:
    objects, distance, mask = ten_by_ten()
    truth = first_hits(objects, distance)
    assert vars(hit_errors(truth, truth, TEXELS, mask)) == dict.fromkeys(
        ("wrong_hits", "wrong_misses", "wrong_objects", "median", "p99"), 0.0
    )
    changed, along = objects.copy().ravel(), distance.copy().ravel()
    changed[60:63], along[60:63] = (0, 1, 0), 5.0  # nothing is there
    changed[[0, 1, 2, 50, 51, 52]], along[[0, 1, 2, 50, 51, 52]] = -1, np.inf
    changed[[10, 55]] = (1, 0)  # the other object, at the very distance
    changed[80:90], along[80:90] = -1, np.inf  # outside the mask
    changed[90:], along[90:] = 1, 1.0
    found = hit_errors(first_hits(changed.reshape(10, 10), along.reshape(10, 10)), truth, TEXELS, mask)
    assert found.wrong_hits == pytest.approx(100 * 3 / 60)
    assert found.wrong_misses == pytest.approx(100 * 6 / 60)
    assert found.wrong_objects == pytest.approx(100 * 2 / 60)
    assert found.median == found.p99 == 0.0


def test_distances_are_in_texels_of_the_object_that_is_truly_hit() -> None:
    """200 rays off by 0.00 to 1.99 texels, this way and that: the ranks of the median and the 99th percentile."""
    count = 200
    objects = (np.arange(count) % 2).reshape(10, 20)
    distance = np.full(objects.shape, 7.0)
    off = 0.01 * np.random.default_rng(0).permutation(count).reshape(objects.shape)
    sign = np.where(np.arange(count).reshape(objects.shape) % 3 == 0, 1.0, -1.0)
    moved = first_hits(objects, distance + sign * off * TEXELS[objects])
    found = hit_errors(moved, first_hits(objects, distance), TEXELS, np.ones(objects.shape, bool))
    assert found.median == pytest.approx(0.99, abs=1e-4)
    assert found.p99 == pytest.approx(1.97, abs=1e-4)
    assert found.wrong_hits == found.wrong_misses == found.wrong_objects == 0.0


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_distances_that_are_no_numbers_are_infinite_errors(value: float) -> None:
    objects, distance, mask = ten_by_ten()
    truth = first_hits(objects, distance)
    some, most = distance.copy(), distance.copy()
    some[0, 0] = value
    most[:4] = value
    found = hit_errors(first_hits(objects, some), truth, TEXELS, mask)
    assert found.median == 0.0 and found.p99 == np.inf
    assert hit_errors(first_hits(objects, most), truth, TEXELS, mask).median == np.inf


def test_where_the_truth_hits_nothing() -> None:
    nothing, distance = np.full((4, 4), -1), np.full((4, 4), np.inf)
    truth, mask = first_hits(nothing, distance), np.ones((4, 4), bool)
    same = hit_errors(truth, truth, TEXELS, mask)
    assert same.wrong_hits == same.wrong_misses == same.wrong_objects == 0.0 and np.isnan(same.median)
    one = nothing.copy()
    one[1, 1] = 0
    assert hit_errors(first_hits(one, np.full((4, 4), 1.0)), truth, TEXELS, mask).wrong_hits == np.inf
    # All are missed: no distance is compared, and none is right by that.
    missed = hit_errors(truth, first_hits(one, np.full((4, 4), 1.0)), TEXELS, mask)
    assert missed.wrong_misses == 100.0 and np.isnan(missed.p99)
