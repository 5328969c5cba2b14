"""The survey of triangles: which way a closed mesh looks, and that nothing thin or large is lost."""

import numpy as np
import pytest
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.ldt.exact.survey import Survey
from ldtrefl.ldt.texel_frame import texel_frame
from ldtrefl.scene import shapes
from ldtrefl.world.device_mesh import DeviceMesh

from .differences import DENSE_KNOT


def survey_of(mesh: ldtrefl.Mesh, resolution: int = 64) -> Survey:
    geometry = DeviceMesh(mesh, launch.resolve_device(None))
    return Survey(geometry, texel_frame(mesh, resolution), resolution // 2, 0.9)


def test_the_front_is_that_of_a_closed_mesh() -> None:
    ball = shapes.make("sphere", {"segments": [64, 32]})
    faces = {1: ball.faces, -1: ball.faces[:, ::-1], 0: ball.faces[:-1]}
    mixed = ball.faces.copy()
    mixed[::2] = mixed[::2, ::-1]
    for front, given in faces.items():
        assert survey_of(ldtrefl.Mesh(ball.vertices, given)).front == front
    assert survey_of(ldtrefl.Mesh(ball.vertices, mixed)).front == 0


def test_triangles_are_small_or_stay_triangles() -> None:
    """A fine ball beside one triangle as large as itself."""
    ball = shapes.make("sphere", {"segments": [400, 200]})
    n = len(ball.vertices)
    vertices = np.concatenate([ball.vertices, [[-1, -1, 1.5], [1, -1, 1.5], [0, 1, 1.5]]])
    survey = survey_of(ldtrefl.Mesh(vertices, np.concatenate([ball.faces, [[n, n + 1, n + 2]]])))
    assert survey.small == len(ball.faces) and survey.triangles == survey.small + 1
    patches, texel = survey.patches()
    triangles = patches.numpy()["triangle"]
    assert len(triangles) == survey.count == len(texel) and 0 <= triangles.min() and triangles.max() < len(ball.faces)


def test_patches_do_not_lose_what_is_thin_or_large() -> None:
    """A dense knot with wires far thinner than a texel and one large triangle: none of them may vanish."""
    knot, wires = shapes.make("torus_knot", DENSE_KNOT), shapes.make("wires", {"count": 3, "radius": 0.0004})
    sheet = np.array([[-1, -1, 0.9], [1, -1, 0.9], [0, 1, 0.9]])
    offset = len(knot.vertices)
    below = np.array([0, 0, -0.8])
    vertices = np.concatenate([knot.vertices, wires.vertices + below, sheet])
    faces = [knot.faces, wires.faces + offset, [np.arange(3) + offset + len(wires.vertices)]]
    mesh = ldtrefl.Mesh(vertices, np.concatenate(faces))
    maps = ldtrefl.peel(mesh.vertices, mesh.faces)
    assert maps.tree.patches
    rng = np.random.default_rng(0)
    targets = wires.vertices[wires.faces[rng.integers(0, len(wires.faces), 4000)]].mean(axis=1) + below
    origins = np.tile(np.array([[0.3, 0.2, -3.0]]), (len(targets), 1))
    truth = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, targets - origins)
    on_wires = truth.triangle >= len(knot.faces)
    found = maps.trace(origins, targets - origins)
    assert on_wires.sum() > 1000
    assert (found.triangle[on_wires] >= len(knot.faces)).mean() >= 0.99
    down = maps.trace([[0.0, -0.5, 3.0]], [[0.0, 0.0, -1.0]])
    assert down.triangle[0] == len(mesh.faces) - 1


@pytest.mark.parametrize("quality", ["balanced", "exact", "fast"])
def test_wires_of_a_fifth_of_a_texel_are_found(quality: str) -> None:
    mesh = shapes.make("wires", {"radius": 0.2 / 256})
    origins, directions = rays_about(mesh, 300_000, 1)
    truth = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, directions).triangle >= 0
    found = ldtrefl.peel(mesh.vertices, mesh.faces, quality=quality).trace(origins, directions).triangle >= 0
    assert truth.sum() > 5000
    assert (found & truth).sum() >= 0.99 * truth.sum() and (found & ~truth).sum() <= 0.01 * truth.sum()
