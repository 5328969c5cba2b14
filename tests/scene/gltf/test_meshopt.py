"""Buffer views that meshoptimizer has compressed: unpacked to the same bytes, or what to install is said."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.meshopt import unpacked
from tests.scene.gltf.writer import QUAD, QUAD_FACES, Written


def compressed() -> Written:
    """The rectangle with its positions and indices compressed."""
    meshoptimizer = pytest.importorskip("meshoptimizer", reason="the extra gltf brings it")
    file = Written()
    positions = np.zeros((4, 4), np.float32)
    positions[:, :3] = QUAD
    for array, mode, packed in (
        (positions, "ATTRIBUTES", meshoptimizer.encode_vertex_buffer(positions, 4, 16)),
        (QUAD_FACES, "TRIANGLES", meshoptimizer.encode_index_buffer(QUAD_FACES.astype(np.uint32), 6, 4)),
    ):
        stride = array.nbytes // len(array)
        view = file.view(bytes(packed))
        entry = file.tree["bufferViews"][view]
        table = {**entry, "count": len(array), "byteStride": stride, "mode": mode}
        file.tree["bufferViews"][view] = {
            "buffer": 1,
            "byteLength": array.nbytes,
            "extensions": {"EXT_meshopt_compression": table},
            **({"byteStride": 16} if mode == "ATTRIBUTES" else {}),
        }
    file.tree["accessors"] = [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
    ]
    file.mesh({"POSITION": 0}, indices=1)
    return file


def test_compressed_views_hold_the_same(tmp_path: Path) -> None:
    mesh = ldtrefl.load_mesh(compressed().save(tmp_path))
    np.testing.assert_array_equal(mesh.vertices, QUAD)
    corners = QUAD[QUAD_FACES.reshape(-1, 3)]
    assert sorted(map(sorted, mesh.vertices[mesh.faces].tolist())) == sorted(map(sorted, corners.tolist()))


def test_damaged_data_are_refused(tmp_path: Path) -> None:
    file = compressed()
    file.blob = b"\xff" * len(file.blob)
    with pytest.raises(InputError, match=r"bufferViews\[0\]\.extensions\.EXT_meshopt_compression: it is damaged"):
        ldtrefl.load_mesh(file.save(tmp_path))


def test_octahedral_filter_gives_unit_normals() -> None:
    meshoptimizer = pytest.importorskip("meshoptimizer", reason="the extra gltf brings it")
    stored = np.array([[0, 0, 127, 0], [127, 0, 127, 1], [64, 63, 127, 2]], np.int8)
    packed = meshoptimizer.encode_vertex_buffer(stored, 3, 4)
    table = {"mode": "ATTRIBUTES", "filter": "OCTAHEDRAL"}
    found = np.frombuffer(unpacked(memoryview(bytes(packed)), 3, 4, table, "here"), np.int8).reshape(3, 4)
    np.testing.assert_allclose(found[:, :3] / 127, [[0, 0, 1], [1, 0, 0], [0.7099, 0.7043, 0]], atol=0.01)
    np.testing.assert_array_equal(found[:, 3], [0, 1, 2])


@pytest.mark.parametrize(("stride", "table", "match"), [
    (12, {"mode": "POINTS"}, "allowed are the modes"),
    (12, {"mode": "ATTRIBUTES", "filter": "COLOR"}, "allowed are the modes"),
    (6, {"mode": "ATTRIBUTES"}, "byteStride: 6 is not allowed"),
    (12, {"mode": "TRIANGLES"}, "byteStride: 12 is not allowed"),
    (12, {"mode": "ATTRIBUTES", "filter": "OCTAHEDRAL"}, "byteStride: 12 is not allowed"),
])  # fmt: skip
def test_what_is_unsound_is_refused(stride: int, table: dict[str, Any], match: str) -> None:
    with pytest.raises(InputError, match=match):
        unpacked(memoryview(b""), 1, stride, table, "here")


def test_what_to_install_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "meshoptimizer", None)
    with pytest.raises(InputError, match=r"meshoptimizer \(pip install 'ldtrefl\[gltf\]' lets it be read"):
        unpacked(memoryview(b""), 1, 12, {"mode": "ATTRIBUTES"}, "here")
