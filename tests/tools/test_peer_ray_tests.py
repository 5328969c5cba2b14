"""The tool that runs other libraries' ray tests: its adapters against what can be counted by hand, and its report."""

from __future__ import annotations

import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from peer_adapters.crossings import TRACERS, Target
from peer_adapters.for_open3d import INVALID_ID, RaycastingScene, Tensor, TriangleMesh
from peer_adapters.for_trimesh import RayMeshIntersector

from ldtrefl.scene import shapes

TOOL = Path(__file__).parent.parent.parent / "tools" / "peer_ray_tests.py"

TRIMESH_SUITE = """
import numpy as np, pytest, trimesh
def test_right():
    box = trimesh.creation.box()
    assert type(box.ray).__module__ == "peer_adapters.for_trimesh" and box.ray.by == BY
    assert box.ray.intersects_any([[0, 0, 5.0]], [[0, 0, -1.0]]).all()
def test_wrong():
    assert trimesh.creation.box().ray.intersects_any([[0, 0, 5.0]], [[0, 0, 1.0]]).all(), "nothing there"
def test_needs_more():
    import a_package_that_nobody_has
def test_is_no_ray():
    pytest.skip("no ray query")
"""
OPEN3D_SUITE = """
import open3d as o3d
def test_right():
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.t.geometry.TriangleMesh.create_box())
    assert scene.by == BY and scene.count_intersections(o3d.core.Tensor([[0.5, 0.2, -1, 0, 0, 1.0]])).item() == 2
"""


@pytest.mark.parametrize("by", TRACERS)
def test_every_crossing_is_found_once(by: str) -> None:
    """Shells within each other, rays through their common middle: also along diagonals of faces and through corners."""
    box = shapes.make("box")
    shells = np.vstack([scale * box.vertices + [10.0, 20.0, 30.0] for scale in (1.0, 0.5, 1e-3)])
    faces = np.vstack([box.faces + k * len(box.vertices) for k in range(3)])
    ways = np.array([way for way in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(way)] + [(0.3, 0.4, 0.5)])
    ways /= np.abs(ways).max(axis=1, keepdims=True)
    found = Target(by, shells, faces).crossings([10.0, 20.0, 30.0] - 4.0 * ways, ways)
    assert np.bincount(found.ray).tolist() == [6] * len(ways)
    t = np.sort(found.t.reshape(-1, 6), axis=1)
    np.testing.assert_allclose(t, np.tile([3.0, 3.5, 3.999, 4.001, 4.5, 5.0], (len(ways), 1)), atol=1e-5)
    assert (found.t.reshape(-1, 6) == t).all()


@pytest.mark.parametrize("by", TRACERS)
def test_trimesh_intersector_agrees_with_trimesh_itself(by: str) -> None:
    """Random rays through a ball, by Embree there; and ours follows a mesh that changes."""
    ours = type("Ours", (RayMeshIntersector,), {"by": by})
    ball = trimesh.creation.icosphere(subdivisions=2)
    rng = np.random.default_rng(0)
    origins, directions = rng.uniform(-2, 2, (200, 3)), rng.normal(size=(200, 3))
    theirs, mine = trimesh.ray.ray_pyembree.RayMeshIntersector(ball), ours(ball)
    for rays in ((origins, directions), (origins[:1], directions[:1])):
        for many in (True, False):
            expected = sorted(zip(*theirs.intersects_id(*rays, multiple_hits=many), strict=True))
            assert sorted(zip(*mine.intersects_id(*rays, multiple_hits=many), strict=True)) == expected
        np.testing.assert_array_equal(mine.intersects_first(*rays), theirs.intersects_first(*rays))
        np.testing.assert_array_equal(mine.intersects_any(*rays), theirs.intersects_any(*rays))
    points, ray, triangle = mine.intersects_location(origins, directions)
    along = np.cross(points - origins[ray], directions[ray])
    np.testing.assert_allclose(along, 0.0, atol=1e-5)
    height = ((points - ball.triangles[triangle, 0]) * ball.face_normals[triangle]).sum(axis=1)
    np.testing.assert_allclose(height, 0.0, atol=1e-12)
    inside = np.linalg.norm(origins, axis=1) < 0.9
    assert mine.contains_points(origins)[inside].all() and not mine.contains_points(2.0 * ball.vertices).any()
    ball.apply_translation([5.0, 0.0, 0.0])
    assert mine.intersects_any([[5.0, 0.0, 3.0], [0.0, 0.0, 3.0]], [[0.0, 0.0, -1.0]] * 2).tolist() == [True, False]


