"""Skins in their bind pose: vertices follow their joints, the node's own place does not count."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.base.errors import InputError
from tests.scene.gltf.writer import QUAD, Written


def skinned(joints: list[list[int]], weights: list[list[float]]) -> Written:
    """The rectangle between two joints, of which the second is moved up by 3 since the skin was bound."""
    file = Written()
    normals = np.tile(np.array([0, 0, 1], np.float32), (4, 1))
    file.quad(
        attributes={
            "NORMAL": file.accessor(normals),
            "JOINTS_0": file.accessor(np.array(joints, np.uint8)),
            "WEIGHTS_0": file.accessor(np.array(weights, np.float32)),
        }
    )
    bind = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    bind[1, 2, 3] = -1.0  # the second joint stood at z = 1
    matrices = file.accessor(bind.transpose(0, 2, 1).reshape(2, 16), kind="MAT4")
    file.tree["nodes"][0] |= {"skin": 0, "translation": [100, 0, 0]}
    file.tree["nodes"] += [{"children": [2]}, {"translation": [0, 0, 4]}]
    file.add("skins", {"joints": [1, 2], "inverseBindMatrices": matrices})
    return file


def test_vertices_follow_their_joints_by_their_weights(tmp_path: Path) -> None:
    joints = [[0, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0], [1, 1, 0, 0]]
    weights = [[1, 0, 0, 0], [1, 0, 0, 0], [0.5, 0.5, 0, 0], [2, 0, 0, 0]]
    file = skinned(joints, weights)
    mesh = ldtrefl.load_mesh(file.save(tmp_path))
    np.testing.assert_allclose(mesh.vertices, QUAD + np.outer([0, 3, 1.5, 3], [0, 0, 1]), atol=1e-12)
    np.testing.assert_allclose(mesh.normals, np.tile([0, 0, 1], (4, 1)), atol=1e-7)


def test_a_joint_that_there_is_not_is_refused(tmp_path: Path) -> None:
    file = skinned([[2, 0, 0, 0]] * 4, [[1, 0, 0, 0]] * 4)
    with pytest.raises(InputError, match="there is no joint 2"):
        ldtrefl.load_mesh(file.save(tmp_path))


def test_a_joint_outside_the_scene_is_refused(tmp_path: Path) -> None:
    file = skinned([[0, 0, 0, 0]] * 4, [[1, 0, 0, 0]] * 4)
    file.tree["scenes"] = [{"nodes": [0]}]
    with pytest.raises(InputError, match="does not stand in the scene"):
        ldtrefl.load_mesh(file.save(tmp_path))
