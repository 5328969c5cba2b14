"""Many objects of one mesh are drawn to the bit as each alone would be."""

import numpy as np
import pytest

from ldtrefl.frame import instances
from ldtrefl.frame.drawn_objects import DrawnObjects
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.instances import MANY, instances_among
from ldtrefl.frame.visibility import draw_gbuffer, draw_in_bands
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.scene.mesh import Mesh
from tests.frame.flat_mirror import on_device

CAMERAS = {
    "outside": Camera(eye=(0, -5, 1.2), look_at=(0, 0, 0), width=160, height=120),
    "among them": Camera(eye=(0, -0.5, 0.1), look_at=(0, 0, 0), fov_y=80, width=160, height=120),
    "wide": Camera(eye=(0, -0.3, 0.1), look_at=(0.1, 1, 0), fov_y=160, width=160, height=120),
    "far": Camera(eye=(0, -300, 20), look_at=(0, 0, 0), fov_y=2, width=160, height=120),
}
KINDS = {
    "balls": ("sphere", {"segments": [32, 16]}, 0.06, 300),
    "dense knots": ("torus_knot", {"segments": [300, 40]}, 0.12, 70),
    "boxes": ("box", {}, 0.1, 200),
    "rooms, wherein the camera may be": ("room", {}, 1.6, 70),
}


def scene_of(kind: str) -> Scene:
    shape, params, size, count = KINDS[kind]
    rng = np.random.default_rng(6)
    things = [
        Object(
            shape=shape,
            params=params,
            scale=tuple((size * rng.uniform(0.5, 1.5, 3)).tolist()),
            rotate=(1.0, 2.0, 3.0, 17.0 * k),
            translate=tuple(place),
            material=Material(mirror=0.5) if k % 7 == 0 else Material(),
        )
        for k, place in enumerate(rng.uniform(-1, 1, (count, 3)).tolist())
    ]
    return Scene(camera=CAMERAS["outside"], objects=tuple(things))


def assert_same(found: GBuffer, expected: GBuffer) -> None:
    np.testing.assert_array_equal(found.objects, expected.objects)
    np.testing.assert_array_equal(found.triangles, expected.triangles)
    np.testing.assert_array_equal(found.view.barycentrics.numpy(), expected.view.barycentrics.numpy())
    np.testing.assert_array_equal(found.reflector_mask, expected.reflector_mask)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("view", CAMERAS)
def test_instances_give_the_bits_of_objects_drawn_apart(kind: str, view: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, camera = on_device(scene_of(kind)), CAMERAS[view]
    found = draw_gbuffer(scene, camera)
    if view == "outside":
        assert len(np.unique(found.objects)) > 3
    monkeypatch.setattr(instances, "MANY", 10**9)
    assert_same(found, draw_gbuffer(scene, camera))
    monkeypatch.setattr(instances, "MANY", 1)
    monkeypatch.setattr(instances, "FIRST_BATCH", 7)
    assert_same(draw_gbuffer(scene, camera), found)


def test_bands_of_instances_are_parts_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, camera = on_device(scene_of("dense knots")), CAMERAS["outside"]
    whole = draw_gbuffer(scene, camera)
    monkeypatch.setattr("ldtrefl.frame.visibility.BAND_PIXELS", 40 * camera.width)
    bands = list(draw_in_bands(scene, camera))
    assert len(bands) == 3
    np.testing.assert_array_equal(np.concatenate([band.objects for band in bands]), whole.objects)
    np.testing.assert_array_equal(np.concatenate([band.triangles for band in bands]), whole.triangles)


def test_what_is_hidden_is_found_behind_a_wall() -> None:
    """A wall of boxes before many balls: no ball is seen, and each that looks over it is."""
    wall = [Object(shape="box", scale=(1.2, 0.1, 1.0), translate=(2.0 * x, 0, -1.0)) for x in range(-10, 11)]
    balls = [
        Object(shape="sphere", params={"segments": [16, 8]}, scale=0.2, translate=(x, 2.0 + y, z))
        for z in (-1.0, 0.3)
        for x in range(-5, 6)
        for y in range(3)
    ]
    camera = Camera(eye=(0, -6, 0), look_at=(0, 0, 0), fov_y=40, width=200, height=100)
    seen = np.unique(draw_gbuffer(on_device(Scene(camera=camera, objects=(*wall, *balls))), camera).objects)
    behind, above = np.split(len(wall) + np.arange(len(balls)), 2)
    assert not np.isin(behind, seen).any() and np.isin(above.reshape(-1, 3)[3:-3, 0], seen).all()


def test_meshes_of_many_objects_are_drawn_as_instances_but_for_those_with_outliers() -> None:
    many = [Object(shape="box", translate=(0, 3.0 * k, 0)) for k in range(MANY)]
    few = [Object(shape="torus", translate=(5, 3.0 * k, 0)) for k in range(MANY - 1)]
    far = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1e7, 0, 0], [1e7, 1, 0], [1e7, 0, 1]])
    ball = Object(shape="sphere", params={"segments": [32, 16]}).geometry
    faces = np.r_[ball.faces, len(ball.vertices) + np.arange(6).reshape(2, 3)]
    odd = Mesh(np.r_[ball.vertices, far], faces)
    assert len(odd.outliers) > 0
    outliers = [Object(mesh=odd, translate=(0, 0, 3.0 * k)) for k in range(MANY)]
    scene = on_device(Scene(camera=CAMERAS["outside"], objects=(*many, *few, *outliers)))
    every = np.arange(len(scene.objects))
    objects = DrawnObjects(every, np.ones(len(every)), np.zeros((len(every), 3, 4)))
    assert np.flatnonzero(instances_among(scene, objects)).tolist() == list(range(MANY))
    assert not instances_among(scene, objects.some(slice(1, None))).any()
