"""Cube maps as they are drawn: what each layer shows, and how near it is."""

import dataclasses

import numpy as np
import pytest
import warp as wp

from ldtrefl.device.stats import Stats
from ldtrefl.frame import visibility
from ldtrefl.methods.cube_maps.drawing import Drawn, draw_layers
from ldtrefl.methods.cube_maps.faces import CubeLayer
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene
from ldtrefl.tracing.nothing import no_shadows
from ldtrefl.tracing.scene_bvh import SceneBvh
from ldtrefl.world.device_scene import DeviceScene
from tests.frame.flat_mirror import on_device
from tests.methods.cube_maps.rooms import exits_of_box, texels, unit

RESOLUTION = 32
CENTRE = np.array([0.4, -0.3, 0.2])


def glowing(shape: str, color: tuple[float, float, float], **changes: object) -> Object:
    return Object(shape=shape, smooth=False, material=Material(albedo=0.0, emission=color), **changes)


def scene_of(*others: Object, lights: tuple[Light, ...] = ()) -> Scene:
    """A mirror ball about ``CENTRE`` and other objects."""
    mirror = Material(albedo=0.0, mirror=1.0)
    return Scene(
        camera=Camera(eye=(0, -3, 0), look_at=(0, 0, 0), width=8, height=8, fov_y=40),
        environment=Environment(sky=(0, 0, 1), ground=(0, 0, 1)),
        lighting=Lighting(ambient=0.0),
        lights=lights,
        objects=(Object(shape="sphere", scale=0.2, translate=tuple(CENTRE), material=mirror), *others),
    )


def drawn(scene: DeviceScene, what: Drawn) -> list[CubeLayer]:
    behind = SceneBvh().bound(scene, range(len(scene.objects)), Stats())
    return draw_layers(what, scene, scene.objects[0], no_shadows(scene.device), behind, True)


def distances(layer: CubeLayer, scene: DeviceScene) -> np.ndarray:
    """(n,) in the world."""
    with np.errstate(divide="ignore"):
        return np.linalg.norm(texels(RESOLUTION), axis=1) / layer.nearness.numpy() / scene.device_units_per_world_unit


