"""A scene in Mitsuba 3: the same triangles and vertex normals, Mitsuba's own surfaces, lights and environment.

Vertices and normals are those of our meshes, moved into the world in float64. All else is Mitsuba's: it builds its
tree, interpolates normals, filters textures, decodes sRGB and looks up the environment, a picture of it that is fine
enough for the blend from ground to sky. Emission-only scenes have no lights, and one emitter that is made here:
Mitsuba's ``area`` shines to one side.
"""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np

from ldtrefl.base.errors import InputError
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.description import Camera, Environment, Light, Object, Scene
from ldtrefl.scene.mesh import Part
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
    """Mitsuba's scene: a mesh for each part of each object, which ``emitter`` lets shine; without any lights."""
    mi = mitsuba(variant)
    return _loaded_scene(mi, scene, lambda entry, part: _shining(mi, entry, part, emitter), {})


def lit_mitsuba_scene(scene: Scene, surface: Callable[[Object, Part], object]) -> Any:
    """Mitsuba's scene with lights: a mesh for each part of each object, whose BSDF ``surface`` makes."""
    mi = mitsuba()

    def properties_of(entry: Object, part: Part) -> Any:
        properties = mi.Properties()
        properties["bsdf"] = surface(entry, part)
        return properties

    lights = {f"light_{i}": _light(light) for i, light in enumerate(scene.lights)}
    return _loaded_scene(mi, scene, properties_of, lights)


def _loaded_scene(
    mi: Any, scene: Scene, properties_of: Callable[[Object, Part], Any], lights: dict[str, dict[str, object]]
) -> Any:
    meshes = [mesh for entry in scene.objects for mesh in _meshes_of(mi, entry, properties_of)]
    named = {f"mesh_{i}": mesh for i, mesh in enumerate(meshes)} | lights
    camera, environment = _camera(mi, scene.camera), _environment(mi, scene.environment, unit_up(scene.camera))
    # Mitsuba would join meshes into one, which has then a single number.
    return mi.load_dict({"type": "scene", "camera": camera, "environment": environment, **named}, optimize=False)


def sampling_camera(camera: Camera, deviation: float) -> Any:
    """A camera that is sampled all over its pixels; its image is filtered by a Gaussian of this standard deviation in
    pixels, which Mitsuba ends at four of them."""
    mi = mitsuba()
    described = _camera(mi, camera)
    film = described["film"]
    assert isinstance(film, dict)
    film["rfilter"] = {"type": "gaussian", "stddev": deviation}
    return mi.load_dict(described | {"sampler": {"type": "multijitter"}})


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


def _light(light: Light) -> dict[str, object]:
    """A light. Ours says what leaves a white diffuse surface, which is the light that arrives over pi."""
    if light.position is not None and light.intensity is not None:
        intensity = {"type": "rgb", "value": np.multiply(np.pi, light.intensity).tolist()}
        return {"type": "point", "position": list(light.position), "intensity": intensity}
    assert light.direction is not None and light.radiance is not None
    irradiance = {"type": "rgb", "value": np.multiply(np.pi, light.radiance).tolist()}
    return {"type": "directional", "direction": list(light.direction), "irradiance": irradiance}


def _meshes_of(mi: Any, entry: Object, properties_of: Callable[[Object, Part], Any]) -> list[Any]:
    """An object's parts."""
    mesh = entry.geometry
    place = entry.world_from_object()
    vertices = mesh.vertices @ place[:3, :3].T + place[:3, 3]
    # Mitsuba normalises what it has interpolated, as ours does: lengths are kept.
    normals = mesh.normals @ np.linalg.inv(place[:3, :3]) if entry.smooth is not False else None
    firsts = [part.first_triangle for part in mesh.parts]
    return [
        _mesh(mi, vertices, mesh.faces[first:end], normals, mesh.uvs, properties_of(entry, part))
        for part, first, end in zip(mesh.parts, firsts, [*firsts[1:], len(mesh.faces)], strict=True)
    ]


def _shining(mi: Any, entry: Object, part: Part, emitter: str) -> Any:
    """What a part radiates and mirrors."""
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(_bsdf(entry))
    emission = np.asarray(entry.material.emission)
    properties["emitter"] = mi.load_dict({"type": emitter, "radiance": colored(mi, *base_of(entry, part), emission)})
    return properties


def base_of(entry: Object, part: Part) -> tuple[np.ndarray, StoredPicture | None]:
    """(3,) linear colour of a part, and the picture that it is times."""
    texture = part.material.base_texture
    picture = texture.picture if entry.texture is None and texture is not None else entry.texture
    return np.multiply(entry.material.albedo, part.material.base_color), picture


def _bsdf(entry: Object) -> dict[str, object]:
    """A mirror. What mirrors nothing is a black one: at a diffuse surface Mitsuba would look for lights."""
    mirror = {"type": "rgb", "value": list(entry.material.mirror)}
    return {"type": "twosided", "bsdf": {"type": "conductor", "material": "none", "specular_reflectance": mirror}}


def colored(mi: ModuleType, color: np.ndarray, picture: StoredPicture | None, added: np.ndarray) -> dict[str, object]:
    """``added + color * picture``, a texture where there is a picture."""
    if picture is None:
        return {"type": "rgb", "value": (added + color).tolist()}
    values = (added + color * _linear(mi, picture)).astype(np.float32)
    texture = {"type": "bitmap", "data": mi.TensorXf(values), "raw": True}
    return {**texture, "filter_type": "bilinear", "wrap_mode": "repeat"}


def _linear(mi: ModuleType, picture: StoredPicture) -> np.ndarray:
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
