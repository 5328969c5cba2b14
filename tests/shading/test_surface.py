"""Shading normals against the closed form of an ellipsoid's."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.description import Camera, Light, Material, Object, Scene
from tests.shading.facets import NO_LIGHT, TURNS, turned


@pytest.mark.parametrize("size", [1.0, 1e-6, (1.0, 3.0, 0.2), (2.0, 0.1, 7.0)], ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_smooth_normals_of_an_ellipsoid(turn: tuple, size: object) -> None:
    """The normal of an ellipsoid at p is p over the squares of its half-axes; light shows the cosine with it."""
    half = np.array((size,) * 3 if isinstance(size, float) else size, float)
    matrix = turned(turn)
    towards = matrix @ (np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8]))
    light = Light(kind="directional", direction=tuple((-towards).tolist()), radiance=(1, 1, 1))
    ball = Object(
        shape="sphere",
        params={"segments": [512, 256]},
        scale=size,
        rotate=turn,
        material=Material(albedo=(1, 1, 1)),
    )
    for unit in ([0.5, -0.6, 0.6245], [-0.3, 0.2, 0.9327]):
        local = np.array(unit) * half
        point, normal = matrix @ local, matrix @ (local / half**2)
        normal /= np.linalg.norm(normal)
        eye = point + 3.0 * half.max() * normal
        up = np.cross(normal, [0.1, 0.7, 0.3])
        camera = Camera(
            eye=tuple(eye.tolist()),
            look_at=tuple(point.tolist()),
            up=tuple(up.tolist()),
            width=1,
            height=1,
            fov_y=1e-4,
        )
        scene = Scene(camera=camera, lighting=NO_LIGHT, lights=(light,), objects=(ball,))
        image = ldtrefl.render(scene, "bvh").image[0, 0]
        np.testing.assert_allclose(image, max(0.0, normal @ towards), atol=2e-3)