@pytest.mark.parametrize("by", TRACERS)
def test_open3d_scene_of_two_geometries(by: str) -> None:
    """A box from 0 to 1 and a triangle above it: which is met, where, and how often."""
    scene = type("Ours", (RaycastingScene,), {"by": by})()
    assert scene.add_triangles(TriangleMesh.create_box()) == 0
    assert scene.add_triangles(Tensor([[0, 0, 3], [1, 0, 3], [0, 1, 3]]), Tensor([[0, 1, 2]])) == 1
    rays = Tensor([[0.2, 0.3, 5, 0, 0, -1], [0.7, 0.6, 5, 0, 0, -2], [0.2, 0.3, 2, 0, 0, 1], [5, 5, 5, 0, 0, -1.0]])
    found = scene.cast_rays(rays.reshape(2, 2, 6))
    assert {name: array.shape[:2] for name, array in found.items()} == dict.fromkeys(found, (2, 2))
    np.testing.assert_allclose(found["t_hit"].ravel(), [2.0, 2.0, 1.0, np.inf], rtol=1e-6)
    assert found["geometry_ids"].ravel().tolist() == [1, 0, 1, INVALID_ID]
    assert found["primitive_ids"].ravel()[[0, 2, 3]].tolist() == [0, 0, INVALID_ID]
    np.testing.assert_allclose(found["primitive_uvs"][0, 0], [0.2, 0.3], atol=1e-6)
    assert scene.count_intersections(rays).tolist() == [3, 2, 1, 0]
    every = scene.list_intersections(rays)
    assert every["ray_splits"].tolist() == [0, 3, 5, 6, 6] and every["ray_ids"].tolist() == [0, 0, 0, 1, 1, 2]
    np.testing.assert_allclose(every["t_hit"], [2, 4, 5, 2, 2.5, 1], rtol=1e-6)
    assert scene.test_occlusions(rays, tfar=1.5).tolist() == [False, False, True, False]
    assert scene.test_occlusions(rays, tnear=2.2).tolist() == [True, True, False, False]
    assert scene.compute_occupancy(Tensor([[0.5, 0.5, 0.5], [0.5, 0.5, 2]]), nsamples=3).tolist() == [1.0, 0.0]


def checkout(folder: Path, by: str) -> list[str]:
    """The arguments that name two checkouts with small suites."""
    for name, text in (
        ("t/tests/test_ray.py", TRIMESH_SUITE),
        ("o/python/test/t/geometry/test_raycasting_scene.py", OPEN3D_SUITE),
    ):
        (folder / name).parent.mkdir(parents=True)
        (folder / name).write_text(f"BY = {by!r}\n{text}")
    return ["--trimesh", str(folder / "t"), "--open3d", str(folder / "o"), "--tracers", by]


@pytest.mark.parametrize("by", ["exact", "bvh"])
def test_the_tool_says_what_passed_what_failed_and_what_does_not_apply(tmp_path: Path, by: str) -> None:
    done = subprocess.run(
        [sys.executable, str(TOOL), *checkout(tmp_path, by)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1, done.stderr
    lines = [line.strip() for line in done.stdout.splitlines()]
    assert lines[0] == f"trimesh by {by}: 1 passed, 1 failed, 2 do not apply"
    assert lines[1].startswith("test_wrong: ") and "nothing there" in lines[1]
    assert "does not apply: test_is_no_ray (no ray query)" in lines
    assert any(line.startswith("does not apply: test_needs_more (") and "nobody_has" in line for line in lines)
    assert lines[-1] == f"open3d by {by}: 1 passed, 0 failed, 0 do not apply"


def test_the_tool_names_a_folder_that_is_no_checkout(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(TOOL), "--trimesh", str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2 and "there is no tests/test_ray.py in" in done.stderr
