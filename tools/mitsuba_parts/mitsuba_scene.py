"""An emission-only scene in Mitsuba 3: the same triangles and vertex normals, Mitsuba's own mirrors and environment.

Vertices and normals are those of our meshes, moved into the world in float64. All else is Mitsuba's: it builds its
tree, interpolates normals, filters textures, decodes sRGB and looks up the environment, a picture of it that is fine
enough for the blend from ground to sky. Only the emitter is made here: Mitsuba's ``area`` shines to one side.
"""

from __future__ import annotations

import functools
import importlib
from types import ModuleType
from typing import Any

import numpy as np

from ldtrefl.base.errors import InputError
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.description import Camera, Environment, Object, Scene
from ldtrefl.world.camera import unit_up

VARIANT = "llvm_ad_rgb"
SCALAR_VARIANT = "scalar_rgb"
TWO_SIDED = "two_sided_area"
"""The emitter that is made here."""
ENVIRONMENT_ROWS = 1025
"""Of the environment's picture: linear interpolation of the cosine between them is wrong by 1e-6."""
ENVIRONMENT_COLUMNS = 8
NEAR_CLIP = 1e-6
"""Of the camera's depth range, which nothing is to be cut off by; of the distance from ``eye`` to ``look_at``."""


def mitsuba(variant: str = VARIANT) -> ModuleType:
    """Mitsuba, its names those of a variant; the usual one is ready to trace many rays at once.

    Raises:
        InputError: it cannot be used here.
    """
    mi = _loaded(variant)
    mi.set_variant(variant)
    return mi


@functools.cache
def _loaded(variant: str) -> ModuleType:
    try:
        mi = importlib.import_module("mitsuba")
        mi.set_variant(variant)
        dr = importlib.import_module("drjit")
        dr.eval(mi.Float(0.0) + 1.0)
        mi.register_emitter(TWO_SIDED, _two_sided_area(mi, dr))
    except Exception as error:
        fault = f"{type(error).__name__}: {error}"
        raise InputError(
            f"Mitsuba cannot be used here ({fault}); pip install -e .[peers] brings it, and it needs an LLVM "
            "library of version 16 or newer, which DRJIT_LIBLLVM_PATH names"
        ) from None
    return mi


