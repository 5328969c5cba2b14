"""Nodes: matrices and their parts, hierarchies, negative scales, instances; loops are refused."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.container import Document
from ldtrefl.scene.gltf.nodes import matrices_of, nodes_of_scene
from tests.scene.gltf.writer import QUAD, Written, nothing_beside


def nodes(tree: dict[str, object]):  # type: ignore[no-untyped-def]
    """The nodes of a file that holds nothing else."""
    return nodes_of_scene(Document(Written(**tree).as_glb(), nothing_beside))


def test_translation_rotation_and_scale_are_applied_in_turn() -> None:
    turn = Rotation.from_rotvec([0.3, -1.0, 0.7])
    (node,) = nodes({"nodes": [{"translation": [1, 2, 3], "rotation": turn.as_quat().tolist(), "scale": [2, -1, 0.5]}]})
    expected = np.eye(4)
    expected[:3, :3], expected[:3, 3] = turn.as_matrix() @ np.diag([2, -1, 0.5]), [1, 2, 3]
    np.testing.assert_allclose(node.matrix, expected, atol=1e-15)


def test_rotations_need_no_unit_length() -> None:
    made = matrices_of(np.zeros((2, 3)), np.array([[0, 0, 3.0, 3.0], [0, 0, 0, 0]]), np.ones((2, 3)))
    np.testing.assert_allclose(made[0, :3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    np.testing.assert_array_equal(made[1], np.eye(4))


def test_matrices_are_stored_by_columns_and_parents_come_first() -> None:
    scaled = np.diag([2.0, 3.0, 4.0, 1.0])
    moved = np.eye(4)
    moved[:3, 3] = [1, 0, 0]
    tree = {
        "nodes": [{"matrix": moved.T.reshape(-1).tolist(), "name": "leaf"}, {"children": [0], "name": "root"}],
        "scenes": [{"nodes": [1]}],
    }
    tree["nodes"][1]["matrix"] = scaled.reshape(-1).tolist()  # type: ignore[index]
    root, leaf = nodes(tree)
    assert (root.name, leaf.name) == ("root", "leaf")
    np.testing.assert_array_equal(leaf.matrix, scaled @ moved)


def test_the_scene_that_is_named_is_shown() -> None:
    tree = {"nodes": [{"name": "a"}, {"name": "b"}], "scenes": [{"nodes": [0]}, {"nodes": [1]}], "scene": 1}
    assert [node.name for node in nodes(tree)] == ["b"]
    del tree["scenes"]
    assert [node.name for node in nodes({**tree, "scene": 0})] == ["a", "b"]


@pytest.mark.parametrize(("tree", "match"), [
    ({"nodes": [{"children": [0]}], "scenes": [{"nodes": [0]}]}, "stands in itself, or in two nodes"),
    ({"nodes": [{"children": [1, 1]}, {}]}, "stands in itself, or in two nodes"),
    ({"nodes": [{"children": [7]}]}, r"there is no nodes\[7\]"),
    ({"nodes": [{"matrix": [1] * 15}]}, "should be 16 numbers"),
    ({"nodes": [{"translation": [1, 2, "3"]}]}, "should be a number"),
    ({"nodes": [{"scale": [1e308] * 3, "children": [1]}, {"scale": [1e308] * 3}]}, "not finite"),
    ({"nodes": [{}], "scenes": [{"nodes": [0]}], "scene": 2}, r"there is no scenes\[2\]"),
])  # fmt: skip
def test_what_is_unsound_is_refused(tree: dict[str, object], match: str) -> None:
    with pytest.raises(InputError, match=match), np.errstate(all="ignore"):
        nodes(tree)


def test_a_chain_of_nodes_may_be_long() -> None:
    many = 5000
    chain = [{"translation": [1, 0, 0], "children": [k + 1]} for k in range(many - 1)] + [{"translation": [1, 0, 0]}]
    assert nodes({"nodes": chain, "scenes": [{"nodes": [0]}]})[-1].matrix[0, 3] == many


def test_a_mirrored_node_keeps_the_outside_of_its_mesh(tmp_path: Path) -> None:
    file = Written(nodes=[{"mesh": 0, "scale": [-1, 1, 1]}])
    slanted = np.tile(np.array([0.6, 0.0, 0.8], np.float32), (4, 1))
    file.quad(attributes={"NORMAL": file.accessor(slanted)})
    del file.tree["nodes"][1]
    mesh = ldtrefl.load_mesh(file.save(tmp_path))
    np.testing.assert_array_equal(mesh.vertices, QUAD * [-1, 1, 1])
    np.testing.assert_allclose(mesh.normals, slanted * [-1, 1, 1], atol=1e-7)
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_instances_stand_in_their_node(tmp_path: Path) -> None:
    file = Written()
    file.quad()
    places = np.array([[0, 0, 0], [0, 0, 5]], np.float32)
    turns = np.array([[0, 0, 0, 127], [0, 0, 127, 0]], np.int8)
    attributes = {"TRANSLATION": file.accessor(places), "ROTATION": file.accessor(turns, normalized=True)}
    file.tree["nodes"][0] |= {
        "scale": [2, 2, 2],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}},
    }
    mesh = ldtrefl.load_mesh(file.save(tmp_path))
    np.testing.assert_allclose(mesh.vertices[:4], 2 * QUAD)
    np.testing.assert_allclose(mesh.vertices[4:], 2 * (QUAD * [-1, -1, 1] + [0, 0, 5]), atol=1e-12)


def test_instances_of_different_numbers_are_refused(tmp_path: Path) -> None:
    file = Written()
    file.quad()
    one, two = (file.accessor(np.ones((n, 3), np.float32)) for n in (1, 2))
    attributes = {"TRANSLATION": one, "SCALE": two}
    file.tree["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    with pytest.raises(InputError, match="different numbers of instances"):
        ldtrefl.load_mesh(file.save(tmp_path))
