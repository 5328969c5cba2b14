"""Scenes of things that touch: they do, all of them is scaled alike, and edges are where pictures change."""

import dataclasses

import numpy as np
import pytest
from stress_cases.contact import OFF, judged
from stress_cases.paths import Paths, paths_of
from stress_cases.touching import ASIDE, FAR_LARGER, TOUCHING, near_edges, touching


def lowest(what: str) -> float:
    """How high above the floor, or the bottom of the bowl, the lowest point of what stands on it is."""
    heights = []
    for entry in touching(what, 4).objects:
        place, mesh = entry.world_from_object(), entry.geometry
        if np.ptp(mesh.vertices[:, 2]) > 0 and entry.shape != "bowl" and entry.name != "lamp":
            heights.append((mesh.vertices @ place[:3, :3].T + place[:3, 3])[:, 2].min())
    return max(map(abs, heights))


@pytest.mark.parametrize("what", TOUCHING)
def test_things_touch(what: str) -> None:
    assert lowest(what) < 1e-15


def test_all_is_scaled_and_a_floor_alone_is_larger() -> None:
    """The same paths at any size; on a floor that is larger and stands elsewhere the same but for its edges."""
    what = "mirror box on a mirror floor"
    truth = paths_of(touching(what, 24), 3)
    for size in (1e-4, 1e4):
        paths = paths_of(touching(what, 24, size=size), 3)
        np.testing.assert_allclose(paths.image, truth.image, rtol=1e-9)
        np.testing.assert_allclose(paths.ends[0].distance, size * truth.ends[0].distance, rtol=1e-9)
    far = paths_of(touching(what, 24, floor=FAR_LARGER, aside=ASIDE), 3)
    on_floor = truth.ends[0].object == 0
    assert on_floor.sum() > 50 and (far.ends[0].object[on_floor] == 0).all()
    np.testing.assert_allclose(far.ends[0].distance[on_floor], truth.ends[0].distance[on_floor], rtol=1e-7)


def test_edges_are_where_paths_meet_other_things() -> None:
    scene = touching("ball on a mirror floor", 24)
    paths = paths_of(scene, 2)
    near, seen = near_edges(scene, paths), paths.ends[0].object
    assert 0.05 < near.mean() < 0.6
    changes = seen[:, 1:] != seen[:, :-1]
    assert changes.any() and near[:, 1:][changes].all() and near[:, :-1][changes].all()
    for y, x in np.argwhere(~near):
        about = (slice(max(y - 1, 0), y + 2), slice(max(x - 1, 0), x + 2))
        assert all(len(np.unique(ends.object[about])) == 1 for ends in paths.ends)


def test_a_ring_of_light_is_found() -> None:
    """Pixels away from every edge that are too bright; those at an edge do not count."""
    scene = touching("ball on a mirror floor", 24)
    paths = paths_of(scene, 4)
    near = near_edges(scene, paths)
    passed = {outcome.by: outcome for outcome in judged("", scene, paths, near)}
    assert all(outcome.passed and outcome.disagree == 0 for by, outcome in passed.items() if by != "linear")
    for where, expected in ((~near, 1), (near, 0)):
        image = paths.image.copy()
        image[tuple(np.argwhere(where)[5])] += 2 * OFF
        spoilt: Paths = dataclasses.replace(paths, image=image)
        found = {outcome.by: outcome for outcome in judged("", scene, spoilt, near)}
        assert found["bvh"].disagree == expected and found["bvh"].passed == (expected == 0)
