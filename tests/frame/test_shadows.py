"""Shadows of a box against closed forms: on the ground, on the box itself, and of a light between ground and box.

The bounding sphere of the box reaches into the ground.
"""

import numpy as np
import pytest

from ldtrefl.device.stats import Stats
from ldtrefl.frame.camera_shading import shade_gbuffer
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene.description import Camera, Light, Lighting, Material, Object, Scene
from ldtrefl.tracing.scene_bvh import SceneBvh
from tests.frame import flat_mirror

PLACE = np.array([0.1, 0.5, 0.7])
MARGIN = 1e-4
"""Of the box's half side: floor points whose ray passes an edge nearer than that are not held to an answer."""


def lit_box(light: Light) -> Scene:
    """A white box over white ground in one light."""
    white = Material(albedo=1.0)
    ground = Object(shape="plane", scale=3.0, material=white)
    box = Object(shape="box", scale=0.5, translate=tuple(PLACE.tolist()), material=white, smooth=False)
    camera = Camera(eye=(1.5, -4.0, 3.0), look_at=(0.0, 0.5, 0.3), width=121, height=80, fov_y=60.0)
    lighting = Lighting(ambient=(0, 0, 0), shadows=True)
    return Scene(camera=camera, lights=(light,), lighting=lighting, objects=(ground, box))


def shaded(given: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(n,) radiance, (n,) object, (n, 3) position and (n, 3) normal of the pixels that see something."""
    scene = flat_mirror.on_device(given)
    gbuffer = draw_gbuffer(scene, given.camera)
    bvhs = SceneBvh()  # which own what the tracer reads
    shadow = bvhs.bound(scene, {0, 1}, Stats())
    radiance = shade_gbuffer(gbuffer, shadow, starts_rays=False).radiance.numpy()[:, 0]
    position, normal = (array.numpy() for array in gbuffer.surfaces)
    seen = gbuffer.objects.ravel() >= 0
    position = flat_mirror.in_world(scene, position)
    return radiance[seen], gbuffer.objects.ravel()[seen], position[seen], normal[seen]


def passes_box(start: np.ndarray, way: np.ndarray, half: float, end: float) -> np.ndarray:
    """(n,) whether rays cross a box about ``PLACE`` before ``end`` lengths of ``way``."""
    sides = (np.stack([PLACE - half, PLACE + half])[:, None] - start) / way
    enter, leave = sides.min(axis=0).max(axis=1), sides.max(axis=0).min(axis=1)
    return (enter < leave) & (leave > 0) & (enter < end)


@pytest.mark.parametrize("kind", ["directional", "point", "point below the box"])
def test_a_boxs_shadow_on_the_ground(kind: str) -> None:
    towards, position = np.array([0.3, 0.4, 0.9]), np.array([0.4, 0.2, 2.6])
    if kind == "directional":
        light = Light(kind="directional", direction=tuple((-towards).tolist()), radiance=(2, 2, 2))
    else:
        position = position if kind == "point" else np.array([0.1, 0.5, 0.1])
        light = Light(kind="point", position=tuple(position.tolist()), intensity=(2, 2, 2))
    radiance, objects, start, _ = shaded(lit_box(light))
    start, radiance = start[objects == 0], radiance[objects == 0]
    way = np.broadcast_to(towards, start.shape) if kind == "directional" else position - start
    end = np.inf if kind == "directional" else 1.0
    distance = np.linalg.norm(way, axis=1)
    arriving = 2.0 * way[:, 2] / distance / (1.0 if kind == "directional" else distance**2)
    is_dark = passes_box(start, way, 0.5 * (1 - MARGIN), end)
    is_light = ~passes_box(start, way, 0.5 * (1 + MARGIN), end)
    assert (is_dark | is_light).mean() > 0.99 and is_light.sum() > 300
    assert is_dark.sum() > 40 if kind != "point below the box" else not is_dark.any()
    assert (radiance[is_dark] == 0.0).all()
    np.testing.assert_allclose(radiance[is_light], arriving[is_light], rtol=1e-4)


def test_a_box_does_not_darken_its_own_lit_sides() -> None:
    towards = np.array([0.5, -0.6, 0.7]) / np.linalg.norm([0.5, -0.6, 0.7])
    light = Light(kind="directional", direction=tuple((-towards).tolist()), radiance=(2, 2, 2))
    radiance, objects, _, normal = shaded(lit_box(light))
    cosine = normal[objects == 1] @ towards
    assert len(np.unique(normal[objects == 1].round(3), axis=0)) == 3
    np.testing.assert_allclose(radiance[objects == 1], 2.0 * np.maximum(cosine, 0.0), rtol=1e-5)