@pytest.mark.parametrize("pixels", [visibility.BAND_PIXELS, 300])
def test_layers_of_a_box_in_a_box(pixels: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The reflector stands in a green box, that in a red one; around is the environment."""
    monkeypatch.setattr(visibility, "BAND_PIXELS", pixels)
    scene = on_device(scene_of(glowing("box", (0, 1, 0)), glowing("box", (1, 0, 0), scale=2.5)))
    layers = drawn(scene, Drawn(RESOLUTION, 2, True))
    ways = unit(texels(RESOLUTION))
    for layer, half, color in zip(layers, (1.0, 2.5), ([0, 1, 0], [1, 0, 0]), strict=True):
        expected = exits_of_box(np.zeros(3), ways, -half - CENTRE, half - CENTRE)
        np.testing.assert_allclose(distances(layer, scene), expected, rtol=1e-5)
        np.testing.assert_allclose(layer.radiance.numpy(), np.tile(color, (len(ways), 1)), atol=1e-6)


def test_the_environment_has_no_nearness() -> None:
    scene = on_device(scene_of(glowing("sphere", (1, 0, 0), translate=(5, 0, 0))))
    front, back = drawn(scene, Drawn(RESOLUTION, 2, True))
    is_ball = front.nearness.numpy() > 0
    assert 5 < is_ball.sum() < 200 and (back.nearness.numpy()[~is_ball] == 0).all()
    for layer in (front, back):
        np.testing.assert_allclose(
            layer.radiance.numpy()[~is_ball], np.tile([0, 0, 1], ((~is_ball).sum(), 1)), atol=1e-6
        )


@pytest.mark.parametrize("kind", ["sphere", "rectangle"])
def test_a_light_with_a_shape_is_where_it_stands(kind: str) -> None:
    shape = {"radius": 0.5} if kind == "sphere" else {"width": 1.0, "height": 1.0, "direction": (-1.0, 0.0, 0.0)}
    at = (float(CENTRE[0]) + 2.0, *CENTRE[1:].tolist())
    light = Light(kind=kind, position=at, radiance=(3.0, 2.0, 1.0), **shape)
    far = glowing("box", (0, 1, 0), scale=4.0)
    scene = on_device(scene_of(far, lights=(light,)))
    (layer,) = drawn(scene, Drawn(RESOLUTION, 1, True))
    ways = unit(texels(RESOLUTION))
    ahead = np.argmax(ways[:, 0])
    is_light = np.isclose(layer.radiance.numpy()[:, 0], 3.0)
    assert is_light[ahead] and 20 < is_light.sum() < 400
    x = ways[ahead, 0]
    expected = 2 * x - np.sqrt(0.5**2 - 2**2 * (1 - x * x)) if kind == "sphere" else 2 / x
    assert distances(layer, scene)[ahead] == pytest.approx(expected, rel=1e-5)
    assert (distances(layer, scene)[is_light] < 2.2).all() and (distances(layer, scene)[~is_light] > 3.0).all()


def test_what_touches_the_eye_has_no_place() -> None:
    """A plate through the centre: along it nothing is near, and no texel is nearer than float32 can say."""
    plate = glowing("plane", (1, 0, 0), translate=tuple(CENTRE))
    for layer in drawn(on_device(scene_of(plate)), Drawn(RESOLUTION, 2, True)):
        assert np.isfinite(layer.nearness.numpy()).all() and np.isfinite(layer.radiance.numpy()).all()


def test_mirrors_reflect_the_environment() -> None:
    """A mirror lies on the ground, and another stands behind a plate: seen in them, up is down."""
    half = Material(albedo=0.0, mirror=0.5)
    floor = Object(shape="plane", scale=3.0, translate=(0.0, 0.0, -1.0), material=half)
    black = Object(shape="plane", scale=6.0, translate=(0.0, 0.0, 2.0), material=Material(albedo=0.0))
    above = Object(shape="plane", scale=30.0, translate=(0.0, 0.0, 3.0), material=half)
    given = dataclasses.replace(scene_of(floor, black, above), environment=Environment(sky=(0, 0, 1), ground=(1, 0, 0)))
    front, back = drawn(on_device(given), Drawn(RESOLUTION, 2, True))
    ways = unit(texels(RESOLUTION))
    at_height = {z: CENTRE + ways * ((z - CENTRE[2]) / ways[:, 2])[:, None] for z in (-1.0, 2.0)}
    on_floor = (ways[:, 2] < 0) & (np.abs(at_height[-1.0][:, :2]).max(axis=1) < 2.9)
    behind = (ways[:, 2] > 0) & (np.abs(at_height[2.0][:, :2]).max(axis=1) < 5.8)
    blend = 0.5 - 0.5 * ways[:, 2:]
    expected = 0.5 * (blend * [0, 0, 1] + (1 - blend) * [1, 0, 0])
    assert on_floor.sum() > 500 and behind.sum() > 500
    np.testing.assert_allclose(front.radiance.numpy()[on_floor], expected[on_floor], atol=1e-5)
    np.testing.assert_allclose(back.radiance.numpy()[behind], expected[behind], atol=1e-5)
    assert not front.radiance.numpy()[behind].any()


def test_what_nothing_reads_is_not_kept() -> None:
    scene = on_device(scene_of(glowing("box", (0, 1, 0))))
    (layer,) = drawn(scene, Drawn(RESOLUTION, 1, False))
    assert layer.nearness.shape == (0,) and layer.radiance.shape == (6 * RESOLUTION**2,)
    assert isinstance(layer.radiance, wp.array)
    assert Drawn(RESOLUTION, 1, False).bytes == 12 * 6 * RESOLUTION**2
    assert Drawn(RESOLUTION, 2, True).bytes == 32 * 6 * RESOLUTION**2
    assert 0 < Drawn(RESOLUTION, 1, False).working_bytes < Drawn(RESOLUTION, 2, True).working_bytes
