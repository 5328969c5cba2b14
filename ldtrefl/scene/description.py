"""The scene: dataclasses that check themselves, and ``load_scene`` for TOML files.

Conventions: right-handed, any ``up``. Angles in degrees, radiance linear RGB; one number stands for a grey. Every
dataclass may be built in Python with the same names and checks as the file's keys; wrong values raise ``InputError``.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import logging
import os
import typing
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, TypeAdapter, ValidationError, WrapValidator, model_validator
from pydantic.dataclasses import dataclass

from ldtrefl.base import budget
from ldtrefl.base.checked import (
    CONFIG,
    LARGEST,
    SMALLEST,
    Color,
    Direction,
    Flag,
    Intensity,
    Number,
    Positive,
    Real,
    Reflectance,
    Scale,
    Text,
    Vector,
    Whole,
    plain,
    refusing_in_one_line,
)
from ldtrefl.base.errors import InputError, first_fault, printable, unknown_name
from ldtrefl.files.picture_reading import stored_picture
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene import shapes
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.readers.mesh_files import load_mesh
from ldtrefl.scene.toml_text import read_toml

MESH_PATH_VARIABLE = "LDTREFL_MESH_PATH"
MAX_SIDE = 16384
"""Pixels along a side of an image, and objects in a scene."""
MAX_LIGHTS = 64
NARROWEST = 1e-6
"""Least degrees that a camera sees: at 16,384 pixels a pixel's share is still far above float64's rounding."""
ROUNDING = 1e-6
"""By which albedo and mirror may add up to more than 1: 0.9 + 0.1 are written in decimals."""

CORNERS = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
"""(8, 3): of a box's corners, along each axis 0 for its low and 1 for its high side."""

_log = logging.getLogger("ldtrefl")


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Camera:
    """A pinhole camera; pixel centres at +0.5, row 0 at the top."""

    eye: Vector
    look_at: Vector
    up: Direction = (0.0, 0.0, 1.0)
    fov_y: Annotated[Real, Field(ge=NARROWEST, lt=180.0)] = 40.0
    """Degrees from the lower to the upper edge of the image."""
    width: Annotated[Whole, Field(ge=1, le=MAX_SIDE)] = 768
    height: Annotated[Whole, Field(ge=1, le=MAX_SIDE)] = 512

    @model_validator(mode="after")
    def _looks_somewhere(self) -> Camera:
        forward = np.subtract(self.look_at, self.eye)
        if np.abs(forward).max() < SMALLEST:
            raise ValueError(f"eye and look_at are the same point, or closer than {SMALLEST:g}")
        up = np.asarray(self.up) / np.linalg.norm(self.up)
        if np.linalg.norm(np.cross(forward / np.linalg.norm(forward), up)) < 1e-9:  # float64 can't tell a side
            raise ValueError("up is parallel to the line from eye to look_at")
        return self


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Environment:
    """What a ray that hits nothing sees: a blend by height, or an equirectangular image."""

    sky: Color = (0.55, 0.70, 0.95)
    ground: Color = (0.30, 0.28, 0.25)
    image: Text | None = None

    @functools.cached_property
    def picture(self) -> StoredPicture | None:
        """The picture that ``image`` names, read when it is first asked for; None without one."""
        return None if self.image is None else stored_picture(self.image)


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Lighting:
    """What all lights share."""

    ambient: Color = (0.15, 0.15, 0.15)
    """Added irradiance / pi."""
    shadows: Flag = False


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Light:
    """A directional or a point light."""

    kind: Literal["directional", "point"]
    direction: Direction | None = None
    """Directional: the way the light travels."""
    radiance: Color | None = None
    """Directional: radiance leaving a white diffuse surface that faces the light."""
    position: Vector | None = None
    intensity: Intensity | None = None
    """Point: ``intensity / distance^2`` in place of ``radiance``."""

    @model_validator(mode="after")
    def _whole(self) -> Light:
        own = {"directional": ("direction", "radiance"), "point": ("position", "intensity")}
        for kind, keys in own.items():
            for key in keys:
                if (getattr(self, key) is None) == (kind == self.kind):
                    fault = "needs" if kind == self.kind else "has no"
                    raise ValueError(f"a {self.kind} light {fault} '{key}' (it has {' and '.join(own[self.kind])})")
        return self


class _Unstated(tuple[float, float, float]):
    """A colour that nobody has stated. It stays so when a material is built from another by ``dataclasses.replace``."""


