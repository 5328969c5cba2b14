"""Primitives as pieces of a mesh: flat without normals, texture coordinates the right way up."""

from pathlib import Path

import numpy as np

import ldtrefl
from tests.scene.gltf.writer import Written


def test_primitives_without_normals_are_flat(tmp_path: Path) -> None:
    """glTF 2.0, 3.7.2.1: normals of 0 stand for the facet's."""
    file = Written()
    file.quad()
    mesh = ldtrefl.load_mesh(file.save(tmp_path))
    assert mesh.stored_normals is not None and not mesh.stored_normals.any() and mesh.normals is mesh.stored_normals


def test_texture_coordinates_count_from_the_bottom(tmp_path: Path) -> None:
    first, second = np.array([[0, 0.25], [1, 1], [0.5, 0], [np.nan, 0]]), np.full((4, 2), 0.75)
    file = Written()
    uvs = {f"TEXCOORD_{k}": file.accessor(uv.astype(np.float32)) for k, uv in enumerate((first, second))}
    file.quad(attributes=uvs)
    mesh = ldtrefl.load_mesh(file.save(tmp_path))
    np.testing.assert_allclose(mesh.uvs, [[0, 0.75], [1, 0], [0.5, 1], [0, 0]])
    np.testing.assert_allclose(mesh.second_uvs, np.full((4, 2), [0.75, 0.25]))


def test_parts_without_colours_are_white(tmp_path: Path) -> None:
    file = Written()
    red = np.tile(np.array([1, 0, 0], np.float32), (4, 1))
    file.quad(attributes={"COLOR_0": file.accessor(red)})
    file.quad()
    mesh = ldtrefl.load_mesh(file.save(tmp_path))
    assert mesh.colors is not None
    np.testing.assert_array_equal(mesh.colors[:4], np.tile([1, 0, 0, 1], (4, 1)))
    np.testing.assert_array_equal(mesh.colors[4:], np.ones((4, 4)))


def test_tangents_turn_with_their_node(tmp_path: Path) -> None:
    file = Written()
    normals, tangents = np.tile([0.0, 0, 1], (4, 1)), np.tile([1.0, 0, 0, 1], (4, 1))
    names = {"NORMAL": normals, "TANGENT": tangents}
    file.quad(attributes={name: file.accessor(of.astype(np.float32)) for name, of in names.items()})
    file.tree["nodes"][0]["scale"] = [1, -2, 1]
    mesh = ldtrefl.load_mesh(file.save(tmp_path))
    np.testing.assert_array_equal(mesh.tangents, np.tile([1, 0, 0, -1], (4, 1)))
