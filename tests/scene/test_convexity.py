"""From which sides of a mesh rays can come back to it, against shapes that are known, and against rays."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes
from ldtrefl.scene.convexity import BACK, FRONT, sides_with_returns

BOTH = FRONT | BACK


def dented(mesh: ldtrefl.Mesh, depth: float) -> np.ndarray:
    """A mesh's vertices, one of which is pushed towards 0."""
    vertices = mesh.vertices.copy()
    here = (vertices == vertices[len(vertices) // 2]).all(axis=1)
    vertices[here] *= 1.0 - depth
    return vertices


def arrays(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a shape."""
    mesh = shapes.make(name)
    return mesh.vertices, mesh.faces


def kinds() -> list[tuple[str, np.ndarray, np.ndarray, int]]:
    sphere, box, plane = (shapes.make(name) for name in ("sphere", "box", "plane"))
    coarse = shapes.make("sphere", {"segments": [10, 5]})
    apart = [3.0, 0.0, 0.0]
    two = np.vstack([box.vertices, box.vertices + apart]), np.vstack([box.faces, box.faces + len(box.vertices)])
    stretched = box.vertices * [1.0, 1e-4, 0.3]
    turned = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    pentagram = star_prism()
    return [
        ("sphere", sphere.vertices, sphere.faces, BACK),
        ("coarse sphere", coarse.vertices, coarse.faces, BACK),
        ("sphere wound inwards", sphere.vertices, sphere.faces[:, ::-1], FRONT),
        ("sphere with a dent", dented(sphere, 1e-3), sphere.faces, BOTH),
        ("sphere with a hole", sphere.vertices, sphere.faces[:-5], BOTH),
        ("sphere with a face turned over", sphere.vertices, turned_over(sphere.faces), BOTH),
        ("box", box.vertices, box.faces, BACK),
        ("room", *arrays("room"), FRONT),
        ("slat", stretched @ turned.T, box.faces, BACK),
        ("two boxes", *two, BOTH),
        ("plane", plane.vertices, plane.faces, 0),
        ("tilted plane", plane.vertices @ turned.T, plane.faces, 0),
        ("one triangle", np.eye(3), np.array([[0, 1, 2]]), 0),
        ("no area", np.eye(3), np.array([[0, 0, 2]]), 0),
        ("pentagram wound twice about its axis", *pentagram, BOTH),
        *((name, *arrays(name), BOTH) for name in CURVED),
    ]


CURVED = ["torus", "torus_knot", "bowl", "hollow_box", "genus3", "teapot", "gyroid"]


def turned_over(faces: np.ndarray) -> np.ndarray:
    changed = faces.copy()
    changed[7] = changed[7, ::-1]
    return changed


def star_prism() -> tuple[np.ndarray, np.ndarray]:
    """A double pyramid over a pentagram: it bends outwards at every edge, and is wound twice about its axis."""
    turn = 2.0 * np.arange(5) * 2.0 * np.pi / 5.0
    vertices = np.vstack([np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1), [[0, 0, 1], [0, 0, -1]]])
    around = np.arange(5)
    upper = np.stack([around, (around + 1) % 5, np.full(5, 5)], axis=1)
    lower = np.stack([(around + 1) % 5, around, np.full(5, 6)], axis=1)
    return vertices, np.vstack([upper, lower])


@pytest.mark.parametrize(("vertices", "faces", "sides"), [kind[1:] for kind in kinds()], ids=[k[0] for k in kinds()])
def test_known_shapes(vertices: np.ndarray, faces: np.ndarray, sides: int) -> None:
    assert sides_with_returns(vertices, faces.astype(np.int32)) == sides


@pytest.mark.parametrize("name", ["sphere", "box", "torus", "bowl"])
def test_rays_come_back_to_the_sides_that_are_named_and_to_no_other(name: str) -> None:
    """Rays leave random points of the surface to either side; a caster tells which meet it again."""
    mesh, rng = shapes.make(name), np.random.default_rng(5)
    chosen = rng.integers(0, len(mesh.faces), 4000)
    weights = rng.dirichlet((1, 1, 1), len(chosen))
    corners = mesh.vertices[mesh.faces[chosen]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points, ways = (weights[:, :, None] * corners).sum(axis=1), rng.normal(size=(len(chosen), 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    caster = ldtrefl.Raycaster(mesh.vertices, mesh.faces)
    for side, sign in ((FRONT, 1.0), (BACK, -1.0)):
        outwards = sign * normals
        directions = ways * np.sign((ways * outwards).sum(axis=1, keepdims=True))
        is_steep = (directions * outwards).sum(axis=1) > 0.05
        met = caster.trace((points + 1e-4 * outwards)[is_steep], directions[is_steep]).triangle >= 0
        assert met.any() == bool(mesh.sides_with_returns & side)


def test_a_mesh_far_from_its_origin_is_as_convex_as_at_it() -> None:
    sphere = shapes.make("sphere", {"segments": [40, 20]})
    for scale, offset in ((1e-6, 0.0), (1e6, 1e8), (1.0, 1e6)):
        far = ldtrefl.Mesh(scale * sphere.vertices + offset, sphere.faces)
        assert far.sides_with_returns == BACK
