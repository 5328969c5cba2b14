"""What a picture is of, measured."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl import Mesh, Object
from ldtrefl.scene import subject as module
from ldtrefl.scene.framing import towards
from ldtrefl.scene.subject import LOWER, SUNK, Subject


def measured(points: object) -> Subject:
    return Subject(np.array(points, float))


@pytest.mark.parametrize("most", [10**6, 1])
def test_objects_are_measured_where_they_stand(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a box, the corners of its box say the same as its vertices."""
    monkeypatch.setattr(module, "MOST_POINTS", most)
    subject = Subject.of(
        [
            Object(shape="box", scale=(1.0, 2.0, 3.0), translate=(10.0, 0.0, 4.0)),
            Object(shape="box", scale=0.5, translate=(10.0, 0.0, 8.5)),
        ]
    )
    assert subject.points.min(axis=0).tolist() == [9.0, -2.0, 1.0] and subject.height == 8.0
    assert subject.points.max(axis=0).tolist() == [11.0, 2.0, 9.0]
    corners = np.array([[x, y] for x in (-1.0, 1.0) for y in (-2.0, 2.0)])
    assert subject.width == pytest.approx(np.ptp(corners @ subject.right[:2]))
    assert subject.depth == pytest.approx(np.ptp(corners @ subject.behind[:2]))
    np.testing.assert_allclose(subject.base, [10.0, 0.0, 1.0 - 8.0 * SUNK], atol=1e-3)
    assert subject.base[2] < 1.0 and subject.size == 8.0 and subject.digits == 3


def test_vertices_that_no_triangle_has_do_not_count() -> None:
    mesh = Mesh([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9]], [[0, 1, 2]])
    assert Subject.of([Object(mesh=mesh)]).points.max() == 1.0


def test_nothing_is_no_subject() -> None:
    with pytest.raises(ldtrefl.InputError, match="nothing to be seen"):
        Subject.of([])


def test_its_axes_are_those_of_the_picture() -> None:
    subject = measured([[0.0, 0, 0], [1, 1, 1]])
    np.testing.assert_allclose(np.cross(subject.right, subject.behind), [0.0, 0.0, 1.0], atol=1e-15)
    assert np.vecdot(subject.behind, towards(-32.0, 0.0)) == pytest.approx(-1.0)
    np.testing.assert_allclose(
        subject.at(2.0, 3.0, 1.0), subject.base + 2.0 * subject.right + 3.0 * subject.behind + [0, 0, 1], atol=1e-3
    )


@pytest.mark.parametrize(("point", "size"), [([1.0, 2.0, 3.0], 3e-9), ([0.0, 0.0, 0.0], 1.0)])
def test_a_point_has_a_size_that_a_camera_can_stand_before(point: list[float], size: float) -> None:
    assert measured([point]).size == pytest.approx(size)


def test_a_ball_beside_a_ball_keeps_the_gap() -> None:
    """Two spheres on a floor, of radii R and r, with the gap g: their centres are R + r + g apart."""
    big = Object(shape="sphere", params={"segments": [512, 256]})
    centre = np.array(Subject.of([big]).beside(26.0, 0.4, 0.1, reached_over=True))
    assert centre[2] == pytest.approx(-1.0 + 0.4, abs=3e-3)
    assert np.linalg.norm(centre) == pytest.approx(1.5, abs=2e-3)


def test_a_ball_stands_under_what_reaches_over_it_or_beside() -> None:
    """A table's top, of radius 1 at height 2, on a foot of radius 0.1; a ball of radius 0.2 fits under it."""
    around = np.linspace(0.0, 2.0 * np.pi, 1000)
    ring = np.stack([np.cos(around), np.sin(around), np.zeros(1000)], axis=1)
    table = measured(np.concatenate([0.1 * ring, ring * (1.0, 1.0, 0.0) + (0.0, 0.0, 2.0)]))
    under = np.hypot(*table.beside(10.0, 0.2, 0.1, reached_over=True)[:2])
    assert under == pytest.approx(0.1 + np.sqrt(0.3**2 - 0.2**2), abs=2e-3)
    low = measured(np.concatenate([0.1 * ring, np.add(ring, (0.0, 0.0, 2.0 * LOWER - 0.1)), [[0.0, 0.0, 2.0]]]))
    assert np.hypot(*low.beside(10.0, 0.2, 0.1, reached_over=False)[:2]) == pytest.approx(1.3, abs=2e-3)
    assert np.hypot(*low.beside(10.0, 0.2, 0.1, reached_over=True)[:2]) == pytest.approx(under, abs=2e-3)
