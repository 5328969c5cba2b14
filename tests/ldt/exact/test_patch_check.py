"""Where patches do not follow the surface, triangles are kept: rough surfaces, and edges."""

import numpy as np
import pytest
import trimesh

import ldtrefl
from ldtrefl.scene import shapes

from .differences import differences


def rough_ball(rise: float) -> ldtrefl.Mesh:
    """A ball of 200,000 triangles whose vertices rise and fall at random by ``rise`` radii."""
    ball = shapes.make("sphere", {"segments": [500, 200]})
    place, number = np.unique(ball.vertices.round(9), axis=0, return_inverse=True)
    rises = 1.0 + rise * np.random.default_rng(3).normal(size=(len(place), 1))
    return ldtrefl.Mesh(ball.vertices * rises[number.ravel()], ball.faces)


def many_triangled_box(axis: tuple[float, float, float]) -> ldtrefl.Mesh:
    """A box turned about an axis, each side of 131,072 triangles."""
    box = trimesh.creation.box(extents=(1.0, 1.5, 2.0))
    for _ in range(8):
        box = box.subdivide()
    turned = trimesh.transformations.rotation_matrix(0.7, axis)[:3, :3]
    return ldtrefl.Mesh(box.vertices @ turned.T, box.faces)


@pytest.mark.parametrize("quality", ["balanced", "fast"])
def test_rough_surfaces_stay_triangles(quality: str) -> None:
    """Of a detailed scan no triangle can stand for its neighbours, however small it is."""
    mesh = rough_ball(0.003)
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, 128, quality=quality)
    smooth = rough_ball(0.0)
    assert ldtrefl.peel(smooth.vertices, smooth.faces, 128, quality=quality).tree.patches and not maps.tree.patches
    found = differences(mesh, maps, 60_000, 8)
    assert found["wrong_hits"] + found["wrong_misses"] <= 0.01 and found["p99"] < 0.01, found


@pytest.mark.parametrize(("quality", "resolution"), [("balanced", 256), ("fast", 400)])
@pytest.mark.parametrize("axis", [(1, 2, 3), (1, -0.5, 0.7)])
def test_patches_end_at_edges(quality: str, resolution: int, axis: tuple[float, float, float]) -> None:
    """Whichever way a box is turned, no edge may be taken for a surface that goes on in another map."""
    mesh = many_triangled_box(axis)
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution, quality=quality)
    assert maps.tree.patches
    found = differences(mesh, maps, 100_000, 9)
    assert found["wrong_hits"] + found["wrong_misses"] <= 0.005 and found["p999"] <= 0.01, found
