"""Smooth normals for facets: of a sphere they are its own, and normals that are there stay."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

import ldtrefl
from ldtrefl import InputError, Mesh, Object
from ldtrefl.base import budget
from ldtrefl.scene.smoothing import smoothed_facets


def test_facets_of_an_stl_file_are_smooth_where_the_scene_says_so(tmp_path: Path) -> None:
    """As the same ball is whose vertices are shared; and two objects of a scene have one mesh."""
    ball = trimesh.creation.icosphere(3)
    ball.export(tmp_path / "ball.stl")
    table = '[[object]]\nmesh = "ball.stl"\n'
    path = tmp_path / "scene.toml"
    path.write_text("[camera]\neye = [0, -5, 0]\nlook_at = [0, 0, 0]\n" + table + 2 * (table + "smooth = true\n"))
    flat, *smooth = (entry.geometry for entry in ldtrefl.load_scene(path).objects)
    assert not flat.normals.any() and smooth[0] is smooth[1]
    np.testing.assert_array_equal(smooth[0].vertices[smooth[0].faces], flat.vertices[flat.faces])
    np.testing.assert_allclose(smooth[0].normals, smooth[0].vertices, atol=5e-3)


def test_a_mirror_of_a_smoothed_ball_is_round(tmp_path: Path) -> None:
    """Its picture is that of the ball whose vertices are shared, and not that of its facets."""
    ball = trimesh.creation.icosphere(2)
    ball.export(tmp_path / "ball.stl")
    camera = ldtrefl.Camera(eye=(0, -5, 0), look_at=(0, 0, 0), fov_y=30, width=24, height=24)
    shown = {}
    for name, mesh, smooth in (
        ("shared", Mesh(ball.vertices.astype(np.float32), ball.faces), None),
        ("smooth", str(tmp_path / "ball.stl"), True),
        ("flat", str(tmp_path / "ball.stl"), None),
    ):
        thing = Object(mesh=mesh, smooth=smooth, material=ldtrefl.Material(mirror=0.9))
        shown[name] = ldtrefl.render(ldtrefl.Scene(camera=camera, objects=(thing,)), "bvh").image
    np.testing.assert_allclose(shown["smooth"], shown["shared"], atol=1e-3)
    assert np.abs(shown["flat"] - shown["shared"]).max() > 0.02


def test_vertices_with_a_normal_keep_it() -> None:
    """Two triangles that share an edge: one stores its normals, and the other's are made of it alone."""
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1], [0, 0, 0]]
    stored = [[0.6, 0, 0.8]] * 3 + [[0, 0, 0]] * 3
    mesh = smoothed_facets(Mesh(vertices, [[0, 1, 2], [3, 4, 5]], stored))
    np.testing.assert_allclose(mesh.normals, [[0.6, 0, 0.8]] * 3 + [[0, -1, 0]] * 3, atol=1e-6)


def test_a_vertex_of_several_sides_is_doubled() -> None:
    """A sheet that is there twice, once for each side, with the same vertices: each side has its normal."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    mesh = smoothed_facets(Mesh(corners, [[0, 1, 2], [0, 2, 1]], np.zeros((3, 3)), uvs=corners[:, :2]))
    np.testing.assert_allclose(mesh.normals[mesh.faces], [[[0, 0, 1]] * 3, [[0, 0, -1]] * 3], atol=1e-6)
    np.testing.assert_array_equal(mesh.uvs[mesh.faces], corners[[[0, 1, 2], [0, 2, 1]], :2])


def test_what_has_normals_or_none_is_left_as_it_is() -> None:
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    for mesh in (Mesh(corners, [[0, 1, 2]]), Mesh(corners, [[0, 1, 2]], [[0, 0, 1]] * 3)):
        assert smoothed_facets(mesh) is mesh
        assert Object(mesh=mesh, smooth=True).geometry is Object(mesh=mesh, smooth=False).geometry is mesh


def test_an_object_that_is_changed_is_smoothed_anew() -> None:
    flat = Object(mesh=Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], np.zeros((3, 3))))
    assert not flat.geometry.normals.any() and flat.changed(smooth=True).geometry.normals.any()


def test_memory_is_asked_for() -> None:
    mesh = Mesh(np.random.default_rng(0).random((3000, 3)), np.arange(3000).reshape(-1, 3), np.zeros((3000, 3)))
    budget.set_memory_limit(1 << 16)
    with pytest.raises(InputError, match="its smooth normals needs"):
        smoothed_facets(mesh)
