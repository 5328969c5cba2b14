"""The scenes whose whole frames are timed, by name.

They are made of what every checkout of the package knows: ``checkout_frames.py`` has others make frames of them, too.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import ldtrefl
from ldtrefl.scene.description import Camera, Light, Lighting, Material, Object, Reflection, Scene

TEAPOT = Path(__file__).parent.parent.parent / "scenes" / "teapot.toml"

MIRROR = Material(mirror=(0.9, 0.9, 0.9), albedo=(0.02, 0.02, 0.02))
LIGHTS = (Light(kind="directional", direction=(0.3, 0.4, -1.0), radiance=(1.0, 1.0, 1.0)),)
ROOM_BOUNCES = 5
MANY = 49
"""Rings beside a ball."""

STEP = 2e-4
"""By which the camera moves from frame to frame, of the distance between ``eye`` and ``look_at``."""


def _ball_and_knot(segments: tuple[int, int], *, shadows: bool = False, mirror: bool = True) -> Scene:
    """A ball beside a torus knot of twice the product of ``segments`` triangles."""
    knot = Object(
        name="knot",
        shape="torus_knot",
        params={"segments": list(segments)},
        scale=0.7,
        translate=(1.4, -0.9, 0.1),
    )
    ball = Object(name="ball", shape="sphere", material=MIRROR if mirror else Material())
    return Scene(camera=_camera(), lighting=Lighting(shadows=shadows), lights=LIGHTS, objects=(ball, knot))


def _camera() -> Camera:
    return Camera(eye=(0.0, -5.0, 1.5), look_at=(0.0, 0.0, 0.0), width=768, height=512, fov_y=40.0)


def _fifty_objects() -> Scene:
    """A mirror ball among rings of one mesh."""
    generator = np.random.default_rng(0)
    places = generator.uniform(-2.0, 2.0, (MANY, 3)) * (1.0, 0.5, 1.0) + (0.0, -1.5, 0.0)
    rings = [
        Object(shape="torus", params={"segments": [60, 30]}, scale=0.2, translate=tuple(place.tolist()))
        for place in places
    ]
    return Scene(camera=_camera(), lights=LIGHTS, objects=(Object(shape="sphere", material=MIRROR), *rings))


def _room() -> Scene:
    """Three mirror walls, three mirror balls and three mirror rings about a knot and a box."""
    wall, floor = Material(mirror=(0.8, 0.8, 0.8), albedo=(0.05, 0.05, 0.05)), Material(albedo=(0.7, 0.6, 0.5))
    turned = ((1, 0, 0, 90), (0, 1, 0, 90), (0, 1, 0, -90))
    objects = [Object(shape="plane", scale=3.0, translate=(0, 0, -1), material=floor)]
    for rotate, translate in zip(turned, ((0, 3, 0), (-3, 0, 0), (3, 0, 0)), strict=True):
        objects.append(Object(shape="plane", scale=3.0, rotate=rotate, translate=translate, material=wall))
    for i in range(6):
        place = (-2.0 + 0.8 * i, -0.5 + i % 3, -0.4)
        objects.append(Object(shape=("sphere", "torus")[i % 2], scale=0.5, translate=place, material=MIRROR))
    knot = Object(shape="torus_knot", params={"segments": [1200, 40]}, scale=0.5, translate=(0.3, -1.2, -0.3))
    box = Object(shape="box", scale=0.3, translate=(-1.3, -1.5, -0.6), material=Material(albedo=(0.2, 0.4, 0.8)))
    return Scene(
        camera=Camera(eye=(0.3, -4.5, 1.2), look_at=(0.0, 0.0, -0.2), width=768, height=512, fov_y=50.0),
        lights=LIGHTS,
        objects=(*objects, knot, box),
        reflection=Reflection(max_bounces=ROOM_BOUNCES),
    )


LARGEST = "ball, knot 10 M"
"""Seconds to make and gigabytes to hold: it is timed only if it is asked for."""

FRAME_SCENES: dict[str, Callable[[], Scene]] = {
    "ball, knot 96 k": lambda: _ball_and_knot((1200, 40)),
    "ball, knot 500 k": lambda: _ball_and_knot((5000, 50)),
    "ball, knot 500 k, shadows": lambda: _ball_and_knot((5000, 50), shadows=True),
    "ball, knot 2 M": lambda: _ball_and_knot((8192, 122)),
    LARGEST: lambda: _ball_and_knot((8192, 610)),
    "teapot": lambda: ldtrefl.load_scene(TEAPOT),
    "50 objects": _fifty_objects,
    "room, 9 mirrors": _room,
    "no mirror, knot 96 k": lambda: _ball_and_knot((1200, 40), mirror=False),
}


def frame_scene(name: str, size: tuple[int, int] | None = None) -> Scene:
    """A scene of this name, its picture of another ``size``, pixels across and down, if one is given."""
    scene = FRAME_SCENES[name]()
    if size is None:
        return scene
    return scene.with_camera(dataclasses.replace(scene.camera, width=size[0], height=size[1]))


def moving(camera: Camera) -> Iterator[Camera]:
    """A camera that moves a little before every frame, without end."""
    eye = np.asarray(camera.eye)
    step = STEP * float(np.linalg.norm(eye - camera.look_at))
    frame = 0
    while True:
        frame += 1
        yield dataclasses.replace(camera, eye=(float(eye[0]) + step * frame, float(eye[1]), float(eye[2])))
