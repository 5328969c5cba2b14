"""Primary visibility: the z-buffer against the ray caster, and cameras in odd places."""

import numpy as np
import pytest
from stress_cases.inputs import camera_rays

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world.device_scene import DeviceScene


def gbuffer(camera: Camera, *objects: Object) -> GBuffer:
    scene = Scene(camera=camera, objects=objects)
    return draw_gbuffer(DeviceScene(scene, launch.resolve_device(None)), camera)


CAMERAS = {
    "outside": Camera(eye=(1.5, -3, 1), look_at=(0, 0, 0), width=120, height=80),
    "inside the ring": Camera(eye=(0.0, 0.05, 0.02), look_at=(1, 0.3, 0.1), fov_y=100, width=120, height=80),
    "wide": Camera(eye=(0.4, -1.5, 0.4), look_at=(0, 0, 0), fov_y=170, width=120, height=80),
    "narrow": Camera(eye=(30, -300, 10), look_at=(0.3, 0, 0), fov_y=0.1, width=120, height=80),
    "flat image": Camera(eye=(1.5, -3, 1), look_at=(0, 0, 0), width=512, height=1),
    "steep image": Camera(eye=(1.5, -3, 1), look_at=(0, 0, 0), width=1, height=512),
    "along up": Camera(eye=(0.1, 0.1, 4), look_at=(0.1, 0.1 + 1e-4, 0), width=120, height=80),
}


@pytest.mark.parametrize("shape", ["torus_knot", "box", "room"])
@pytest.mark.parametrize("name", sorted(CAMERAS))
def test_zbuffer_agrees_with_the_raycaster(name: str, shape: str) -> None:
    camera = CAMERAS[name]
    seen = gbuffer(camera, Object(shape=shape))
    mesh = shapes.make(shape)
    hits = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(*camera_rays(camera))
    wrong = seen.triangles.ravel() != hits.triangle
    # Pixels on an edge may go to either triangle: allow one in 200 of them, which silhouettes and seams stay below.
    assert wrong.sum() <= max(2, wrong.size // 200), f"{name}, {shape}: {wrong.sum()} of {wrong.size} pixels"
    hole = (seen.triangles.ravel() < 0) & (hits.triangle >= 0)
    assert hole.sum() <= max(2, wrong.size // 2000)


def test_no_cracks_in_a_closed_room() -> None:
    for eye in ((0.3, 0.2, 0.1), (0.99, -0.99, 0.5), (0, 0, 0)):
        camera = Camera(eye=eye, look_at=(-0.5, 0.9, -0.2), fov_y=120, width=300, height=200)
        assert (gbuffer(camera, Object(shape="room", params={"segments": 13})).triangles >= 0).all()


def test_triangles_of_every_shape_cover_the_pixels_inside() -> None:
    camera = Camera(eye=(0, 0, 0), look_at=(0, 1, 0), fov_y=90, width=60, height=40)
    x, y = np.meshgrid(np.arange(60) + 0.5, np.arange(40) + 0.5)
    random = np.random.default_rng(5)
    for turn in range(60):
        # Of any size from two pixels to a thousand times the view, every other one flat, in front of the camera.
        extent = 10.0 ** random.uniform(0.3, 4.5)
        corners = random.uniform(-extent, extent, (3, 2)) * (1.0, 1e-3 if turn % 2 else 1.0) + random.uniform(5, 35, 2)
        depth = random.uniform(1, 3, 3)
        across, down = (corners[:, 0] / 20 - 1.5) * depth, (corners[:, 1] / 20 - 1.0) * depth
        mesh = ldtrefl.Mesh(np.stack([across, depth, -down], axis=1), np.array([[0, 1, 2]]))
        seen = gbuffer(camera, Object(mesh=mesh)).objects
        beside = []
        for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            along = (q - p) / np.linalg.norm(q - p)
            beside.append(along[0] * (y - p[1]) - along[1] * (x - p[0]))
        inside = np.maximum(np.min(beside, axis=0), -np.max(beside, axis=0))  # pixels from the nearest edge
        # Corners are kept in float32.
        assert (seen[inside > 1e-6 * extent + 1e-4] == 0).all() and (seen[inside < -1e-6 * extent - 1e-4] == -1).all()


def test_positions_and_normals() -> None:
    camera = CAMERAS["outside"]
    scene = Scene(camera=camera, objects=(Object(shape="sphere"),))
    device_scene = DeviceScene(scene, launch.resolve_device(None))
    seen = draw_gbuffer(device_scene, camera)
    position, normal = (x.numpy().reshape(80, 120, 3)[seen.objects >= 0] for x in seen.surfaces)
    np.testing.assert_allclose(np.linalg.norm(position, axis=1), 1.0, atol=2e-3)
    np.testing.assert_allclose(normal, position, atol=5e-3)


def test_nearer_object_hides_the_farther() -> None:
    camera = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=9, height=9, fov_y=5)
    near = Object(shape="plane", rotate=(1, 0, 0, 90), translate=(0, -1, 0))
    far = Object(shape="plane", rotate=(1, 0, 0, 90))
    assert (gbuffer(camera, far, near).objects == 1).all()
    assert (gbuffer(camera, near, far).objects == 0).all()


def test_a_scene_moved_and_scaled_as_a_whole_looks_the_same() -> None:
    def image(scale: float, offset: float) -> np.ndarray:
        move = lambda p: tuple(scale * c + offset for c in p)  # noqa: E731
        camera = Camera(eye=move((1.5, -3, 1)), look_at=move((0, 0, 0)), width=90, height=60)
        ball = Object(shape="sphere", scale=0.8 * scale, translate=move((0, 0, 0)))
        return gbuffer(camera, ball).objects

    base = image(1.0, 0.0)
    for scale in (1e-6, 1e-3, 1e6):
        assert (image(scale, 0.0) != base).sum() <= 2
        assert (image(scale, 1e6 * scale) != base).sum() <= 4


def test_empty_scene() -> None:
    camera = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)
    assert (gbuffer(camera).objects == -1).all()
    assert np.isfinite(ldtrefl.render(Scene(camera=camera)).image).all()
