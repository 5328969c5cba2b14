"""Triangles in pieces: they cover what they covered, neighbours agree where they must, and holes are where they may."""

from collections import Counter

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.methods.virtual.image import DrawnMeshes
from ldtrefl.methods.virtual.subdivision import Subdivider, Subdivision
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world.device_scene import DeviceScene

CAMERA = Camera(eye=(0.0, -5.0, 1.0), look_at=(0.0, 0.0, 0.0))


def divided(rule: Subdivision) -> tuple[DeviceScene, np.ndarray, np.ndarray]:
    """(the scene, pieces, the points of all corners) of a sphere and a plane, whose edges' errors are what their ends
    say: the same for whoever asks, and falling by half from level to level."""
    objects = (Object(shape="sphere", params={"segments": [8, 4]}), Object(shape="plane", translate=(0, 0, -2)))
    scene = DeviceScene(Scene(camera=CAMERA, objects=objects), launch.resolve_device(None))
    known: list[np.ndarray] = []

    def place(points: wp.array, vertices: wp.array) -> None:
        known.append(points.numpy().copy())
        vertices.zero_()

    def errors(pieces: wp.array, points: wp.array, vertices: wp.array) -> wp.array:
        at = points.numpy()[pieces.numpy()["vertices"]]
        both = np.stack([at[:, i] + at[:, (i + 1) % 3] for i in range(3)], axis=1)
        length = np.stack([np.linalg.norm(at[:, i] - at[:, (i + 1) % 3], axis=1) for i in range(3)], axis=1)
        found = np.abs(np.sin(97.0 * np.round(both.sum(axis=2), 9))) * length
        return wp.array(found.astype(np.float32), dtype=wp.vec3, device=scene.device)

    subdivide = Subdivider(scene, rule, place, errors, Stats())
    pieces, _ = subdivide(DrawnMeshes.of(scene, np.array([0, 1], np.int32)))
    return scene, pieces.numpy(), np.concatenate(known)


def corners_by_barycentrics(scene: DeviceScene, pieces: np.ndarray) -> np.ndarray:
    """(n, 3, 3) corners of pieces in device space, from their triangles and barycentrics."""
    found = []
    for piece in pieces:
        k = int(piece["object"])
        mesh, matrix = scene.meshes[scene.mesh_of[k]].mesh, scene.device_from_world @ scene.world_from_unit[k]
        whole = mesh.unit_vertices[mesh.faces[piece["triangle"]]].astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
        uv = np.stack([piece["a"], piece["b"], piece["c"]])
        found.append(np.column_stack([1.0 - uv.sum(axis=1), uv]) @ whole)
    return np.array(found)


def area(corners: np.ndarray) -> np.ndarray:
    """(n,) areas, and which way they turn, of (n, 3, 3) corners: (n, 3) vectors."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2


@pytest.mark.parametrize("crack_free", [False, True])
def test_pieces_cover_their_triangles(crack_free: bool) -> None:
    scene, pieces, points = divided(Subdivision(threshold=0.3, levels=4, crack_free=crack_free))
    corners = corners_by_barycentrics(scene, pieces)
    np.testing.assert_allclose(points[pieces["vertices"]], corners, atol=1e-6)
    covered: dict[tuple[int, int], np.ndarray] = {}
    for piece, part in zip(pieces, area(corners), strict=True):
        key = int(piece["object"]), int(piece["triangle"])
        covered[key] = covered.get(key, np.zeros(3)) + part
    whole = np.zeros(len(covered), pieces.dtype)
    whole["object"], whole["triangle"] = np.array(sorted(covered)).T
    whole["b"], whole["c"] = (1.0, 0.0), (0.0, 1.0)
    expected = area(corners_by_barycentrics(scene, whole))
    np.testing.assert_allclose([covered[key] for key in sorted(covered)], expected, atol=1e-6)
    assert len(covered) == scene.triangle_counts.sum() and len(pieces) > 2 * len(covered)


def open_edges(pieces: np.ndarray, points: np.ndarray) -> int:
    """Edges of pieces, by where their ends are, that are no other piece's: of the closed sphere."""
    at = np.round(points[pieces[pieces["object"] == 0]["vertices"]], 9)
    counts: Counter[frozenset] = Counter()
    for piece in at:
        ends = [tuple(corner) for corner in piece]
        counts.update(frozenset((ends[i], ends[(i + 1) % 3])) for i in range(3) if ends[i] != ends[(i + 1) % 3])
    return sum(1 for count in counts.values() if count == 1)


def test_the_papers_rule_leaves_cracks_and_ours_none() -> None:
    assert open_edges(*divided(Subdivision(threshold=0.3, levels=4, crack_free=True))[1:]) == 0
    assert open_edges(*divided(Subdivision(threshold=0.3, levels=4, crack_free=False))[1:]) > 20


@pytest.mark.parametrize("crack_free", [False, True])
def test_zero_divides_all_and_one_none(crack_free: bool) -> None:
    scene, pieces, _ = divided(Subdivision(threshold=0.0, levels=2, crack_free=crack_free))
    assert len(pieces) == 16 * scene.triangle_counts.sum()
    scene, pieces, _ = divided(Subdivision(threshold=1.0, levels=2, crack_free=crack_free))
    assert len(pieces) == scene.triangle_counts.sum()
