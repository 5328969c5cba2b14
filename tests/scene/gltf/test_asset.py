"""A whole asset: meshes in their nodes, and what of it is not shown."""

import numpy as np

from ldtrefl.scene.gltf.asset import Asset
from tests.scene.gltf.writer import QUAD, Written, nothing_beside


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
