"""Scenes whose surfaces radiate and mirror, and do nothing else, so that two renderers must give the same picture."""

from __future__ import annotations

import dataclasses

from ldtrefl.scene.description import Environment, Lighting, Object, Scene
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.surface_material import SurfaceMaterial, Texture


def emission_only(scene: Scene) -> Scene:
    """The scene with every surface radiating its emission and its albedo times texture, to all sides.

    Ambient light of 1 without any other light is just that. Mirrors keep their reflectance, but for Fresnel's law, as
    Mitsuba has no Schlick approximation. Of files' materials colours and pictures stay. The environment is the blend
    from ground to sky, and no picture.
    """
    environment = Environment(sky=scene.environment.sky, ground=scene.environment.ground)
    lighting = Lighting(ambient=(1.0, 1.0, 1.0), shadows=False)
    objects = tuple(_matt(entry) for entry in scene.objects)
    return dataclasses.replace(scene, environment=environment, lighting=lighting, lights=(), objects=objects)


def _matt(entry: Object) -> Object:
    """The object without Fresnel's law, and with no more of its file's materials than colours and pictures."""
    # The albedo is given, so that it counts as it does in the other renderer.
    red, green, blue = entry.material.albedo
    material = dataclasses.replace(entry.material, fresnel=False, albedo=(red, green, blue))
    mesh = entry.geometry
    if mesh.colors is None and all(part.material.key == _colored(part).key for part in mesh.parts):
        plain = dataclasses.replace(entry, material=material)
        plain.share_geometry(mesh)
        return plain
    parts = tuple(Part(part.first_triangle, _colored(part)) for part in mesh.parts)
    matt = Mesh(mesh.vertices, mesh.faces, mesh.stored_normals, mesh.uvs, parts)
    return dataclasses.replace(entry, mesh=matt, shape=None, params={}, material=material)


def _colored(part: Part) -> SurfaceMaterial:
    """A matt material of a part's colour and picture."""
    texture = part.material.base_texture
    picture = None if texture is None else Texture(texture.picture)
    return SurfaceMaterial(base_color=part.material.base_color, base_texture=picture)
