"""What shapes are made of: grids without gaps or triangles without area, and how they are wound."""

import numpy as np

from ldtrefl.scene import shapes
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.surfaces import fitted, grid_faces, joined, outwards, signed_volume, without_collapsed


def test_a_grid_has_two_triangles_a_cell_and_no_gap() -> None:
    faces = grid_faces(3, 2)
    assert len(faces) == 2 * 3 * 2 and set(faces.ravel()) == set(range(4 * 3))
    x, y = np.meshgrid(np.arange(4.0), np.arange(3.0))
    corners = np.stack([x.ravel(), y.ravel()], 1)[faces]
    (ax, ay), (bx, by) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    np.testing.assert_array_equal(ax * by - ay * bx, 1.0)  # counter-clockwise, half a cell each


def test_triangles_with_two_corners_in_one_place_are_left_out() -> None:
    vertices = np.array([[0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    np.testing.assert_array_equal(without_collapsed(vertices, np.array([[0, 1, 2], [0, 2, 3]])), [[0, 2, 3]])


def test_outwards_turns_what_is_inside_out() -> None:
    box, room = shapes.make("box"), shapes.make("room")
    assert signed_volume(box.vertices, box.faces) == 8.0 == -signed_volume(room.vertices, room.faces)
    turned = outwards(room)
    assert outwards(box) is box and signed_volume(turned.vertices, turned.faces) == 8.0


def test_joined_and_fitted() -> None:
    box = shapes.make("box")
    moved = Mesh(box.vertices * 3.0 + 10.0, box.faces, box.normals, box.uvs)
    both = joined(box, moved)
    assert len(both.faces) == 24 and both.faces[12:].min() == len(box.vertices)
    np.testing.assert_allclose(fitted(both).bounds, [[-1, -1, -1], [1, 1, 1]])
