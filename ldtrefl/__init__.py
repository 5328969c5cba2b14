"""ldtrefl: specular reflections on curved objects by layered depth textures, beside the ray-traced truth.

The rooms, from the ground up; a room imports only those above it in this list. ``docs/architecture.md`` follows one
reflected ray through them.

    base/       errors in one line, the memory budget, checked values, standard error
    files/      pictures, files written whole, the cache of maps on disk
    device/     kernels: compiled, launched, shared out over CPU threads; C++ for their bodies
    geometry/   vectors, triangles, spheres, boxes, rasterisers
    scene/      what a scene file says: camera, lights, materials, objects; meshes, their files, shapes
    world/      the scene on the device: meshes, placed objects, lights, the camera as kernels read them
    tracing/    rays, hits, what a tracer is; the ray caster (a BVH), which is the truth
    shading/    the radiance of a surface, the same functions for every method
    ldt/        layered depth textures: peeling, and the searches for a ray in them
    frame/      what a frame is made of: G-buffer, bounces, reflection regions, what the next frame can use again
    methods/    one reflection method a file
    renderer.py the contents page: G-buffer -> method -> image
    compare/    how far an image is from the truth
    cli/        the command line, one file a command
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ldtrefl.base.budget import set_memory_limit
    from ldtrefl.base.errors import InputError
    from ldtrefl.device.launch import set_threads
    from ldtrefl.device.progress import progress_to
    from ldtrefl.device.stats import Stats
    from ldtrefl.files.layer_writing import save_layers
    from ldtrefl.files.map_cache import MapCache, keep_maps_in
    from ldtrefl.files.picture_reading import load_image
    from ldtrefl.files.picture_writing import save_image
    from ldtrefl.ldt.peel import peel
    from ldtrefl.ldt.texture import LayeredDepthTexture
    from ldtrefl.methods.virtual.reflection_point import Plane, ReflectionPoints, Sphere, reflection_point
    from ldtrefl.renderer import Frame, Renderer, render
    from ldtrefl.scene.description import (
        Camera,
        Environment,
        Light,
        Lighting,
        Material,
        Object,
        Reflection,
        Scene,
    )
    from ldtrefl.scene.lights import Occlusion
    from ldtrefl.scene.load import load_scene
    from ldtrefl.scene.mesh import Mesh
    from ldtrefl.scene.picture import Picture
    from ldtrefl.scene.readers.mesh_files import load_mesh
    from ldtrefl.tracing.batch import Hits
    from ldtrefl.tracing.bvh import Raycaster

__all__ = [
    "Camera",
    "Environment",
    "Frame",
    "Hits",
    "InputError",
    "LayeredDepthTexture",
    "Light",
    "Lighting",
    "MapCache",
    "Material",
    "Mesh",
    "Object",
    "Occlusion",
    "Picture",
    "Plane",
    "Raycaster",
    "Reflection",
    "ReflectionPoints",
    "Renderer",
    "Scene",
    "Sphere",
    "Stats",
    "keep_maps_in",
    "load_image",
    "load_mesh",
    "load_scene",
    "peel",
    "progress_to",
    "reflection_point",
    "render",
    "save_image",
    "save_layers",
    "set_memory_limit",
    "set_threads",
]

_HOMES = {
    "Camera": "scene.description",
    "Environment": "scene.description",
    "Frame": "renderer",
    "Hits": "tracing.batch",
    "InputError": "base.errors",
    "LayeredDepthTexture": "ldt.texture",
    "Light": "scene.description",
    "Lighting": "scene.description",
    "MapCache": "files.map_cache",
    "Material": "scene.description",
    "Mesh": "scene.mesh",
    "Object": "scene.description",
    "Occlusion": "scene.lights",
    "Picture": "scene.picture",
    "Plane": "methods.virtual.reflection_point",
    "Raycaster": "tracing.bvh",
    "Reflection": "scene.description",
    "ReflectionPoints": "methods.virtual.reflection_point",
    "Renderer": "renderer",
    "Scene": "scene.description",
    "Sphere": "methods.virtual.reflection_point",
    "Stats": "device.stats",
    "keep_maps_in": "files.map_cache",
    "load_image": "files.picture_reading",
    "load_mesh": "scene.readers.mesh_files",
    "load_scene": "scene.load",
    "peel": "ldt.peel",
    "progress_to": "device.progress",
    "reflection_point": "methods.virtual.reflection_point",
    "render": "renderer",
    "save_image": "files.picture_writing",
    "save_layers": "files.layer_writing",
    "set_memory_limit": "base.budget",
    "set_threads": "device.launch",
}
"""Public name -> its module. A module is imported when a name of it is first used: importing all takes a second and a
half, in which the command line must be able to stop."""


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'ldtrefl' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"ldtrefl.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
