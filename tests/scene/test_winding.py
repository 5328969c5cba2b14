"""Which triangles are wound the other way than most of their part of the surface."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.scene.winding import turned_triangles
from tests.scene.sheets import sheet

TORUS = np.arange(24 * 10).reshape(24, 10)
"""Places of a torus, row by row."""


def torus() -> np.ndarray:
    """(480, 3) triangles of a torus, wound alike."""
    a, b = TORUS, np.roll(TORUS, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(TORUS, -1, axis=1)
    return np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)


def turned(faces: np.ndarray, which: np.ndarray) -> np.ndarray:
    return np.where(which[:, None], faces[:, ::-1], faces)


@pytest.mark.parametrize("faces", [torus(), sheet()[1]], ids=["torus", "sheet"])
def test_the_smaller_number_is_turned(faces: np.ndarray) -> None:
    rng = np.random.default_rng(3)
    assert not turned_triangles(faces).any()
    for share in (0.05, 0.3, 0.7):
        which = rng.random(len(faces)) < share
        smaller = which if which.mean() < 0.5 else ~which
        np.testing.assert_array_equal(turned_triangles(turned(faces, which)), smaller)


def test_each_part_by_itself() -> None:
    """Parts that share no edge have nothing to agree about: one inside out stays so."""
    one, other = torus(), torus() + TORUS.size
    faces = np.concatenate([one, turned(other, np.arange(len(other)) != 7)])
    np.testing.assert_array_equal(turned_triangles(faces), np.arange(len(faces)) == len(one) + 7)


def test_of_as_many_as_are_not_the_first_stays() -> None:
    np.testing.assert_array_equal(turned_triangles(np.array([[0, 1, 2], [1, 2, 3]])), [False, True])


def test_what_has_no_two_sides_stays_as_it_is() -> None:
    """A Moebius strip of 12 quadrilaterals; beside it, a triangle of a torus is turned."""
    rows = np.array([[k, k + 12] for k in range(12)] + [[12, 0]])
    a, b, c, d = rows[:-1, 0], rows[1:, 0], rows[1:, 1], rows[:-1, 1]
    strip = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    assert not turned_triangles(strip).any()
    beside = turned(torus() + 24, np.arange(480) == 5)
    np.testing.assert_array_equal(turned_triangles(np.concatenate([strip, beside])), np.arange(504) == 24 + 5)


def test_edges_of_more_than_two_triangles_say_nothing() -> None:
    """Three leaves at an edge, each two triangles: of one of them the second is turned."""
    leaves = np.array([[0, k, k + 1] for k in (2, 4, 6)] + [[0, k + 1, 1] for k in (2, 4, 6)])
    assert not turned_triangles(leaves).any()
    found = turned_triangles(turned(leaves, np.arange(6) == 4))
    np.testing.assert_array_equal(found, np.arange(6) == 4)


def test_triangles_that_were_modelled_twice_lie_on_themselves() -> None:
    _, faces = sheet()
    for copies in (faces, np.roll(faces, 1, axis=1), faces[:, ::-1]):
        assert not turned_triangles(np.concatenate([faces, copies])).any()


def test_triangles_without_area_do_no_harm() -> None:
    points = np.array([[3, 3, 7], [5, 5, 5], [7, 3, 3]])
    which = np.arange(480) == 9
    found = turned_triangles(np.concatenate([turned(torus(), which), points]))
    np.testing.assert_array_equal(found[:480], which)


def test_memory_is_asked_for() -> None:
    budget.set_memory_limit(1000)
    with pytest.raises(ldtrefl.InputError, match="the winding of triangles needs"):
        turned_triangles(torus())