def _two_sided_area(mi: Any, dr: Any) -> Any:
    """A maker of emitters that radiate a texture to both sides, and are found by rays that hit them alone."""

    class TwoSidedArea(mi.Emitter):  # type: ignore[misc]
        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self._radiance = properties.get_emissive_texture("radiance")
            self.m_flags = mi.EmitterFlags.Surface

        def eval(self, interaction: Any, active: Any = True) -> Any:
            return self._radiance.eval(interaction, active)

        def sample_direction(self, interaction: Any, sample: Any, active: Any = True) -> Any:
            return dr.zeros(mi.DirectionSample3f), mi.Spectrum(0.0)

        def pdf_direction(self, interaction: Any, sample: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

    return TwoSidedArea


def mitsuba_scene(scene: Scene, variant: str = VARIANT, emitter: str = TWO_SIDED) -> Any:
    """Mitsuba's scene: a mesh for each part of each object, which ``emitter`` lets shine."""
    mi = mitsuba(variant)
    meshes = [mesh for entry in scene.objects for mesh in _meshes_of(mi, entry, emitter)]
    named = {f"mesh_{i}": mesh for i, mesh in enumerate(meshes)}
    camera, environment = _camera(mi, scene.camera), _environment(mi, scene.environment, unit_up(scene.camera))
    # Mitsuba would join meshes into one, which has then a single number.
    return mi.load_dict({"type": "scene", "camera": camera, "environment": environment, **named}, optimize=False)


def _camera(mi: Any, camera: Camera) -> dict[str, object]:
    """A camera whose only sample of a pixel lies in its middle."""
    distance = float(np.linalg.norm(np.subtract(camera.look_at, camera.eye)))
    return {
        "type": "perspective",
        "fov": camera.fov_y,
        "fov_axis": "y",
        "near_clip": NEAR_CLIP * distance,
        "far_clip": distance / NEAR_CLIP,
        "to_world": camera_place(mi, camera),
        "sampler": {"type": "stratified", "sample_count": 1, "jitter": False},
        "film": {
            "type": "hdrfilm",
            "width": camera.width,
            "height": camera.height,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        },
    }


def camera_place(mi: ModuleType, camera: Camera) -> Any:
    """Where a camera stands and looks, as Mitsuba has it."""
    return mi.ScalarTransform4f().look_at(origin=list(camera.eye), target=list(camera.look_at), up=list(camera.up))


def _environment(mi: Any, environment: Environment, up: np.ndarray) -> dict[str, object]:
    """The blend from ground to sky as a picture; its first row is straight up, its last straight down."""
    height = np.cos(np.linspace(0.0, np.pi, ENVIRONMENT_ROWS))[:, None]
    rows = 0.5 * (1.0 + height) * environment.sky + 0.5 * (1.0 - height) * environment.ground
    picture = np.repeat(rows[:, None].astype(np.float32), ENVIRONMENT_COLUMNS, axis=1)
    # Mitsuba's pictures have +y at the top.
    across = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    across /= np.linalg.norm(across)
    to_world = np.eye(4)
    to_world[:3, :3] = np.stack([across, up, np.cross(across, up)], axis=1)
    return {"type": "envmap", "bitmap": mi.Bitmap(picture), "to_world": mi.ScalarTransform4f(to_world)}


def _meshes_of(mi: Any, entry: Object, emitter: str) -> list[Any]:
    """An object's parts."""
    mesh, material = entry.geometry, entry.material
    place = entry.world_from_object()
    vertices = mesh.vertices @ place[:3, :3].T + place[:3, 3]
    # Mitsuba normalises what it has interpolated, as ours does: lengths are kept.
    normals = mesh.normals @ np.linalg.inv(place[:3, :3]) if entry.smooth else None
    made = []
    firsts = [part.first_triangle for part in mesh.parts]
    for part, first, end in zip(mesh.parts, firsts, [*firsts[1:], len(mesh.faces)], strict=True):
        properties = mi.Properties()
        properties["bsdf"] = mi.load_dict(_bsdf(entry))
        texture = part.material.base_texture
        picture = texture.picture if entry.texture is None and texture is not None else entry.texture
        color = np.multiply(material.albedo, part.material.base_color)
        properties["emitter"] = mi.load_dict(
            {"type": emitter, "radiance": _radiance(mi, color, np.asarray(material.emission), picture)}
        )
        made.append(_mesh(mi, vertices, mesh.faces[first:end], normals, mesh.uvs, properties))
    return made


def _bsdf(entry: Object) -> dict[str, object]:
    """A mirror. What mirrors nothing is a black one: at a diffuse surface Mitsuba would look for lights."""
    mirror = {"type": "rgb", "value": list(entry.material.mirror)}
    return {"type": "twosided", "bsdf": {"type": "conductor", "material": "none", "specular_reflectance": mirror}}


def _radiance(mi: Any, color: np.ndarray, emission: np.ndarray, picture: StoredPicture | None) -> dict[str, object]:
    """``emission + color * picture``, a texture where there is a picture."""
    if picture is None:
        return {"type": "rgb", "value": (emission + color).tolist()}
    values = (emission + color * _linear(mi, picture)).astype(np.float32)
    texture = {"type": "bitmap", "data": mi.TensorXf(values), "raw": True}
    return {**texture, "filter_type": "bilinear", "wrap_mode": "repeat"}


def _linear(mi: Any, picture: StoredPicture) -> np.ndarray:
    """(h, w, 3) float32 linear pixels, decoded by Mitsuba."""
    if picture.pixels.dtype != np.uint8:
        return picture.pixels
    encoded = mi.Bitmap(np.array(picture.pixels))
    return np.array(encoded.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False))


def _mesh(
    mi: Any,
    vertices: np.ndarray,
    faces: np.ndarray,
    normals: np.ndarray | None,
    uvs: np.ndarray | None,
    properties: Any,
) -> Any:
    mesh = mi.Mesh(
        "",
        len(vertices),
        len(faces),
        has_vertex_normals=normals is not None,
        has_vertex_texcoords=uvs is not None,
        props=properties,
    )
    arrays = mi.traverse(mesh)
    given = {"vertex_positions": vertices, "vertex_normals": normals, "faces": faces.astype(np.uint32)}
    if uvs is not None:
        given["vertex_texcoords"] = uvs * [1.0, -1.0] + [0.0, 1.0]  # Mitsuba's first row is at v = 0
    for name, values in given.items():
        if values is not None:
            kind = np.uint32 if name == "faces" else np.float32
            arrays[name] = type(arrays[name])(np.ascontiguousarray(values, kind).ravel())
    arrays.update()
    return mesh