def _if_stated(value: Any, check: Any) -> Any:
    return value if isinstance(value, _Unstated) else check(value)


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Material:
    """``emission + albedo * texture * light + mirror * reflected radiance``."""

    albedo: Annotated[Color, WrapValidator(_if_stated)] = _Unstated((0.8, 0.8, 0.8))
    """0.8 if it is not given; 0 where ``mirror`` is, because a mirror that also scatters light gives back too much."""
    texture: Text | None = None
    """A picture, times albedo; needs UVs. Without one, the mesh file's own textures count."""
    emission: Color = (0.0, 0.0, 0.0)
    mirror: Reflectance = (0.0, 0.0, 0.0)
    """Specular reflectance; any channel above 0 makes the object a reflector."""
    fresnel: Flag = False
    """Schlick's approximation, with ``mirror`` as the reflectance at normal incidence."""

    @model_validator(mode="after")
    def _albedo_if_unstated(self) -> Material:
        if isinstance(self.albedo, _Unstated):
            object.__setattr__(self, "albedo", _Unstated((0.0 if any(self.mirror) else 0.8,) * 3))
        return self

    @functools.cached_property
    def picture(self) -> StoredPicture | None:
        """The picture that ``texture`` names, read when it is first asked for; None without one."""
        return None if self.texture is None else stored_picture(self.texture)

    @property
    def excess(self) -> tuple[float, str] | None:
        """The largest sum of albedo and mirror in a channel, and the channel, where it is above 1; else None."""
        channels = zip(self.albedo, self.mirror, ("red", "green", "blue"), strict=True)
        largest = max((albedo + mirror, name) for albedo, mirror, name in channels)
        return largest if largest[0] > 1.0 + ROUNDING else None


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Object:
    """A mesh or a shape, placed: fit, then scale, rotate, translate."""

    name: str = ""
    mesh: Text | Mesh | None = None
    """A file that trimesh reads, or (in Python) a :class:`Mesh`."""
    shape: Text | None = None
    params: dict[str, Any] = Field(default_factory=dict)
    fit: Positive | None = None
    """Centre the bounding box at 0 and scale its longest side to this, first."""
    scale: Scale = 1.0
    rotate: Annotated[tuple[Number, Number, Number, Number], BeforeValidator(plain)] = (0.0, 0.0, 1.0, 0.0)
    """Axis and degrees."""
    translate: Vector = (0.0, 0.0, 0.0)
    smooth: Flag = True
    """Shading normals: interpolated, or the facet's."""
    material: Material = Field(default_factory=Material)

    @model_validator(mode="after")
    def _one_geometry(self) -> Object:
        if (self.mesh is None) == (self.shape is None):
            raise ValueError("needs either 'mesh' or 'shape', and not both")
        if self.params and self.shape is None:
            raise ValueError("'params' goes with 'shape'")
        if max(map(abs, self.rotate[:3])) < SMALLEST:
            raise ValueError(f"rotate: the axis must not be the zero vector, nor shorter than {SMALLEST:g}")
        return self

    @model_validator(mode="after")
    def _says_if_it_shines(self) -> Object:
        if self.material.excess is not None:
            total, channel = self.material.excess
            called = self.name or self.shape or (self.mesh if isinstance(self.mesh, str) else "without a name")
            _warn_once(
                f"object '{printable(called)}': material.albedo and material.mirror add up to {total:.3g} in "
                f"{channel}: above 1 it gives back more light than falls on it"
            )
        return self

    @functools.cached_property
    def geometry(self) -> Mesh:
        """The mesh in the object's own coordinates; objects with the same file or shape share one."""
        if self.shape is not None:
            return shapes.make(self.shape, self.params)
        return self.mesh if isinstance(self.mesh, Mesh) else load_mesh(str(self.mesh))

    @property
    def texture(self) -> StoredPicture | None:
        """The picture that ``material.texture`` names; None without one."""
        return self.material.picture

    @property
    def is_reflector(self) -> bool:
        """Whether the object mirrors."""
        return any(self.material.mirror)

    def world_from_object(self) -> np.ndarray:
        """(4, 4) float64.

        Raises:
            InputError: fit, scale and the mesh's own size give a size that is not allowed.
        """
        return self._world_from_object.copy()

    def world_corners(self) -> np.ndarray:
        """(8, 3) float64: the corners of the object's own box, in the world."""
        low, high = self.geometry.bounds
        corners = np.where(CORNERS == 0, low, high)
        return (np.hstack([corners, np.ones((8, 1))]) @ self._world_from_object.T)[:, :3]

    @functools.cached_property
    def _world_from_object(self) -> np.ndarray:
        low, high = self.geometry.bounds
        side = float((high - low).max())
        matrix = np.eye(4)
        with np.errstate(all="ignore"):  # what is not finite is refused below
            if self.fit is not None:
                matrix = _scaling(self.fit / side if side > 0.0 else 1.0) @ _translation(-(low + (high - low) / 2))
            matrix = _translation(self.translate) @ _rotation(self.rotate) @ _scaling(self.scale) @ matrix
            sizes = np.linalg.norm(matrix[:3, :3] * (side or 1.0), axis=0)
        if not (np.isfinite(matrix).all() and SMALLEST <= sizes.min() and sizes.max() <= LARGEST):
            fit = "" if self.fit is None else f"fit {self.fit:g}, "
            raise InputError(
                f"{fit}scale {self.scale} and the mesh's own size of {side:g} give a size of {sizes.min():g} to "
                f"{sizes.max():g} along its axes, allowed are {SMALLEST:g} to {LARGEST:g}"
            )
        return matrix


