"""The wide tree: sound for every mesh, and halves where boxes lie in boxes too deep to come back to."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.ldt.exact import wide_tree
from ldtrefl.ldt.exact.tree import LANES, TRIANGLE_NUMBER_ROW, TRIANGLE_ROWS
from ldtrefl.ldt.exact.tree_check import check_tree
from ldtrefl.scene import shapes


def nested_triangles(count: int) -> ldtrefl.Mesh:
    """Triangles about one corner, each 1.5 times as large as the one inside it."""
    sizes = 1.5 ** -np.arange(count)[:, None, None]
    corners = sizes * np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.1, 1.0, 0.3]])
    return ldtrefl.Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


@pytest.mark.parametrize("mesh", [shapes.make("box"), shapes.make("torus_knot"), nested_triangles(200)])
def test_trees_are_sound_and_hold_every_triangle_once(mesh: ldtrefl.Mesh) -> None:
    arrays, values = ldtrefl.peel(mesh.vertices, mesh.faces, quality="exact").tree.packed()
    check_tree(arrays, values, len(mesh.faces))
    blocks = arrays["rows"].reshape(-1, int(TRIANGLE_ROWS), int(LANES))
    numbers = blocks[:, int(TRIANGLE_NUMBER_ROW)].view(np.int32)[~np.isnan(blocks[:, 0])]
    np.testing.assert_array_equal(np.sort(numbers), np.arange(len(mesh.faces)))
    assert values["records"] == len(mesh.faces)


def test_a_tree_that_is_too_deep_is_built_by_halves(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shapes.make("torus_knot")
    expected = ldtrefl.peel(mesh.vertices, mesh.faces, quality="exact")
    tried, build = [], wide_tree.wide_tree

    def first_too_deep(*given: object) -> object:
        tried.append(given)
        return None if len(tried) == 1 else build(*given)

    monkeypatch.setattr("ldtrefl.ldt.exact.build.wide_tree", first_too_deep)
    halved = ldtrefl.peel(mesh.vertices, mesh.faces, quality="exact")
    arrays, values = halved.tree.packed()
    check_tree(arrays, values, len(mesh.faces))
    assert len(tried) == 2 and not np.array_equal(arrays["rows"], expected.tree.view.rows.numpy())
    rays = np.random.default_rng(0).normal(size=(2, 1000, 3)).astype(np.float32)
    origins, directions = 3.0 * rays[0], rays[1] - 3.0 * rays[0]
    np.testing.assert_array_equal(halved.trace(origins, directions).t, expected.trace(origins, directions).t)
