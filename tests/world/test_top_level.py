"""The tree over all objects: spheres lie in those above them, objects are reached once, and few nodes are looked at."""

import numpy as np
import pytest

from ldtrefl.device import launch
from ldtrefl.world.top_level import GROUP, STACK, order_of, top_level


def made(centres: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, int]:
    """(nodes as a structured array, the root's number)."""
    top = top_level(centres, radii.astype(np.float32), order_of(centres), launch.resolve_device(None))
    return top.nodes.numpy(), top.root


def spheres(count: int, seed: int, spread: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return spread * rng.normal(size=(count, 3)), 10.0 ** rng.uniform(-6, 0, count)


@pytest.mark.parametrize("count", [1, 2, 8, 9, 64, 65, 1000])
def test_spheres_hold_what_is_below_them_and_objects_are_reached_once(count: int) -> None:
    centres, radii = spheres(count, count)
    nodes, root = made(centres, radii)
    reached, waiting, most = [], [root], 0
    while waiting:
        most = max(most, len(waiting))
        node = nodes[waiting.pop()]
        children = np.arange(node["first"], node["first"] + node["count"])
        assert 1 <= len(children) <= GROUP
        apart = np.linalg.norm(nodes["centre"][children] - node["centre"], axis=1)
        assert (apart + nodes["radius"][children].astype(float) <= float(node["radius"])).all()
        for child in children.tolist():
            if nodes["count"][child]:
                waiting.append(child)
            else:
                k = nodes["first"][child]
                reached.append(k)
                np.testing.assert_array_equal(nodes["centre"][child], centres[k])
                assert nodes["radius"][child] == radii.astype(np.float32)[k]
    assert sorted(reached) == list(range(count)) and most < int(STACK)


def test_no_objects_have_no_root() -> None:
    nodes, root = made(np.zeros((0, 3)), np.zeros(0))
    assert root == -1 and len(nodes) == 0


def test_a_ray_through_many_objects_looks_at_few_nodes() -> None:
    """A million sizes away stands another object: the tree of the others is as good as without it."""
    centres = np.random.default_rng(1).uniform(-1, 1, (10_000, 3))
    for far in (np.zeros((0, 3)), np.array([[1e6, -2e6, 3e6]])):
        everything = np.vstack([centres, far])
        nodes, root = made(everything, np.full(len(everything), 0.01))
        origin, direction = np.array([-4.0, 0.1, 0.2]), np.array([1.0, 0.02, -0.05])
        direction /= np.linalg.norm(direction)
        aside = np.linalg.norm(np.cross(nodes["centre"] - origin, direction), axis=1) <= nodes["radius"]
        looked_at, waiting = 0, [root]
        while waiting:
            node = nodes[waiting.pop()]
            children = np.arange(node["first"], node["first"] + node["count"])
            looked_at += len(children)
            waiting += [c for c in children.tolist() if aside[c] and nodes["count"][c]]
        assert looked_at < 1500


@pytest.mark.parametrize("count", [0, 1, 8, 9, 71, 512, 513, 5000])
def test_the_order_names_each_object_once_and_keeps_neighbours_together(count: int) -> None:
    """On a jittered floor the eight of a node span about the side of eight cells, and the 64 of eight nodes of 64."""
    places = np.random.default_rng(count).uniform(0, 1, (count, 3)) * [1.0, 1.0, 1e-6]
    order = order_of(places)
    assert sorted(order.tolist()) == list(range(count))
    for size in (8, 64):
        groups = [places[order[k : k + size]] for k in range(0, count - size + 1, size)]
        if len(groups) > 7:
            sides = np.array([(group.max(axis=0) - group.min(axis=0)).max() for group in groups])
            assert np.median(sides) < 2.5 * np.sqrt(size / count)


def test_an_order_of_before_a_move_serves_after_it() -> None:
    centres, radii = spheres(300, 4)
    order, device = order_of(centres), launch.resolve_device(None)
    moved = centres + np.random.default_rng(0).normal(size=centres.shape)
    nodes = top_level(moved, radii.astype(np.float32), order, device).nodes.numpy()
    for node in nodes[nodes["count"] > 0]:
        children = nodes[node["first"] : node["first"] + node["count"]]
        apart = np.linalg.norm(children["centre"] - node["centre"], axis=1)
        assert (apart + children["radius"].astype(float) <= float(node["radius"])).all()
