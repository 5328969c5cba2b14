"""The search for reflections: what it finds on ellipsoids, and when it ends.

Alhazen's problem is in ``test_reflection_point.py``.
"""

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.methods.virtual.ellipsoids import directions, dots, grazing_pairs, heights_between, random_pairs, reflections


@pytest.mark.parametrize("axes", [(1.0, 1.0, 1.0), (1.0, 1.3, 1.6), (1.0, 1.0, 2.5), (1.0, 1.0, 0.3)])
@pytest.mark.parametrize("pairs", [random_pairs, grazing_pairs])
def test_points_are_found_on_ellipsoids(axes: tuple[float, float, float], pairs: object) -> None:
    assert callable(pairs)
    eyes, points = pairs(4000)
    found = reflections(axes, eyes * axes, points * axes)
    is_found = found["is_found"] == 1
    print(axes, pairs.__name__, is_found.mean(), np.percentile(found["iterations"], [5, 50, 95, 99]))
    round_enough = max(axes) / min(axes) <= 2.0
    assert is_found.mean() >= (0.999 if round_enough else 0.98)
    assert found["residual"][is_found].max() <= 1e-5
    assert np.median(found["iterations"]) <= 10 and found["iterations"].max() <= 20
    on_surface = np.linalg.norm(found["point"] / axes, axis=1)
    assert np.allclose(on_surface[is_found], 1.0, atol=1e-12)


def test_what_is_found_is_the_shortest_way() -> None:
    axes = np.array([1.0, 1.3, 0.8])
    eyes, points = random_pairs(60)
    eyes, points = eyes * axes, points * axes
    found = reflections((1.0, 1.3, 0.8), eyes, points)

    def length(angles: np.ndarray, eye: np.ndarray, point: np.ndarray) -> float:
        polar, around = angles
        at = axes * [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)]
        return float(np.linalg.norm(at - eye) + np.linalg.norm(at - point))

    for i in range(len(eyes)):
        start = found["point"][i] / axes
        angles = [np.arccos(np.clip(start[2], -1.0, 1.0)) + 0.02, np.arctan2(start[1], start[0]) - 0.02]
        best = minimize(length, angles, (eyes[i], points[i]), method="Nelder-Mead", options={"xatol": 1e-10})
        here = np.linalg.norm(found["point"][i] - eyes[i]) + np.linalg.norm(found["point"][i] - points[i])
        assert here <= best.fun + 1e-9


def test_what_stands_behind_is_not_found() -> None:
    eyes, points = (3.0 * directions(2000) for _ in range(2))
    is_hidden = heights_between(eyes, points) < 0.0
    found = reflections((1.0, 1.0, 1.0), eyes[is_hidden], points[is_hidden])
    assert is_hidden.sum() > 100 and not found["is_found"].any()


def test_points_inside_see_the_inside() -> None:
    eyes, points = (0.5 * directions(1000) for _ in range(2))
    found = reflections((1.0, 1.0, 1.0), eyes, points)
    assert found["is_found"].mean() > 0.85  # the paper's second zone is unstable
    outside = reflections((1.0, 1.0, 1.0), 3.0 * eyes, points)
    assert not outside["is_found"].any()


def test_a_search_ends_when_it_may() -> None:
    eyes, points = random_pairs(2000)
    exact = reflections((1.0, 1.0, 1.0), eyes, points)
    short = reflections((1.0, 1.0, 1.0), eyes, points, most_iterations=3)
    early = reflections((1.0, 1.0, 1.0), eyes, points, least_solid_angle=1e-6)
    assert short["iterations"].max() == 3 and short["is_found"].mean() < 0.5
    assert early["iterations"].mean() < exact["iterations"].mean() - 1.0


def test_the_search_of_an_open_surface_stays_on_it() -> None:
    # The lower three quarters of a sphere, seen from outside: what the whole sphere mirrors there is found.
    eyes, points = random_pairs(4000)
    whole = reflections((1.0, 1.0, 1.0), eyes, points)
    is_there = (whole["is_found"] == 1) & (whole["point"][:, 2] < 0.4)
    is_gone = (whole["is_found"] == 1) & (whole["point"][:, 2] > 0.5)
    part = reflections((1.0, 1.0, 1.0), eyes, points, highest=0.5)
    assert part["is_found"][is_there].mean() > 0.97
    assert part["point"][is_there & (part["is_found"] == 1), 2].max() <= 0.5
    # Where the cap is gone some see the inside by the opening; nothing else is found.
    found = part[is_gone & (part["is_found"] == 1)]
    assert len(found) and np.all(dots(found["normal"], eyes[is_gone & (part["is_found"] == 1)] - found["point"]) < 0.0)
