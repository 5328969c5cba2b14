"""Polygons become triangles of the right area, in the file's order, with the file's winding."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.readers.polygons import triangles_of

NOTCHED = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [1, 0.5, 0], [0, 2, 0]]
"""A square of 2 less a triangle of 1.5 cut from above: area 2.5."""
ARROW = [[0, 0, 0], [1, 0.5, 0], [2, 0, 0], [1, 2, 0]]
"""Four corners, the second points inwards: area 1.5."""
SQUARE = [[3, 0, 0], [4, 0, 0], [4, 1, 0], [3, 1, 0]]
TRIANGLE = [[5, 0, 0], [6, 0, 0], [5, 1, 0]]


def areas(points: np.ndarray, triangles: np.ndarray) -> tuple[float, np.ndarray]:
    """(sum of the triangles' areas, sum of their area vectors)."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    across = np.cross(b - a, c - a) / 2
    return float(np.linalg.norm(across, axis=1).sum()), across.sum(axis=0)


@pytest.mark.parametrize("turn", range(5))
@pytest.mark.parametrize("polygon, area", [(NOTCHED, 2.5), (ARROW, 1.5), (SQUARE, 1.0)])
def test_area_and_winding_whichever_corner_comes_first(polygon: list, area: float, turn: int) -> None:
    for points in (np.roll(polygon, turn, axis=0), np.roll(polygon, turn, axis=0)[::-1]):
        triangles = triangles_of(points.astype(float), np.array([len(points)]))
        unsigned, signed = areas(points, triangles)
        np.testing.assert_allclose(unsigned, area)
        np.testing.assert_allclose(np.abs(signed), [0, 0, area])
        assert set(triangles.reshape(-1)) == set(range(len(points)))


def test_random_stars_in_any_plane() -> None:
    """The area vector of a flat polygon is that of Newell's formula, however it is cut."""
    rng = np.random.default_rng(1)
    for count in (5, 6, 9, 50):
        angles = 2 * np.pi * (np.arange(count) + rng.uniform(0.1, 0.9, count)) / count
        flat = rng.uniform(0.1, 1.0, count) * np.stack([np.cos(angles), np.sin(angles)])
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        points = (turn[:, :2] @ flat).T + 1000.0
        triangles = triangles_of(points, np.array([count]))
        x, y = flat
        area = 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
        unsigned, signed = areas(points, triangles)
        assert len(triangles) == count - 2
        np.testing.assert_allclose(unsigned, area, rtol=1e-9)
        np.testing.assert_allclose(signed, area * np.cross(turn[:, 0], turn[:, 1]), atol=1e-9)


def test_corners_on_a_line_stay_joined_to_their_neighbours() -> None:
    """A neighbour may have a corner there: every edge of the polygon is an edge of one triangle."""
    points = np.array(
        [[0, 0, 0], [0.5, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0], [1, 0.5, 0], [0, 2, 0]], float
    )
    triangles = triangles_of(points, np.array([8]))
    edges = [(int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3)]
    assert all(edges.count((k, (k + 1) % 8)) == 1 for k in range(8))
    np.testing.assert_allclose(areas(points, triangles)[0], 2.5)


@pytest.mark.parametrize(
    "points", [[[1, 1, 1]] * 6, [[k, 0, 0] for k in range(6)], [[0, 0, 0], [2, 2, 0], [2, 0, 0], [0, 2, 0]]]
)
def test_polygons_without_an_inside_still_give_their_triangles(points: list) -> None:
    assert triangles_of(np.array(points, float), np.array([len(points)])).shape == (len(points) - 2, 3)


def test_the_time_to_cut_polygons_is_bounded() -> None:
    """Refused by what is known before any is cut."""
    x = np.linspace(0, 1, 20_000)
    saw = np.stack([x, 0.1 * (np.arange(len(x)) % 2), 0 * x], 1)
    saw[[0, -1], 1] = 1.0
    with pytest.raises(ldtrefl.InputError, match="not convex have too many corners"):
        triangles_of(saw, np.array([len(saw)]))
