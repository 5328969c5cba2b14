"""Mitsuba's frames of the benchmark: light by closed forms, and whole pictures against ours."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from benchmark_parts import frame_scenes
from benchmark_parts.frame_scenes import frame_scene, moving
from mitsuba_parts.emission_only import emission_only
from mitsuba_parts.judge import around, is_off
from mitsuba_parts.mitsuba_frames import LitFrames, MitsubaFrames, PathFrames, ScalarPathFrames

import ldtrefl
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene

BRICKS = str(Path(__file__).parent.parent.parent / "scenes" / "textures" / "bricks.png")

pytestmark = pytest.mark.usefixtures("with_mitsuba")

SUN = Light(kind="directional", direction=(0.0, 0.6, -0.8), radiance=(1.0, 2.0, 3.0))
LAMP = Light(kind="point", position=(0.0, 0.0, 2.0), intensity=(8.0, 4.0, 2.0))
AMBIENT = np.array([0.1, 0.2, 0.3])
ALBEDO = np.array([0.5, 0.4, 0.2])
LID = Object(shape="box", scale=0.5, translate=(0.0, 0.0, 5.0))
"""Above the camera, and between the sun and what the camera sees."""


def of_a_plane(light: Light, *objects: Object, shadows: bool = False) -> Scene:
    """The middle of a plane at z = 0, seen from straight above in pixels that are next to nothing."""
    return Scene(
        camera=Camera(eye=(0, 0, 1), look_at=(0, 0, 0), up=(0, 1, 0), width=3, height=2, fov_y=0.01),
        lighting=Lighting(ambient=tuple(AMBIENT.tolist()), shadows=shadows),
        lights=(light,),
        objects=(Object(shape="plane", scale=9.0, material=Material(albedo=tuple(ALBEDO.tolist()))), *objects),
    )


@pytest.mark.parametrize(
    "light, hidden_by, scattered",
    [
        (SUN, Object(shape="box", scale=0.2, translate=(0.0, -2.4, 3.2)), 0.8 * np.array([1.0, 2.0, 3.0])),
        (LAMP, Object(shape="box", scale=0.2, translate=(0.0, 0.0, 1.5)), np.array([2.0, 1.0, 0.5])),
    ],
)
def test_light_is_that_of_closed_forms(light: Light, hidden_by: Object, scattered: np.ndarray) -> None:
    """``albedo * (ambient + cosine * radiance)``, of a lamp by the squared distance; in a shadow ambient light alone,
    where the scene has shadows."""
    lit, dark = ALBEDO * (AMBIENT + scattered), ALBEDO * AMBIENT
    for objects, shadows, expected in (
        ((), False, lit),
        ((), True, lit),
        ((hidden_by,), False, lit),
        ((hidden_by,), True, dark),
        ((LID,), True, lit),
    ):
        picture = LitFrames(of_a_plane(light, *objects, shadows=shadows), 1).picture
        np.testing.assert_allclose(picture, np.broadcast_to(expected, picture.shape), rtol=1e-4)


def test_mirrors_beyond_the_limit_show_the_environment() -> None:
    """Between parallel mirrors that scatter ambient light, the sum of the bounces, and then the environment alone."""
    pale = Material(albedo=(0.2, 0.2, 0.2), mirror=(0.5, 0.5, 0.5))
    scene = Scene(
        camera=Camera(eye=(0, 0, 0), look_at=(0.1, 0, -1), width=4, height=4, fov_y=10),
        environment=Environment(sky=(0.8, 0.8, 0.8), ground=(0.8, 0.8, 0.8)),
        lighting=Lighting(ambient=(1.0, 1.0, 1.0)),
        objects=tuple(Object(shape="plane", scale=50.0, translate=(0, 0, z), material=pale) for z in (-1, 1)),
    )
    assert scene.reflection.max_bounces == 4
    expected = 0.2 * (1 + 0.5 + 0.25 + 0.125 + 0.0625) + 0.5**5 * 0.8
    np.testing.assert_allclose(LitFrames(scene, 1).picture, expected, rtol=1e-5)


def of_two_lights(shadows: bool) -> Scene:
    """A mirror ball and a mirror wall with textured, stretched and facetted things between, under a sun and a lamp."""
    mirror = Material(mirror=(0.9, 0.7, 0.5), albedo=(0.1, 0.1, 0.1))
    return Scene(
        camera=Camera(eye=(0.3, -6.0, 2.0), look_at=(0.2, 0, 0), up=(0.1, 0, 1), width=192, height=128, fov_y=38),
        environment=Environment(sky=(0.2, 0.5, 1.0), ground=(0.6, 0.2, 0.1)),
        lighting=Lighting(shadows=shadows),
        lights=(
            Light(kind="directional", direction=(0.3, 0.4, -1.0), radiance=(0.5, 0.5, 0.4)),
            Light(kind="point", position=(-1.0, -3.0, 3.0), intensity=(4.0, 3.0, 4.0)),
        ),
        objects=(
            Object(shape="sphere", translate=(-1, 0, 0), material=mirror),
            Object(shape="plane", scale=3.0, rotate=(1, 0, 0, 90), translate=(0, 2.5, 0), material=mirror),
            Object(shape="plane", scale=4.0, translate=(0, 0, -1.1), material=Material(texture=BRICKS)),
            Object(shape="sphere", scale=(0.5, 0.3, 0.6), translate=(1.2, -1, 0)),
            Object(shape="sphere", params={"segments": [12, 6]}, smooth=False, scale=0.5, translate=(0.3, -2, -0.4)),
        ),
    )


@pytest.mark.parametrize("shadows", [False, True])
def test_lit_frames_are_ours_but_for_edges(shadows: bool) -> None:
    scene = of_two_lights(shadows)
    ours, theirs = ldtrefl.render(scene, "bvh").image, LitFrames(scene, 2).picture
    assert_alike(theirs, ours)


@pytest.mark.parametrize("kind", [PathFrames, ScalarPathFrames])
def test_frames_by_path_are_ours_without_lights(kind: type[MitsubaFrames]) -> None:
    """In a scene whose planes show their front alone, where alone Mitsuba's emitters shine."""
    scene = frame_scene("teapot", (192, 128))
    assert_alike(kind(scene, 2).picture, ldtrefl.render(emission_only(scene), "bvh").image)


