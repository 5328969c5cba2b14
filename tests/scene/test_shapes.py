"""Procedural shapes: closed where they say so, of known size, volume and genus, wound outwards."""

import numpy as np
import pytest
import trimesh

from ldtrefl import InputError
from ldtrefl.scene import shapes


def welded(name: str, params: dict | None = None) -> trimesh.Trimesh:
    mesh = shapes.make(name, params)
    places, inverse = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return trimesh.Trimesh(places, inverse.reshape(-1)[mesh.faces], process=False)


@pytest.mark.parametrize(
    ("name", "euler", "volume"),
    [
        ("sphere", 2, 4 / 3 * np.pi),
        ("box", 2, 8.0),
        ("room", 2, -8.0),
        ("hollow_box", 0, 8.0 - 2 * 1.2**2),
        ("torus", 0, 2 * np.pi**2 * 0.35**2),
        ("torus_knot", 0, None),
        ("genus3", -4, None),
        ("bowl", 2, None),
        ("gyroid", None, None),
        ("wires", 32, None),
    ],
)
def test_closed_shapes(name: str, euler: int | None, volume: float | None) -> None:
    mesh = welded(name)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert euler is None or mesh.euler_number == euler
    assert (mesh.volume > 0) == (name != "room")
    if volume is not None:
        assert mesh.volume == pytest.approx(volume, rel=0.005)


@pytest.mark.parametrize("name", shapes.names())
def test_size_place_and_normals(name: str) -> None:
    mesh = shapes.make(name)
    low, high = mesh.bounds
    radius = 1.35 if name == "torus" else 1.0
    np.testing.assert_allclose(np.abs([low, high]).max(), radius, rtol=1e-3)
    np.testing.assert_allclose(low + high, 0.0, atol=2e-3)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    facets = np.cross(b - a, c - a)
    assert (np.linalg.norm(facets, axis=1) > 0).all()
    assert ((facets * mesh.normals[mesh.faces].sum(axis=1)).sum(axis=1) > 0).mean() > 0.99
    if mesh.uvs is not None:
        assert mesh.uvs.min() >= 0.0 and mesh.uvs.max() <= 1.0


@pytest.mark.parametrize("name", ["box", "room", "hollow_box"])
def test_boxes_stay_closed_when_cut_into_segments(name: str) -> None:
    assert welded(name, {"segments": 7}).is_watertight


def test_open_bowl_is_one_sheet() -> None:
    assert not welded("bowl", {"closed": False}).is_watertight


def test_segments_set_the_count() -> None:
    assert len(shapes.make("torus", {"segments": [10, 6]}).faces) == 2 * 10 * 6
    assert len(shapes.make("box", {"segments": 4}).faces) == 6 * 2 * 16


@pytest.mark.parametrize(
    ("name", "params", "message"),
    [
        ("spher", {}, "unknown shape 'spher'; did you mean 'sphere'"),
        ("sphere", {"segment": 4}, "unknown key 'segment'; did you mean 'segments'"),
        ("torus", {"minor": "x"}, "^params: minor: should be a valid number, got 'x'"),
        ("torus", {"minor": -0.5}, r"^params: minor: should be greater than 0, got -0\.5"),
        ("box", {"segments": 10**9}, "^params: segments: should be less than or equal to 4096, got 1000000000"),
        ("bowl", {"closed": 1}, "^params: closed: should be a valid boolean, got 1"),
        ("genus3", {"grid": float("nan")}, "^params: grid: should be a valid integer, got nan"),
    ],
)
def test_wrong_parameters(name: str, params: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        shapes.make(name, params)
