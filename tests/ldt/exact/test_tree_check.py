"""A tree that comes from a file is checked in every field before a ray may go down it."""

import numpy as np
import pytest

from ldtrefl.device import launch
from ldtrefl.ldt.exact.tree import STACK, TreeValues
from ldtrefl.ldt.exact.tree_check import check_tree
from ldtrefl.ldt.peel import peel_mesh
from ldtrefl.scene import shapes
from ldtrefl.world.device_mesh import DeviceMesh

FAULTS = (ValueError, KeyError, TypeError)


def changed(array: np.ndarray, place: int, value: float) -> np.ndarray:
    """A copy with another number in one place."""
    copied = array.copy()
    copied[place] = value
    return copied


def as_float(bits: int) -> float:
    """The float32 of these bits."""
    return float(np.int32(bits).view(np.float32))


@pytest.fixture(params=[False, True], ids=["triangles", "patches"])
def packed(request: pytest.FixtureRequest) -> tuple[dict[str, np.ndarray], TreeValues, int]:
    """A sound tree, and the number of its mesh's triangles."""
    geometry = DeviceMesh(shapes.make("torus_knot", {"segments": [130, 40]}), launch.resolve_device("cpu"))
    quality = "balanced" if request.param else "exact"
    tree = peel_mesh(geometry, 32, quality=quality, trusted=request.param).tree
    assert tree.patches == request.param
    return *tree.packed(), len(geometry.faces)


def test_every_array_is_checked(packed: tuple[dict[str, np.ndarray], TreeValues, int]) -> None:
    arrays, values, count = packed
    check_tree(arrays, values, count)
    nodes, rows = arrays["nodes"], arrays["rows"]
    children = np.ascontiguousarray(nodes.reshape(-1, 56)[:, 48:]).view(np.int32)
    boxes = nodes.reshape(-1, 56)[:, :8]
    of_block, lane = np.argwhere(children < 0)[-1]
    block = 56 * int(of_block) + 48 + int(lane)
    code = int(~children[of_block, lane])
    inner = 48 + int(np.flatnonzero((children[0] > 0) & (boxes[0] < 1e29))[0])
    unused = np.argwhere(boxes > 1e29)[0]
    number = 8 * ((code >> 1) + (6 if code & 1 else 9))
    wrong = {
        "nodes": [nodes[:-56], nodes[:-1], nodes[:0], nodes.astype(np.float64), nodes.reshape(1, -1)]
        + [changed(nodes, block, as_float(~bits)) for bits in (code + 2, code ^ 1, 2**31 - 1, code - 2, 0)]
        + [changed(nodes, block, as_float(child)) for child in (0, len(children) - 1, len(children), 2**30)]
        + [changed(nodes, inner, as_float(child)) for child in (0, len(children), 2**30, -(2**31))]
        + [changed(nodes, 56 * int(unused[0]) + int(unused[1]), 0.0)],
        "rows": [rows[:-8], rows[:-80], rows[:-1], rows.astype(np.float64), rows.reshape(2, -1)]
        + [changed(rows, number, as_float(bits)) for bits in (count, 2**30, -1, -(2**31))],
    }
    for name, others in wrong.items():
        for other in others:
            with pytest.raises(FAULTS):
                check_tree({**arrays, name: other}, values, count)
        with pytest.raises(KeyError):
            check_tree({n: a for n, a in arrays.items() if n != name}, values, count)


def test_every_value_is_checked(packed: tuple[dict[str, np.ndarray], TreeValues, int]) -> None:
    arrays, values, count = packed
    wrong: dict[str, list] = {
        "low": [[0.0, float("nan"), 0.0], [1e30] * 3, [99.0] * 3, "low"],
        "high": [[float("inf")] * 3, [-99.0] * 3, [0.0, 0.0]],
        "front": [0.5, float("nan"), None],
        "half_patch": [-1.0, float("inf")] + ([0.0] if values["half_patch"] > 0.0 else []),
        "horizon": [-1.0, float("nan")] + ([0.0, 1e-30] if values["front"] else []),
        "records": [-1, 1.5, 2**40, True],
    }
    assert set(wrong) == set(values)
    for name, others in wrong.items():
        for value in others:
            with pytest.raises(FAULTS):
                check_tree(arrays, {**values, name: value}, count)
        with pytest.raises(KeyError):
            check_tree(arrays, {n: v for n, v in values.items() if n != name}, count)


@pytest.mark.parametrize("depth", [STACK // 8, STACK // 8 + 1])
def test_a_tree_may_be_as_deep_as_the_stack_allows(depth: int) -> None:
    """Nodes one in the other: a ray may have to come back to eight children of each."""
    nodes = np.zeros((depth, 56), np.float32)
    nodes[:, 8:16] = nodes[:, 24:32] = nodes[:, 40:48] = 1.0
    children = nodes[:, 48:].view(np.int32)
    blocks = np.arange(7 * depth).reshape(depth, 7)
    children[:, :7] = ~(2 * 10 * blocks)
    children[:, 7] = np.arange(1, depth + 1)
    children[-1, 7] = ~(2 * 10 * 7 * depth)
    rows = np.zeros((70 * depth + 10) * 8, np.float32)
    values: TreeValues = {
        "low": [0.0] * 3,
        "high": [1.0] * 3,
        "front": 0.0,
        "half_patch": 0.0,
        "horizon": 0.0,
        "records": 1,
    }
    arrays = {"nodes": nodes.reshape(-1), "rows": rows}
    if 8 * depth <= STACK:
        check_tree(arrays, values, 1)
    else:
        with pytest.raises(ValueError, match="more to come back to"):
            check_tree(arrays, values, 1)