def assert_alike(theirs: np.ndarray, ours: np.ndarray) -> None:
    """Nearly all pixels are alike, and nearly all others are like one beside them: an edge lies a pixel aside."""
    off = is_off(theirs, ours)
    anywhere = np.all([is_off(theirs, moved) for moved in around(ours)], axis=0)
    assert off.mean() < 0.005 and anywhere.mean() < 0.001, f"{off.sum()} off, {anywhere.sum()} of them unlike all"


@pytest.mark.parametrize("kind", [LitFrames, ScalarPathFrames])
def test_a_frame_is_seen_by_the_camera_that_has_moved(
    kind: type[MitsubaFrames], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(frame_scenes, "STEP", 0.3)
    scene = frame_scene("teapot", (96, 64))
    frames = kind(scene, 1)
    frames.frame()
    moved = scene.with_camera(next(moving(scene.camera)))
    ours = ldtrefl.render(moved if kind is LitFrames else emission_only(moved), "bvh").image
    assert not np.allclose(ours, ldtrefl.render(scene, "bvh").image, atol=0.1)
    assert_alike(frames.picture, ours)


def test_what_mitsuba_is_not_given_is_refused() -> None:
    glowing = Object(shape="sphere", material=Material(emission=(1.0, 0.0, 0.0)))
    with pytest.raises(ldtrefl.InputError, match="emission"):
        LitFrames(Scene(camera=Camera(eye=(0, -5, 0), look_at=(0, 0, 0)), objects=(glowing,)), 1)
