"""The environment as it is seen, by a camera and in a mirror: against closed forms."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene
from ldtrefl.scene.presets.base import direction
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.environment_frame import world_from_environment
from tests.shading.facets import SIZES, TURNS, Facet


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_mirror_sees_the_environment_along_the_reflected_direction(turn: tuple, size: object) -> None:
    """``mirror * (blend of sky and ground)`` by the height of ``2 (n . v) n - v`` over the camera's up."""
    facet = Facet(turn, size, 50.0)
    mirror = Material(albedo=(0, 0, 0), mirror=(0.9, 0.5, 0.1))
    two = Environment(sky=(1, 0, 2), ground=(0, 1, 2))
    onwards = 2 * (facet.normal @ facet.to_eye) * facet.normal - facet.to_eye
    blend = 0.5 + 0.5 * onwards @ np.array(facet.camera.up)
    expected = np.array([0.9, 0.5, 0.1]) * [blend, 1 - blend, 2.0]
    for method in ("bvh", "ldt"):
        np.testing.assert_allclose(facet.seen(mirror, method, environment=two), expected, rtol=2e-5)


def seen(environment: Environment, targets: list, up: tuple = (0, 0, 1)) -> np.ndarray:
    """(n, 3) what a camera sees of nothing but the environment, in the middle of its picture."""
    found = []
    for target in targets:
        camera = Camera(eye=(0, 0, 0), look_at=tuple(map(float, target)), up=up, width=1, height=1, fov_y=1e-4)
        found.append(ldtrefl.render(Scene(camera=camera, environment=environment)).image[0, 0])
    return np.array(found)


@pytest.mark.parametrize("kind", ["png", "exr"])
def test_an_image_is_turned_and_made_stronger(tmp_path: Path, kind: str) -> None:
    """Turned by 90 degrees, a quarter of the columns; by any angle, what is seen where it was turned to. Strength is a
    factor."""
    picture = np.random.default_rng(1).uniform(0.0, 1.0, (16, 32, 3)).astype(np.float32)
    ldtrefl.save_image(tmp_path / f"a.{kind}", picture)
    image = str(tmp_path / f"a.{kind}")
    stored = ldtrefl.load_image(image)
    ldtrefl.save_image(tmp_path / "b.exr", np.roll(stored, -8, axis=1))
    angles = np.radians([-170.0, -91.0, 10.0, 40.0, 100.0, 179.0])
    at = [(np.cos(angle), np.sin(angle), 0.3) for angle in angles]
    plain = seen(Environment(image=image), at)
    quarter = seen(Environment(image=image, rotation=90.0), at)
    np.testing.assert_allclose(quarter, seen(Environment(image=str(tmp_path / "b.exr")), at), atol=1e-4)
    for rotation in (37.0, -250.0, 1000.0):
        turned = [(np.cos(a), np.sin(a), 0.3) for a in angles + np.radians(rotation)]
        strong = seen(Environment(image=image, rotation=rotation, strength=3.0), turned)
        np.testing.assert_allclose(strong, 3.0 * plain, atol=1e-4)
    assert np.abs(quarter - plain).max() > 0.1


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 0.6, -0.8)], ids=str)
def test_the_sun_stands_where_its_light_comes_from(tmp_path: Path, up: tuple) -> None:
    """Its disc in the middle; a degree off, its glare; at any ``up`` and rotation; all before the sky's picture."""
    sun = Environment(preset="sky", sun_elevation=35.0, sun_azimuth=20.0, rotation=50.0, strength=0.5)
    assert sun.surroundings is not None and sun.surroundings.disc is not None
    frame = world_from_environment(np.array(up, float), 0.0)
    towards, off = frame @ direction(70.0, 35.0), frame @ direction(70.0, 36.0)
    scene = Scene(camera=Camera(eye=(0, 0, 0), look_at=(1, 2, 3), up=up), environment=sun)
    (light,) = DeviceScene(scene, launch.resolve_device("cpu")).lighting.lights.numpy()
    np.testing.assert_allclose(light["towards"], towards, atol=1e-6)
    np.testing.assert_allclose(light["radiance"], 0.5 * np.array(sun.surroundings.lights[0].radiance), rtol=1e-6)
    disc = 0.5 * np.array(sun.surroundings.disc.radiance)
    at = [towards, off, frame @ direction(70.0, 44.0)]
    middle, near, far = seen(sun, at, up) - seen(without_disc(sun, tmp_path), at, up)
    np.testing.assert_allclose(middle, disc, rtol=1e-4)
    np.testing.assert_allclose(near, 0.2666**3 * disc, rtol=1e-3)
    np.testing.assert_array_equal(far, 0.0)


