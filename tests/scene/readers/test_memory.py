"""Memory is asked for before a file is read, as much as the file may take."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

import ldtrefl
from ldtrefl.base import budget
from tests.mesh_writers import write_glb
from tests.scene.readers.soft_box import SCENE


@pytest.mark.parametrize("kind", ["ply", "obj", "stl", "off", "glb"])
def test_files_take_what_they_need_from_the_budget(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"a.{kind}"
    trimesh.creation.icosphere(5).export(path)
    budget.set_memory_limit(1 << 20)
    with pytest.raises(ldtrefl.InputError, match=rf"a\.{kind}: .* needs .* allowed are 1.0 MiB \(--memory"):
        ldtrefl.load_mesh(path)
    budget.set_memory_limit()
    assert len(ldtrefl.load_mesh(path).faces) == 20480


CLAIMED = r"a\.glb: .*(needs .* allowed are 4.0 GiB|at most \d+ elements are allowed|ends at byte)"


@pytest.mark.parametrize(
    "claim",
    [
        {"accessors": [{"componentType": 5126, "count": 10**10, "type": "VEC3"}]},
        {"bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 1 << 40}]},
        {
            "nodes": [{"mesh": 0, "translation": [k, 0, 0]} for k in range(20_000)],
            "scenes": [{"nodes": list(range(20_000))}],
        },
    ],
)
def test_a_glb_that_claims_more_than_it_holds_is_refused(tmp_path: Path, claim: dict) -> None:
    """In its accessors, in its views, and by a mesh placed many times."""
    ball = trimesh.creation.icosphere(5)
    positions, order = ball.vertices.astype(np.float32), ball.faces.astype(np.uint32).reshape(-1)
    meshes = [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}]
    tree = {"meshes": meshes, "nodes": [{"mesh": 0}], "scenes": SCENE, **claim}
    with pytest.raises(ldtrefl.InputError, match=CLAIMED):
        ldtrefl.load_mesh(write_glb(tmp_path / "a.glb", [positions, order], **tree))
