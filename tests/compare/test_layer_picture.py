"""Layers as a picture: a row a layer, a column a face, colours that tell normals."""

import numpy as np

import ldtrefl
from ldtrefl.compare.layer_picture import FARTHEST_SHADE, LABEL_HEIGHT, MARGIN, draw_layers
from ldtrefl.files.srgb import srgb_from_linear
from ldtrefl.scene import shapes

RESOLUTION = 32


def square() -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a square that faces +z."""
    mesh = shapes.make("plane")
    return mesh.vertices, mesh.faces


def tiles(name: str) -> list[list[np.ndarray]]:
    """By layer and face, what is drawn of a shape that is stretched to a cube: (RESOLUTION, RESOLUTION, 3), encoded."""
    mesh = shapes.make(name)
    sides = mesh.bounds[1] - mesh.bounds[0]
    vertices = mesh.vertices / np.where(sides > 0.0, sides, 1.0)
    picture = srgb_from_linear(draw_layers(ldtrefl.peel(vertices, mesh.faces, resolution=RESOLUTION)))
    step = RESOLUTION + MARGIN
    rows = (picture.shape[0] - LABEL_HEIGHT - MARGIN) // step
    top = LABEL_HEIGHT + MARGIN
    return [
        [
            picture[top + row * step : top + row * step + RESOLUTION, MARGIN + face * step : face * step + step]
            for face in range(6)
        ]
        for row in range(rows)
    ]


def test_a_box_has_one_layer_whose_colour_is_the_faces_normal() -> None:
    (layer,) = tiles("box")
    for face, tile in enumerate(layer):
        normal = np.zeros(3)
        normal[face // 2] = 1.0 if face % 2 == 0 else -1.0
        np.testing.assert_allclose(tile[RESOLUTION // 2, RESOLUTION // 2], 0.5 + 0.5 * normal, atol=0.02)


def test_a_ring_has_a_second_layer_that_is_darker() -> None:
    first, second = tiles("torus")
    seen_first, seen_second = ((tile[0] < 0.99).any(axis=2) for tile in (first, second))
    assert 0 < seen_second.sum() < seen_first.sum() and (seen_first | ~seen_second).all()
    assert second[0][seen_second].max() < first[0][seen_first].max()
    # Face +x sees normals whose x is at least 0: red is at least half of the shade.
    assert second[0][seen_second][:, 0].min() >= 0.5 * FARTHEST_SHADE


def test_z_points_up() -> None:
    """A bowl, open upwards: seen from the side, its lower half is a half disc."""
    layer = tiles("bowl")[0]
    for face in range(4):
        rows = (layer[face] < 0.99).any(axis=2).sum(axis=1)
        drawn = rows[rows > 0]
        assert drawn[0] > 2 * drawn[-1]


def test_a_sheet_is_seen_from_one_side() -> None:
    maps = ldtrefl.peel(*square(), resolution=RESOLUTION)
    assert maps.layers() == {"+x": 0, "-x": 0, "+y": 0, "-y": 0, "+z": 1, "-z": 0}
    assert (srgb_from_linear(draw_layers(maps))[LABEL_HEIGHT:] < 0.99).any()
