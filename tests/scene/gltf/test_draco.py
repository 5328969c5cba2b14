"""Geometry that Draco has compressed: unpacked to the same attributes, or what to install is said."""

import sys
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.base.errors import InputError
from tests.scene.gltf.writer import QUAD, QUAD_FACES, Written


def compressed(data: bytes, **numbers: int) -> Written:
    """The rectangle, its geometry in ``data``, where attributes have these numbers."""
    file = Written()
    counts = (("VEC3", 4, 5126), ("VEC3", 4, 5126), ("SCALAR", 6, 5125))
    file.tree["accessors"] = [{"type": kind, "count": n, "componentType": code} for kind, n, code in counts]
    table = {"bufferView": file.view(data), "attributes": numbers}
    extensions = {"KHR_draco_mesh_compression": table}
    file.mesh({"POSITION": 0, "NORMAL": 1}, indices=2, extensions=extensions)
    return file


def test_compressed_geometry_is_the_same(tmp_path: Path) -> None:
    draco = pytest.importorskip("DracoPy", reason="the extra gltf brings it")
    normals = np.tile([0.0, 0.0, 1.0], (4, 1))
    faces = QUAD_FACES.reshape(-1, 3).astype(np.uint32)
    data = draco.encode(QUAD, faces, quantization_bits=16, preserve_order=True, normals=normals)
    by_kind = {int(one["attribute_type"]): one["unique_id"] for one in draco.decode(data).attributes}
    file = compressed(data, POSITION=by_kind[0], NORMAL=by_kind[1])
    mesh = ldtrefl.load_mesh(file.save(tmp_path))
    corners = QUAD[QUAD_FACES.reshape(-1, 3)]
    np.testing.assert_allclose(mesh.vertices[mesh.faces], corners, atol=1e-4)
    np.testing.assert_allclose(mesh.normals, np.tile([0, 0, 1], (len(mesh.vertices), 1)), atol=1e-2)


def test_damaged_data_are_refused(tmp_path: Path) -> None:
    pytest.importorskip("DracoPy", reason="the extra gltf brings it")
    with pytest.raises(InputError, match="KHR_draco_mesh_compression: it is damaged"):
        ldtrefl.load_mesh(compressed(b"DRACO no more").save(tmp_path))


def test_what_to_install_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    with pytest.raises(InputError, match=r"compressed by Draco \(pip install 'ldtrefl\[gltf\]' lets it be read"):
        ldtrefl.load_mesh(compressed(b"DRACO").save(tmp_path))
