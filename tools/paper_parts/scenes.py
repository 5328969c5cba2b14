"""The scenes of the papers' figures, and those that are made of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
from benchmark_parts.common import ROOT

import ldtrefl
from ldtrefl.scene.description import Camera, Light, Lighting, Material, Object, Scene

MIRROR = Material(albedo=(0.02, 0.02, 0.02), mirror=(0.9, 0.9, 0.9))

QUICK_SHARE = 4
"""By which the sides of pictures are divided in a quick run."""

EYES = ((-0.35, -0.2), (-0.15, -0.3), (0.15, -0.3), (0.35, -0.2))
"""Where four pairs of eyes are, on the worktop of the kitchen."""


def paper_scene(name: str, quick: bool) -> Scene:
    """A scene of ``scenes/``, small if ``quick``."""
    scene = ldtrefl.load_scene(ROOT / "scenes" / f"{name}.toml")
    if not quick:
        return scene
    camera = scene.camera
    width, height = camera.width // QUICK_SHARE, camera.height // QUICK_SHARE
    return scene.with_camera(dataclasses.replace(camera, width=width, height=height))


def eight_eyes(quick: bool) -> Scene:
    """The kitchen with eight small mirror balls in place of its bowl, as ants' eyes in pairs."""
    scene = paper_scene("paper/kitchen", quick)
    ball = Object(shape="sphere", params={"segments": [48, 24]}, scale=0.07, material=MIRROR)
    places = [(x + side, y, 0.2) for x, y in EYES for side in (-0.08, 0.08)]
    eyes = [ball.changed(name=f"eye {i}", translate=place) for i, place in enumerate(places)]
    return dataclasses.replace(scene, objects=(*eyes, *scene.objects[1:]))


def room_of(triangles: int, quick: bool) -> Scene:
    """A mirror ball in the middle of a room of about so many triangles, which surrounds it."""
    segments = max(1, round(np.sqrt(triangles / 12)))
    size = (192, 128) if quick else (768, 512)
    camera = Camera(eye=(0.0, -2.6, 0.4), look_at=(0.0, 0.0, 0.0), fov_y=50.0, width=size[0], height=size[1])
    room = Object(name="room", shape="room", params={"segments": segments}, scale=3.0)
    ball = Object(name="ball", shape="sphere", material=MIRROR)
    light = Light(kind="point", position=(1.0, -2.0, 2.5), intensity=(4.0, 4.0, 4.0))
    return Scene(camera=camera, objects=(ball, room), lights=(light,), lighting=Lighting(ambient=(0.4, 0.4, 0.4)))


def approach(camera: Camera, shares: tuple[float, float], frames: int) -> Iterator[Camera]:
    """Cameras that come nearer to what this one looks at, from and to these times its distance."""
    eye, target = np.array(camera.eye), np.array(camera.look_at)
    for factor in np.linspace(*shares, frames):
        yield dataclasses.replace(camera, eye=tuple((target + factor * (eye - target)).tolist()))
