"""Patches of a sphere: on its tangent planes, a little wider than texels, and leaving nothing of it open."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.ldt.exact.patch import LARGE
from ldtrefl.ldt.exact.patches import FACING, PATCH_MARGIN
from ldtrefl.ldt.exact.survey import Survey
from ldtrefl.ldt.texel_frame import texel_frame
from ldtrefl.scene import shapes
from ldtrefl.world.device_mesh import DeviceMesh

RESOLUTION, CELLS = 48, 24


@pytest.fixture(scope="module")
def survey() -> Survey:
    ball = shapes.make("sphere", {"segments": [500, 250]})
    mesh = ldtrefl.Mesh(ball.vertices, ball.faces)
    return Survey(DeviceMesh(mesh, launch.resolve_device(None)), texel_frame(mesh, RESOLUTION), CELLS, 0.0)


def test_patches_lie_on_the_sphere_and_face_its_maps(survey: Survey) -> None:
    assert survey.count > 0
    patches, texel = (array.numpy() for array in survey.patches())
    per_unit = survey.cells_per_texel * survey.frame.scale
    centre = np.array(survey.frame.offset) * survey.cells_per_texel
    middle = patches["corner"] + 0.5 * (patches["edge_u"] + patches["edge_v"]) - centre
    np.testing.assert_allclose(np.linalg.norm(middle, axis=1), per_unit, rtol=1e-3)
    normal = np.cross(patches["edge_u"], patches["edge_v"])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    assert ((normal * middle).sum(axis=1) > 0.999 * per_unit).all()
    axis = patches["kind"] % int(LARGE)
    first = np.array(survey.frame.first_texels)
    np.testing.assert_array_equal(axis, np.searchsorted(first, texel, side="right") - 1)
    assert (np.abs(normal[np.arange(len(axis)), axis]) >= float(FACING) - 1e-3).all()


def test_a_patch_is_its_texel_and_the_margin(survey: Survey) -> None:
    assert survey.count > 0
    patches, texel = (array.numpy() for array in survey.patches())
    side = (1.0 + 2.0 * float(PATCH_MARGIN)) * survey.cells_per_texel
    for axis in range(3):
        own = patches["kind"] % int(LARGE) == axis
        u, v = (axis + 1) % 3, (axis + 2) % 3
        extent = np.abs(patches["edge_u"][own]) + np.abs(patches["edge_v"][own])
        np.testing.assert_allclose(extent[:, [u, v]], side, rtol=1e-5)
        columns = survey.frame.size[u]
        number = texel[own] - survey.frame.first_texels[axis]
        middle = (patches["corner"] + 0.5 * (patches["edge_u"] + patches["edge_v"]))[own] / survey.cells_per_texel
        np.testing.assert_allclose(middle[:, u], number % columns + 0.5, atol=1e-4)
        np.testing.assert_allclose(middle[:, v], number // columns + 0.5, atol=1e-4)


def test_patches_leave_nothing_of_the_sphere_open(survey: Survey) -> None:
    """A point lies in a texel that has a patch, on the point's side, in the map of the axis that it faces most."""
    patches, texel = (array.numpy() for array in survey.patches())
    points = np.random.default_rng(0).normal(size=(20_000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    axis = np.abs(points).argmax(axis=1)
    row = np.arange(len(points))
    at = points * survey.frame.scale + survey.frame.offset
    u, v = (np.floor(at[row, (axis + k) % 3]).astype(int) for k in (1, 2))
    wanted = np.array(survey.frame.first_texels)[axis] + v * RESOLUTION + u

    own = patches["kind"] % int(LARGE)
    middle = patches["corner"] + 0.5 * (patches["edge_u"] + patches["edge_v"])
    is_high = middle[np.arange(len(own)), own] > np.array(survey.frame.offset)[own] * survey.cells_per_texel
    there = set(zip(texel.tolist(), is_high.tolist(), strict=True))
    is_open = [place not in there for place in zip(wanted.tolist(), (points[row, axis] > 0).tolist(), strict=True)]
    assert not any(is_open), f"{sum(is_open)} of {len(points)} points have no patch"
