"""Scenes whose surfaces radiate and mirror, and do nothing else, so that two renderers must give the same picture."""

from __future__ import annotations

import dataclasses

from ldtrefl.scene.description import Environment, Lighting, Object, Scene


def emission_only(scene: Scene) -> Scene:
    """The scene with every surface radiating its emission and its albedo times texture, to all sides.

    Ambient light of 1 without any other light is just that. Mirrors keep their reflectance, but for Fresnel's law, as
    Mitsuba has no Schlick approximation. The environment is the blend from ground to sky, and no picture.
    """
    environment = Environment(sky=scene.environment.sky, ground=scene.environment.ground)
    lighting = Lighting(ambient=(1.0, 1.0, 1.0), shadows=False)
    objects = tuple(_without_fresnel(entry) for entry in scene.objects)
    return dataclasses.replace(scene, environment=environment, lighting=lighting, lights=(), objects=objects)


def _without_fresnel(entry: Object) -> Object:
    if not entry.material.fresnel:
        return entry
    plain = dataclasses.replace(entry, material=dataclasses.replace(entry.material, fresnel=False))
    plain.share_geometry(entry.geometry)
    return plain
