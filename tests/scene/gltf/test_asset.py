"""A whole asset: meshes in their nodes, and what of it is not shown. Public sample files, where LDTREFL_GLTF_PATH has
them, hold what their makers say."""

import json
import math
import os
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.gltf.asset import Asset
from ldtrefl.scene.gltf.to_scene import scene_parts
from tests.scene.gltf.writer import QUAD, Written, nothing_beside

HOLDS = {
    "BoxInterleaved.glb": (1, 12),
    "BoxVertexColors.glb": (1, 12),
    "Cameras.gltf": (1, 2),
    "CesiumMilkTruck.glb": (3, 3624),
    "RiggedSimple.glb": (1, 188),
    "SimpleMeshes.gltf": (2, 2),
    "SimpleMorph.gltf": (1, 1),
    "SimpleSparseAccessor.gltf": (1, 12),
    "TextureSettingsTest.glb": (10, 72),
    "TriangleWithoutIndices.gltf": (1, 1),
}
"""Nodes with meshes, and triangles of all of them."""


def test_nodes_share_the_primitives_of_their_mesh() -> None:
    file = Written()
    number = file.quad()
    file.add("nodes", {"mesh": number, "translation": [5, 0, 0], "name": "second"})
    first, second = Asset.read(file.as_glb(), nothing_beside).mesh_nodes()
    assert first.primitives is second.primitives and (first.name, second.name) == ("mesh 0", "second")
    assert second.matrix[0, 3] == 5


def test_nodes_without_triangles_are_left_out() -> None:
    file = Written()
    file.mesh({"POSITION": file.accessor(QUAD)}, mode=0)
    places = {"TRANSLATION": file.accessor(np.zeros((2, 3), np.float32))}
    file.tree["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": places}}
    assert list(Asset.read(file.as_glb(), nothing_beside).mesh_nodes()) == []


def test_weights_of_a_node_are_its_own() -> None:
    file = Written()
    up = file.accessor(np.tile(np.array([0, 0, 1], np.float32), (4, 1)))
    number = file.quad(targets=[{"POSITION": up}])
    file.tree["nodes"][0]["weights"] = [2]
    file.add("nodes", {"mesh": number})
    raised, flat = Asset.read(file.as_glb(), nothing_beside).mesh_nodes()
    np.testing.assert_array_equal(raised.primitives[0].vertices, np.add(QUAD, [0, 0, 2]))
    np.testing.assert_array_equal(flat.primitives[0].vertices, QUAD)


def test_what_is_not_shown_is_named() -> None:
    file = Written(animations=[{"channels": [], "samplers": []}])
    file.quad()
    file.mesh({"POSITION": file.accessor(QUAD)}, mode=0)
    lines = Asset.read(file.as_glb(), nothing_beside).not_shown()
    assert lines == ["points (they have no surface)", "animations (shown as it stands)"]


def sample(name: str) -> Path:
    """The file of this name."""
    for folder in filter(None, os.environ.get("LDTREFL_GLTF_PATH", "").split(os.pathsep)):
        if (Path(folder) / name).is_file():
            return Path(folder) / name
    pytest.skip(f"{name} is not in LDTREFL_GLTF_PATH")


@pytest.mark.parametrize("name", HOLDS)
def test_a_file_holds_its_nodes_and_triangles(name: str) -> None:
    objects = scene_parts(sample(name)).objects
    assert (len(objects), sum(len(entry.geometry.faces) for entry in objects)) == HOLDS[name]


def test_sparse_positions_replace_three_of_fourteen() -> None:
    vertices = ldtrefl.load_mesh(sample("SimpleSparseAccessor.gltf")).vertices
    np.testing.assert_array_equal(vertices[[8, 10, 12]], [[1, 2, 0], [3, 3, 0], [5, 4, 0]])


def test_morphed_positions_are_those_at_rest() -> None:
    mesh = ldtrefl.load_mesh(sample("SimpleMorph.gltf"))
    np.testing.assert_allclose(mesh.vertices, [[0, 0, 0], [1, 0, 0], [0.5, 1.5, 0]])


def test_both_cameras_are_told_apart() -> None:
    parts = scene_parts(sample("Cameras.gltf"))
    assert len(parts.cameras) == 1 and parts.cameras[0].fov_y == pytest.approx(math.degrees(0.7))


def test_colours_of_vertices_are_the_file_s() -> None:
    data = sample("BoxVertexColors.glb").read_bytes()
    length = int.from_bytes(data[12:16], "little")
    tree = json.loads(data[20 : 20 + length])
    accessor = tree["accessors"][tree["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]]
    first = 28 + length + tree["bufferViews"][accessor["bufferView"]]["byteOffset"] + accessor.get("byteOffset", 0)
    width = {"VEC3": 3, "VEC4": 4}[accessor["type"]]
    stored = np.frombuffer(data, "<f4", accessor["count"] * width, first).reshape(-1, width)
    mesh = ldtrefl.load_mesh(sample("BoxVertexColors.glb"))
    assert mesh.colors is not None and len(np.unique(stored, axis=0)) > 4
    np.testing.assert_array_equal(mesh.colors[:, :width], stored)
