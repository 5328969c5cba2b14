"""Objects of any size and in any place -> a scene to look at: composed, lit, seen in a three-quarter view."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ldtrefl.scene.description import Camera, Light, Lighting, Object, Scene
from ldtrefl.scene.framing import three_quarter_camera
from ldtrefl.scene.stages import CHROME, bare, find_stage, makes_a_mirror
from ldtrefl.scene.subject import Subject

BESIDE_OWN_LIGHTS = Lighting(ambient=(0.05, 0.05, 0.05), shadows=True)
"""What goes with lights that a file brings along."""


def composed(
    objects: tuple[Object, ...],
    on: str | None,
    *,
    lights: Sequence[Light] = (),
    camera: Camera | None = None,
    mirror_self: bool = False,
    size: tuple[int, int] | None = None,
) -> Scene:
    """A scene of objects that stand upright (z up, their front to -y).

    They stay where they are, and are the first objects of the scene; what is put around them comes after them.

    Args:
        objects: what the picture is of.
        on: the name of a stage (``stages.py``), which brings its own light and camera; None: the objects alone, by
            their own lights and camera where they have any.
        lights: their own.
        camera: their own.
        mirror_self: they are chrome.
        size: width and height of the picture.

    Raises:
        InputError: an unknown stage, or no objects.
    """
    make_stage = bare if on is None else find_stage(on)
    subject = Subject.of(objects)
    stage = make_stage(subject)
    if mirror_self or makes_a_mirror(on):
        objects = tuple(dataclasses.replace(entry, material=CHROME) for entry in objects)
    if on is not None or camera is None:
        points = [subject.points]
        points += [] if stage.points is None else [stage.points]
        points += [Subject.of(stage.framed).points] if stage.framed else []
        camera = three_quarter_camera(np.concatenate(points), stage.elevation, size, subject.digits)
    elif size is not None:
        camera = dataclasses.replace(camera, width=size[0], height=size[1])
    has_own = on is None and len(lights) > 0
    return Scene(
        camera=camera,
        environment=stage.environment,
        lighting=BESIDE_OWN_LIGHTS if has_own else stage.lighting,
        lights=tuple(lights) if has_own else stage.lights,
        objects=(*objects, *stage.objects),
    )