@functools.lru_cache(maxsize=1024)
def _warn_once(line: str) -> None:
    """Say it once: an object is built anew whenever it is moved."""
    _log.warning("%s", line)


def _translation(offset: Any) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def _scaling(factor: Any) -> np.ndarray:
    return np.diag([*np.broadcast_to(factor, 3), 1.0]).astype(float)


def _rotation(axis_and_degrees: tuple[float, float, float, float]) -> np.ndarray:
    """Rodrigues' formula."""
    axis = np.asarray(axis_and_degrees[:3], float)
    x, y, z = axis / np.linalg.norm(axis)
    # Whole quarter turns must be exact, so that they only permute axes.
    degrees = axis_and_degrees[3] % 360.0
    quarters = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}
    cosine, sine = quarters.get(degrees, (np.cos(np.radians(degrees)), np.sin(np.radians(degrees))))
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    along = np.outer([x, y, z], [x, y, z])
    matrix = np.eye(4)
    matrix[:3, :3] = cosine * np.eye(3) + sine * cross + (1 - cosine) * along
    return matrix


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Reflection:
    """The scene's defaults for rendering; the caller's and the command line's win."""

    method: Text = "ldt"
    max_bounces: Annotated[Whole, Field(ge=1, le=64)] = 1


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Expectation:
    """What the image tests hold a method to in this scene."""

    ssim: Annotated[Real, Field(ge=0.0, le=1.0)]


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Scene:
    """A camera, lights and objects."""

    camera: Camera
    environment: Environment = Field(default_factory=Environment)
    lighting: Lighting = Field(default_factory=Lighting)
    lights: Annotated[tuple[Light, ...], Field(alias="light", max_length=MAX_LIGHTS)] = ()
    objects: Annotated[tuple[Object, ...], Field(alias="object", max_length=MAX_SIDE)] = ()
    reflection: Reflection = Field(default_factory=Reflection)
    expect: dict[str, Expectation] = Field(default_factory=dict)

    @functools.cached_property
    def layout_box(self) -> np.ndarray:
        """(2, 3) float64: the lowest and highest corner of the box about all objects in the world, as the scene was
        laid out. Scenes that :meth:`with_camera` and :meth:`with_object` make of it keep that box, wherever objects
        move."""
        if not self.objects:
            return np.array([[-1.0] * 3, [1.0] * 3])
        corners = np.concatenate([entry.world_corners() for entry in self.objects])
        return np.stack([corners.min(axis=0), corners.max(axis=0)])

    def _laid_out_alike(self, other: Scene) -> Scene:
        """A scene that comes from this one, with its ``layout_box``."""
        vars(other)["layout_box"] = self.layout_box
        return other

    def with_camera(self, camera: Camera) -> Scene:
        """The same scene seen by another camera."""
        return self._laid_out_alike(dataclasses.replace(self, camera=camera))

    def number_of(self, name: str) -> int:
        """The number of the object called ``name``, the first of several.

        Raises:
            InputError: there is none.
        """
        names = [entry.name for entry in self.objects]
        if name not in names:
            raise unknown_name("object", name, names)
        return names.index(name)

    def with_object(self, name: str, **changes: Any) -> Scene:
        """The same scene with other values for fields of the object called ``name``.

        Raises:
            InputError: an unknown object or field, or a value that is not allowed.
        """
        number = self.number_of(name)
        known = {entry.name for entry in dataclasses.fields(Object)}
        for field in changes:
            if field not in known:
                raise unknown_name("field of an object", field, known)
        try:
            changed = dataclasses.replace(self.objects[number], **changes)
        except InputError as error:
            raise error.within(f"object '{name}'") from None
        if not {"mesh", "shape", "params"} & set(changes):
            changed.__dict__["geometry"] = self.objects[number].geometry  # not made again
        objects = (*self.objects[:number], changed, *self.objects[number + 1 :])
        return self._laid_out_alike(dataclasses.replace(self, objects=objects))

    @property
    def environment_image(self) -> StoredPicture | None:
        """The picture that ``environment.image`` names; None without one."""
        return self.environment.picture


