"""Mirrors in mirrors, and in uniform light, whose radiance is known on paper."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene

METHODS = ["bvh", "ldt"]
LIGHT = 0.7
"""Radiance of uniform surroundings."""
BLACK = Environment(sky=(0, 0, 0), ground=(0, 0, 0))
UNIFORM = Environment(sky=(LIGHT,) * 3, ground=(LIGHT,) * 3)

ROUNDING = 1e-5
"""Relative: float32 sums of some twenty bounces, and unit vectors whose length is rounded."""

REFLECTANCES = np.array([[0.95, 0.9, 0.8], [0.85, 0.97, 0.9]])
"""Of two mirrors, per channel. After 21 of them a hundredth is left: no path is too weak to follow."""


def glowing_mirror(reflectance: np.ndarray | float, radiance: float) -> Material:
    """A mirror that radiates, too."""
    return Material(albedo=(0, 0, 0), emission=(radiance,) * 3, mirror=tuple(np.broadcast_to(reflectance, 3)))


def grey_body(reflectance: float) -> Material:
    """A mirror that gives what it does not reflect of ``LIGHT`` by itself: in ``LIGHT`` all round it is not seen."""
    return glowing_mirror(reflectance, (1.0 - reflectance) * LIGHT)


def series(radiance: float, reflectance: np.ndarray | float, reflections: int, beyond: float) -> np.ndarray:
    """(3,) radiance of a path that meets glowing mirrors with each of its rays, the environment alone at its end."""
    weights = np.broadcast_to(reflectance, 3)[:, None] ** np.arange(reflections + 2)
    return radiance * weights[:, :-1].sum(axis=1) + beyond * weights[:, -1]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("bounces", range(1, 21))
def test_parallel_mirrors_give_the_sum_of_their_reflectances(method: str, bounces: int) -> None:
    """The camera stands between two glowing mirrors: their glow, by the products of their reflectances in turn; what
    remains beyond the last bounce shows the environment."""
    glow, far = np.array([0.3, 0.2]), 0.6
    walls = [
        Object(shape="plane", scale=30.0, translate=(0, 0, z), material=glowing_mirror(reflectance, radiance))
        for z, reflectance, radiance in zip((0.0, 1.0), REFLECTANCES, glow, strict=True)
    ]
    scene = Scene(
        camera=Camera(eye=(0, 0, 0.6), look_at=(0.3, 0.2, 0), width=16, height=12, fov_y=20),
        environment=Environment(sky=(far,) * 3, ground=(far,) * 3),
        lighting=Lighting(ambient=(0, 0, 0)),
        objects=tuple(walls),
    )
    expected, throughput = np.zeros(3), np.ones(3)
    for k in range(bounces + 1):
        expected += throughput * glow[k % 2]
        throughput *= REFLECTANCES[k % 2]
    expected += throughput * far
    image = ldtrefl.render(scene, method, max_bounces=bounces).image
    np.testing.assert_allclose(image, np.broadcast_to(expected, image.shape), rtol=ROUNDING)


SHAPES: dict[str, dict[str, object]] = {
    "sphere": {"shape": "sphere"},
    "coarse sphere": {"shape": "sphere", "params": {"segments": [10, 5]}},
    "room": {"shape": "room"},
    "torus": {"shape": "torus"},
    "knot": {"shape": "torus_knot", "params": {"segments": [300, 40]}},
    "bowl": {"shape": "bowl"},
    "sheet": {"shape": "bowl", "params": {"closed": False}},
    "hollow box": {"shape": "hollow_box"},
    "genus 3": {"shape": "genus3"},
    "teapot": {"shape": "teapot"},
}
"""Name -> what an object is made of."""


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("reflectance", [1.0, 0.6])
def test_a_mirror_in_uniform_light_is_not_seen(method: str, shape: str, reflectance: float) -> None:
    """In an environment of one radiance a whole mirror shows it wherever it is hit, however often; one that reflects a
    part shows it if it radiates the rest."""
    scene = Scene(
        camera=Camera(eye=(0.4, -3.0, 2.2), look_at=(0, 0, 0), width=96, height=72, fov_y=40),
        environment=UNIFORM,
        lighting=Lighting(ambient=(0, 0, 0)),
        objects=(Object(**SHAPES[shape], material=grey_body(reflectance)),),
    )
    frame = ldtrefl.render(scene, method, max_bounces=8)
    assert frame.reflector_mask.mean() > 0.1
    np.testing.assert_allclose(frame.image, LIGHT, rtol=ROUNDING)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("shape", ["sphere", "coarse sphere", "torus", "knot"])
def test_a_mirror_in_a_glowing_room_shows_the_room(method: str, shape: str) -> None:
    """Nothing of the black environment beyond the room is seen, and nothing but the room is bright."""
    room = Object(shape="room", scale=4.0, material=Material(albedo=(0, 0, 0), emission=(LIGHT,) * 3))
    scene = Scene(
        camera=Camera(eye=(0.4, -3.0, 2.2), look_at=(0, 0, 0), width=96, height=72, fov_y=40),
        environment=BLACK,
        lighting=Lighting(ambient=(0, 0, 0)),
        objects=(Object(**SHAPES[shape], material=glowing_mirror(1.0, 0.0)), room),
    )
    np.testing.assert_allclose(ldtrefl.render(scene, method, max_bounces=64).image, LIGHT, rtol=ROUNDING)


INSIDES = {
    "sphere": (0.3, 0.2, -0.1),
    "coarse sphere": (0.3, 0.2, -0.1),
    "room": (0.3, 0.2, -0.1),
    "torus": (1.05, 0.0, 0.1),
}
"""Closed shape -> a place inside."""


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("shape", INSIDES)
@pytest.mark.parametrize("bounces", [1, 2, 8])
def test_inside_a_glowing_mirror_every_path_has_all_its_bounces(method: str, shape: str, bounces: int) -> None:
    """The camera in a closed mirror: no path leaves it, so each brings the whole sum and the environment at its end."""
    eye = INSIDES[shape]
    scene = Scene(
        camera=Camera(eye=eye, look_at=tuple(np.add(eye, (-0.4, 1.0, 0.2))), width=72, height=48, fov_y=100),
        environment=Environment(sky=(5.0,) * 3, ground=(5.0,) * 3),
        lighting=Lighting(ambient=(0, 0, 0)),
        objects=(Object(**SHAPES[shape], material=glowing_mirror(0.8, 0.3)),),
    )
    image = ldtrefl.render(scene, method, max_bounces=bounces).image
    expected = series(0.3, 0.8, bounces, 5.0)
    np.testing.assert_allclose(image, np.broadcast_to(expected, image.shape), rtol=ROUNDING)


def crowd(material: Material) -> tuple[Object, ...]:
    """Mirrors of every kind that see each other, and touch."""
    places = [(-1.2, 0, 0), (1.2, 0.3, 0), (0, 1.4, 0.4), (0, -1.2, -0.2), (0, 0.2, 1.3)]
    names = ("sphere", "torus", "knot", "bowl", "hollow box")
    some = [Object(**SHAPES[n], scale=0.7, translate=p, material=material) for n, p in zip(names, places, strict=True)]
    return (*some, Object(shape="plane", scale=4.0, translate=(0, 0, -0.7), material=material))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("fresnel", [False, True])
@pytest.mark.parametrize("bounces", [1, 4, 20])
def test_mirrors_never_give_more_than_falls_on_them(method: str, fresnel: bool, bounces: int) -> None:
    """White mirrors in a furnace show its radiance; what follows Fresnel's law shows no more, along a floor either."""
    material = glowing_mirror(0.3 if fresnel else 1.0, 0.0)
    scene = Scene(
        camera=Camera(eye=(0.6, -4.5, -0.5), look_at=(0, 0, 0), width=96, height=72, fov_y=45),
        environment=UNIFORM,
        lighting=Lighting(ambient=(0, 0, 0)),
        objects=crowd(dataclasses.replace(material, fresnel=fresnel)),
    )
    image = ldtrefl.render(scene, method, max_bounces=bounces).image
    assert np.isfinite(image).all() and image.min() >= 0.0
    assert image.max() <= LIGHT * (1.0 + ROUNDING), f"{method}: {image.max() / LIGHT - 1.0:.2g} too bright"
    if not fresnel:
        np.testing.assert_allclose(image, LIGHT, rtol=ROUNDING)