def without_disc(environment: Environment, folder: Path) -> Environment:
    """A preset's picture alone."""
    assert environment.picture is not None
    ldtrefl.save_image(folder / "sky.exr", environment.picture.pixels)
    return Environment(image=str(folder / "sky.exr"), rotation=environment.rotation, strength=environment.strength)


def test_a_setting_sun_is_cut_by_the_horizon(tmp_path: Path) -> None:
    low = Environment(preset="sky", sun_elevation=0.0, sun_azimuth=90.0, turbidity=2.0)
    assert low.surroundings is not None and low.surroundings.disc is not None
    at = [(0.0, 1.0, 0.001), (0.0, 1.0, -0.001)]
    above, below = seen(low, at) - seen(without_disc(low, tmp_path), at)
    np.testing.assert_array_equal(below, 0.0)
    np.testing.assert_allclose(above, low.surroundings.disc.radiance, rtol=1e-4)


@pytest.mark.parametrize("preset", ["studio", "sky", "sunset"])
def test_a_preset_turns_as_one(preset: str) -> None:
    """A picture of a rough metal, a matt and a mirror ball, from a camera that goes around as the environment is
    turned, stays the same. Strength is a factor on all of it."""
    ball = Object(shape="sphere", material=Material(albedo=0.5, roughness=0.5, metallic=1.0))
    pearl = Object(shape="sphere", translate=(0, 0, 1.3), scale=0.4, material=Material(albedo=0.7))
    mirror = Object(shape="sphere", translate=(0, 0, 2.2), material=Material(mirror=0.9))

    def picture(rotation: float, strength: float = 1.0) -> np.ndarray:
        around = np.radians(rotation)
        eye = (9.0 * np.cos(around), 9.0 * np.sin(around), 3.0)
        camera = Camera(eye=eye, look_at=(0, 0, 1), width=48, height=48)
        environment = Environment(preset=preset, rotation=rotation, strength=strength)
        lighting = Lighting(shadows=True)
        made = Scene(camera=camera, environment=environment, lighting=lighting, objects=(ball, pearl, mirror))
        return ldtrefl.render(made, "bvh").image

    still = picture(0.0)
    # 192 segments: the balls are the same after a turn by 7.5 degrees; rounding moves silhouettes and shadows.
    for rotation in (7.5, 90.0):
        turned = picture(rotation)
        assert (np.abs(turned - still).max(axis=-1) > 0.02 * (1.0 + still.max(axis=-1))).mean() < 0.01
        np.testing.assert_allclose(turned.mean(axis=(0, 1)), still.mean(axis=(0, 1)), rtol=5e-3)
    np.testing.assert_allclose(picture(0.0, 0.25), 0.25 * still, rtol=1e-5)


def test_the_sun_goes_with_the_camera_that_is_given() -> None:
    """A renderer whose camera gets another ``up`` turns the sky and the sun's light alike."""
    ball = Object(shape="sphere", material=Material(albedo=0.5))
    first = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=16, height=16)
    second = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), up=(1, 0, 0), width=16, height=16)
    scene = Scene(camera=first, environment=Environment(preset="sky"), objects=(ball,))
    renderer = ldtrefl.Renderer(scene)
    before = renderer.render().image
    np.testing.assert_array_equal(renderer.render(camera=second).image, ldtrefl.render(scene.with_camera(second)).image)
    np.testing.assert_array_equal(renderer.render(camera=first).image, before)


def test_what_a_picture_shows_is_mirrored_once(tmp_path: Path) -> None:
    """A rough metal shows the studio's boxes blurred, and no highlights of the lights that stand for them; but of the
    sun, which the picture does not show."""
    for preset, has_highlight in (("studio", False), ("sky", True)):
        whole = Environment(preset=preset, sun_elevation=60.0 if has_highlight else None)
        metal = Object(shape="sphere", material=Material(albedo=1.0, metallic=1.0, roughness=0.4))
        camera = Camera(eye=(0, -9, 3), look_at=(0, 0, 0), width=40, height=40, fov_y=15.0)
        scene = Scene(camera=camera, environment=whole, lighting=Lighting(ambient=0.0), objects=(metal,))
        shown = ldtrefl.render(scene).image
        picture = ldtrefl.render(dataclasses.replace(scene, environment=without_disc(whole, tmp_path))).image
        assert ((shown - picture).max() > 0.5) == has_highlight, preset
        if not has_highlight:
            np.testing.assert_array_equal(shown, picture)
