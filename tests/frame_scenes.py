"""A scene that tests of frames share, and what a frame of it must be equal to."""

import dataclasses

import numpy as np

import ldtrefl
from ldtrefl.renderer import Frame
from ldtrefl.scene.description import Camera, Material, Object, Scene

MIRROR = Material(mirror=(0.9, 0.9, 0.9))


def scene(**changes: object) -> Scene:
    """A mirror ball between a knot, a torus and a box, on a large plate that device space is made for."""
    given = Scene(
        camera=Camera(eye=(0, -5, 1.5), look_at=(0, 0, 0), width=160, height=112, fov_y=40),
        objects=(
            Object(name="ball", shape="sphere", material=MIRROR),
            Object(name="plate", shape="plane", scale=4.0, translate=(0, 0, -1.1)),
            Object(name="knot", shape="torus_knot", params={"segments": [300, 40]}, scale=0.5, translate=(1.5, -1, 0)),
            Object(name="torus", shape="torus", scale=0.4, translate=(-1.4, -1.2, 0.2)),
            Object(name="box", shape="box", scale=0.2, translate=(0, -1.6, -0.6)),
        ),
    )
    return dataclasses.replace(given, **changes)


def assert_as_fresh(renderer: ldtrefl.Renderer, frame: Frame, method: str = "ldt", **options: object) -> None:
    """A frame is, to the bit, what a new renderer makes of the same scene."""
    fresh = ldtrefl.render(renderer.scene, method, **options)
    np.testing.assert_array_equal(frame.image, fresh.image)
    np.testing.assert_array_equal(frame.reflection, fresh.reflection)
    assert frame.hits is not None and fresh.hits is not None
    for mine, right in zip((frame.hits, *frame.hits.later), (fresh.hits, *fresh.hits.later), strict=True):
        for name in ("distance", "object", "triangle", "followed"):
            np.testing.assert_array_equal(getattr(mine, name), getattr(right, name))
