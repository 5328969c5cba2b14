"""ldtrefl: specular reflections on curved objects by layered depth textures, beside the ray-traced truth.

The pipeline, one module a stage:

    scene file -> Scene (scene, shapes, mesh, mesh_files, normals) -> arrays on the device (device_scene)
      -> G-buffer: what the camera sees (gbuffer, zbuffer, raster)
      -> a method (methods/): its tracer answers reflected rays (trace), whose life is written once (reflect)
           ldt: cull (cull), as fine as needed (resolution), peel on first need (ldt: peel -> fragments, patches, doubts
                -> grid; kept by cache, checked by grid_check), march (march: march_exact, march_linear)
           bvh: the ground truth (raycast)
      -> what stays from frame to frame (kept); what may be left out (skips)
      -> shade, the same functions for all (shade) -> composite (render) -> image (image), compared (metrics)
"""

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
