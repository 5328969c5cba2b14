"""ldtrefl: specular reflections on curved objects by layered depth textures, beside the ray-traced truth.

The pipeline, one module a stage:

    scene file -> Scene (toml_text, checked, scene, shapes, mesh_files, mesh, normals; budget)
      -> arrays on the device (device_scene)
      -> G-buffer: what the camera sees (gbuffer, zbuffer, raster)
      -> a method (methods/): its tracer answers reflected rays (trace), whose life is written once (reflect)
           ldt: cull (cull), as fine as needed (resolution), peel on first need (ldt: peel -> fragments -> occupancy;
                items: patches, doubts -> tree_build -> tree; kept by cache, checked by tree_check), search (march:
                tree_walk, march_linear)
           bvh: the ground truth (raycast)
      -> what stays from frame to frame (kept); what may be left out (skips)
      -> shade, the same functions for all (shade) -> composite (render) -> image (image), compared (metrics)
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ldtrefl.errors import InputError
    from ldtrefl.image import load_image, save_image
    from ldtrefl.launch import Stats, set_threads
    from ldtrefl.ldt import LayeredDepthTexture, peel
    from ldtrefl.mesh import Mesh
    from ldtrefl.mesh_files import load_mesh
    from ldtrefl.raycast import Raycaster
    from ldtrefl.render import Frame, Renderer, render
    from ldtrefl.scene import (
        Camera,
        Environment,
        Light,
        Lighting,
        Material,
        Object,
        Reflection,
        Scene,
        load_scene,
    )
    from ldtrefl.trace import Hits

__all__ = [
    "Camera",
    "Environment",
    "Frame",
    "Hits",
    "InputError",
    "LayeredDepthTexture",
    "Light",
    "Lighting",
    "Material",
    "Mesh",
    "Object",
    "Raycaster",
    "Reflection",
    "Renderer",
    "Scene",
    "Stats",
    "load_image",
    "load_mesh",
    "load_scene",
    "peel",
    "render",
    "save_image",
    "set_threads",
]

_HOMES = {
    "Camera": "scene",
    "Environment": "scene",
    "Frame": "render",
    "Hits": "trace",
    "InputError": "errors",
    "LayeredDepthTexture": "ldt",
    "Light": "scene",
    "Lighting": "scene",
    "Material": "scene",
    "Mesh": "mesh",
    "Object": "scene",
    "Raycaster": "raycast",
    "Reflection": "scene",
    "Renderer": "render",
    "Scene": "scene",
    "Stats": "launch",
    "load_image": "image",
    "load_mesh": "mesh_files",
    "load_scene": "scene",
    "peel": "ldt",
    "render": "render",
    "save_image": "image",
    "set_threads": "launch",
}
"""Public name -> its module. A module is imported when a name of it is first used: importing all takes a second and a
half, in which the command line must be able to stop."""


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        value = getattr(importlib.import_module(f"ldtrefl.{_HOMES[name]}"), name)
    else:
        try:
            value = importlib.import_module(f"ldtrefl.{name}")
        except ModuleNotFoundError as error:
            if error.name != f"ldtrefl.{name}":
                raise
            raise AttributeError(f"module 'ldtrefl' has no attribute '{name}'") from None
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


class _Package(ModuleType):
    """The package: importing the module ``ldtrefl.render`` must not put it in the place of the function."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in _HOMES or not isinstance(value, ModuleType):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
