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
    reach = [subject.points.min(axis=0), subject.points.max(axis=0)]
    np.testing.assert_allclose(reach, [[9.0, -2.0, 1.0], [11.0, 2.0, 9.0]], rtol=1e-12)
    assert subject.height == pytest.approx(8.0)
    corners = np.array([[x, y] for x in (-1.0, 1.0) for y in (-2.0, 2.0)])
    assert subject.width == pytest.approx(np.ptp(corners @ subject.right[:2]))
    assert subject.depth == pytest.approx(np.ptp(corners @ subject.behind[:2]))
    np.testing.assert_allclose(subject.base, [10.0, 0.0, 1.0 - 8.0 * SUNK], atol=1e-3)
    assert subject.base[2] < 1.0 and subject.size == pytest.approx(8.0) and subject.digits == 3


def test_large_triangles_are_measured_inside() -> None:
    """No point of a box is farther from all that is measured than a few hundredths of its size."""
    points = Subject.of([Object(shape="box", translate=(1e3, 0.0, 0.0))]).points
    rng = np.random.default_rng(0)
    sides = rng.uniform(-1.0, 1.0, (200, 3))
    sides[np.arange(200), rng.integers(0, 3, 200)] = rng.choice([-1.0, 1.0], 200)
    distances = np.linalg.norm(points[None] - np.add(sides, (1e3, 0.0, 0.0))[:, None], axis=2).min(axis=1)
    assert distances.max() < 0.05 and len(points) < 200_000
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [[999, -1, -1], [1001, 1, 1]], rtol=1e-12)


def test_many_large_triangles_do_not_take_the_memory() -> None:
    rng = np.random.default_rng(0)
    mesh = Mesh(rng.normal(size=(3 * 20_000, 3)), np.arange(3 * 20_000).reshape(-1, 3))
    assert len(Subject.of([Object(mesh=mesh)]).points) < 2_000_000


def test_of_many_small_objects_the_corners_are_measured() -> None:
    small = {"shape": "box", "scale": 1e-3}
    subject = Subject.of([Object(translate=(float(x), 0.0, 0.0), **small) for x in range(10)])
    assert len(subject.points) == 10 * 24 and subject.size == pytest.approx(9.0 * np.cos(np.radians(32.0)), abs=3e-3)


def test_a_ball_does_not_stand_in_a_wall() -> None:
    """A box whose side is as wide as the ball's way: in front of its middle it stands off the side."""
    box = Object(shape="box", rotate=(0.0, 0.0, 1.0, -32.0))  # its sides face right and behind
    subject = Subject.of([box])
    for reached_over in (False, True):
        centre = np.array(subject.beside(0.0, 0.2, 0.1, reached_over=reached_over))
        np.testing.assert_allclose(centre - subject.base, [*(1.3 * subject.right[:2]), 0.2], atol=3e-3)


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


def test_what_is_far_away_has_a_size_that_a_camera_can_stand_before() -> None:
    assert measured([[1.0, 2.0, 3e6], [1.0, 2.0, 3e6]]).size == pytest.approx(3e-6)


def test_one_point_is_no_subject() -> None:
    mesh = Mesh([[5.0, 5.0, 5.0]] * 3, [[0, 1, 2]])
    with pytest.raises(ldtrefl.InputError, match="all is in one point"):
        Subject.of([Object(mesh=mesh)])


def test_a_ball_beside_a_ball_keeps_the_gap() -> None:
    """Two spheres on a floor, of radii R and r, with the gap g: their centres are R + r + g apart."""
    big = Object(shape="sphere", params={"segments": [512, 256]})
    centre = np.array(Subject.of([big]).beside(26.0, 0.4, 0.1, reached_over=True))
    assert centre[2] == pytest.approx(-1.0 + 0.4, abs=3e-3)
    assert np.linalg.norm(centre) == pytest.approx(1.5, abs=3e-3)


def test_a_ball_stands_under_what_reaches_over_it_or_beside() -> None:
    """A table's top, of radius 1 at height 2, on a foot of radius 0.1; a ball of radius 0.2 fits under it."""
    around = np.linspace(0.0, 2.0 * np.pi, 1000)
    ring = np.stack([np.cos(around), np.sin(around), np.zeros(1000)], axis=1)
    table = measured(np.concatenate([0.1 * ring, ring * (1.0, 1.0, 0.0) + (0.0, 0.0, 2.0)]))
    under = np.hypot(*table.beside(10.0, 0.2, 0.1, reached_over=True)[:2])
    assert under == pytest.approx(0.1 + np.sqrt(0.3**2 - 0.2**2), abs=3e-3)
    low = measured(np.concatenate([0.1 * ring, np.add(ring, (0.0, 0.0, 2.0 * LOWER - 0.1)), [[0.0, 0.0, 2.0]]]))
    assert np.hypot(*low.beside(10.0, 0.2, 0.1, reached_over=False)[:2]) == pytest.approx(1.3, abs=3e-3)
    assert np.hypot(*low.beside(10.0, 0.2, 0.1, reached_over=True)[:2]) == pytest.approx(under, abs=3e-3)