_ADAPTER = TypeAdapter(Scene)


def _allowed_keys(kind: type, table: str = "") -> dict[str, list[str]]:
    """Table key -> the keys it may hold, for every table below ``kind``."""
    keys: dict[str, list[str]] = {table: []}
    hints = typing.get_type_hints(kind)
    fields: dict[str, Any] = vars(kind)["__pydantic_fields__"]
    for entry in dataclasses.fields(kind):
        name = fields[entry.name].alias or entry.name
        keys[table].append(name)
        for inner in [hints[entry.name], *typing.get_args(hints[entry.name])]:
            if dataclasses.is_dataclass(inner) and inner is not Mesh and isinstance(inner, type):
                keys |= _allowed_keys(inner, f"{table}.{name}" if table else name)
    return keys


def load_scene(path: str | Path) -> Scene:
    """Read a scene file (TOML), its meshes and its pictures.

    Raises:
        InputError: one line naming the file, the key, what is wrong and what is allowed.
    """
    path = Path(path)
    tables = read_toml(path)
    try:
        scene = _ADAPTER.validate_python(tables)
    except ValidationError as error:
        raise first_fault(error, _allowed_keys(Scene)).within(str(path)) from None
    except InputError as error:
        raise error.within(str(path)) from None
    with budget.account():
        return _found(scene, path)


def _found(scene: Scene, path: Path) -> Scene:
    """The scene with every file found and read; a fault names the key."""
    objects = []
    meshes: dict[tuple[str | None, str, str], Mesh] = {}
    for index, entry in enumerate(scene.objects):
        key = f"object[{index}]"
        mesh = entry.mesh
        if isinstance(mesh, str):
            mesh = _beside(path, mesh, f"{key}.mesh")
        material = entry.material
        if material.texture is not None:
            found = _beside(path, material.texture, f"{key}.material.texture")
            material = dataclasses.replace(material, texture=found)
        placed = dataclasses.replace(entry, mesh=mesh, material=material)
        # What several objects share is made once, and so is taken from the budget once.
        source = entry.shape, str(mesh), json.dumps(entry.params, sort_keys=True, default=str)
        if source in meshes:
            placed.__dict__["geometry"] = meshes[source]
        meshes[source] = _read(path, f"{key}.{'mesh' if entry.shape is None else 'shape'}", placed, "geometry")
        _read(path, f"{key}.material.texture", placed, "texture")
        if placed.material.texture is not None and placed.geometry.uvs is None:
            raise InputError(f"{path}: {key}.material.texture: the object has no texture coordinates (UVs)")
        _read(path, key, placed, "_world_from_object")
        objects.append(placed)
    environment = scene.environment
    if environment.image is not None:
        found = _beside(path, environment.image, "environment.image")
        environment = dataclasses.replace(environment, image=found)
    ready = dataclasses.replace(scene, objects=tuple(objects), environment=environment)
    _read(path, "environment.image", ready, "environment_image")
    return ready


def _beside(scene_path: Path, name: str, key: str) -> str:
    """The file called ``name`` beside the scene, or else in the folders of LDTREFL_MESH_PATH."""
    listed = os.environ.get(MESH_PATH_VARIABLE, "").split(os.pathsep)
    folders = [scene_path.parent, *(Path(folder) for folder in listed if folder)]
    for folder in folders:
        candidate = folder / name
        try:
            if candidate.is_file():
                return str(candidate)
        except (OSError, ValueError) as error:
            raise InputError(f"{scene_path}: {key}: '{name}' is no file name ({error})") from error
    places = "beside the scene and in LDTREFL_MESH_PATH" + ("" if len(folders) > 1 else " (which is not set)")
    raise InputError(f"{scene_path}: {key}: no file '{name}' (looked {places})")


def _read(path: Path, key: str, owner: Object | Scene, attribute: str) -> Any:
    """An attribute that is read or made when it is asked for; a fault names the file and the key."""
    try:
        return getattr(owner, attribute)
    except InputError as error:
        raise InputError(f"{path}: {key}: {error}") from None
    except MemoryError:
        raise InputError(f"{path}: {key}: too large for this machine's memory") from None
