"""The scene: dataclasses that check themselves, and ``load_scene`` for TOML files.

Conventions: right-handed, any ``up``. Angles in degrees, radiance linear RGB. Every dataclass may be built in Python
with the same names and checks as the file's keys; wrong values raise ``InputError`` (from a file) or pydantic's
``ValidationError`` (a ``ValueError``, in Python).
"""

from __future__ import annotations

import dataclasses
import functools
import os
import tomllib
import typing
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, TypeAdapter, ValidationError, model_validator
from pydantic.dataclasses import dataclass

from ldtrefl import shapes
from ldtrefl.errors import InputError, first_fault, unknown_name
from ldtrefl.image import stored_picture
from ldtrefl.mesh import Mesh
from ldtrefl.mesh_files import load_mesh

MESH_PATH_VARIABLE = "LDTREFL_MESH_PATH"
MAX_SIDE = 16384
"""Pixels along a side of an image, and objects in a scene."""
LARGEST = 1e15
"""Largest coordinate: its square and the products of two stay far inside float32's range once scaled."""


def _no_bool(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("should be a number")
    return value


Number = Annotated[float, BeforeValidator(_no_bool), Field(strict=True, allow_inf_nan=False, ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, BeforeValidator(_no_bool), Field(strict=True, gt=0.0, le=LARGEST, allow_inf_nan=False)]
Whole = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
Text = Annotated[str, Field(strict=True, min_length=1)]
Vector = tuple[Number, Number, Number]
Color = tuple[Annotated[Number, Field(ge=0.0)], Annotated[Number, Field(ge=0.0)], Annotated[Number, Field(ge=0.0)]]
Reflectance = tuple[
    Annotated[Number, Field(ge=0.0, le=1.0)],
    Annotated[Number, Field(ge=0.0, le=1.0)],
    Annotated[Number, Field(ge=0.0, le=1.0)],
]


def _nonzero(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    if not any(vector):
        raise ValueError("must not be the zero vector")
    return vector


Direction = Annotated[Vector, AfterValidator(_nonzero)]

_CONFIG = ConfigDict(extra="forbid", arbitrary_types_allowed=True, populate_by_name=True)


@dataclass(frozen=True, kw_only=True, config=_CONFIG)
class Camera:
    """A pinhole camera; pixel centres at +0.5, row 0 at the top."""

    eye: Vector
    look_at: Vector
    up: Direction = (0.0, 0.0, 1.0)
    fov_y: Annotated[float, Field(strict=True, gt=0.0, lt=180.0)] = 40.0
    """Degrees from the lower to the upper edge of the image."""
    width: Annotated[Whole, Field(ge=1, le=MAX_SIDE)] = 768
    height: Annotated[Whole, Field(ge=1, le=MAX_SIDE)] = 512

    @model_validator(mode="after")
    def _looks_somewhere(self) -> Camera:
        forward = np.subtract(self.look_at, self.eye)
        if not forward.any():
            raise ValueError("eye and look_at are the same point")
        up = np.asarray(self.up) / np.linalg.norm(self.up)
        if np.linalg.norm(np.cross(forward / np.linalg.norm(forward), up)) < 1e-9:  # float64 can't tell a side
            raise ValueError("up is parallel to the line from eye to look_at")
        return self


@dataclass(frozen=True, kw_only=True, config=_CONFIG)
class Environment:
    """What a ray that hits nothing sees: a blend by height, or an equirectangular image."""

    sky: Color = (0.55, 0.70, 0.95)
    ground: Color = (0.30, 0.28, 0.25)
    image: Text | None = None


@dataclass(frozen=True, kw_only=True, config=_CONFIG)
class Lighting:
    """What all lights share."""

    ambient: Color = (0.15, 0.15, 0.15)
    """Added irradiance / pi."""
    shadows: Flag = False


@dataclass(frozen=True, kw_only=True, config=_CONFIG)
class Light:
    """A directional or a point light."""

    kind: Literal["directional", "point"]
    direction: Direction | None = None
    """Directional: the way the light travels."""
    radiance: Color | None = None
    """Directional: radiance leaving a white diffuse surface that faces the light."""
    position: Vector | None = None
    intensity: Color | None = None
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


@dataclass(frozen=True, kw_only=True, config=_CONFIG)
class Material:
    """``emission + albedo * texture * light + mirror * reflected radiance``."""

    albedo: Color = (0.8, 0.8, 0.8)
    texture: Text | None = None
    """A picture, times albedo; needs UVs. Without one, the mesh file's own textures count."""
    emission: Color = (0.0, 0.0, 0.0)
    mirror: Reflectance = (0.0, 0.0, 0.0)
    """Specular reflectance; any channel above 0 makes the object a reflector."""
    fresnel: Flag = False
    """Schlick's approximation, with ``mirror`` as the reflectance at normal incidence."""


@dataclass(frozen=True, kw_only=True, config=_CONFIG)
class Object:
    """A mesh or a shape, placed: fit, then scale, rotate, translate."""

    name: str = ""
    mesh: Text | Mesh | None = None
    """A file that trimesh reads, or (in Python) a :class:`Mesh`."""
    shape: Text | None = None
    params: dict[str, Any] = Field(default_factory=dict)
    fit: Positive | None = None
    """Centre the bounding box at 0 and scale its longest side to this, first."""
    scale: Positive | tuple[Positive, Positive, Positive] = 1.0
    rotate: tuple[Number, Number, Number, Number] = (0.0, 0.0, 1.0, 0.0)
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
        if not any(self.rotate[:3]):
            raise ValueError("rotate: the axis must not be the zero vector")
        return self

    @functools.cached_property
    def geometry(self) -> Mesh:
        """The mesh in the object's own coordinates; objects with the same file or shape share one."""
        if self.shape is not None:
            return shapes.make(self.shape, self.params)
        return self.mesh if isinstance(self.mesh, Mesh) else load_mesh(str(self.mesh))

    @functools.cached_property
    def texture(self) -> np.ndarray | None:
        """``material.texture``: (h, w, 3) as it is stored, uint8, sRGB, or float32, linear; None without one."""
        return None if self.material.texture is None else stored_picture(self.material.texture)

    @property
    def is_reflector(self) -> bool:
        """Whether the object mirrors."""
        return any(self.material.mirror)

    def world_from_object(self) -> np.ndarray:
        """(4, 4) float64."""
        matrix = np.eye(4)
        if self.fit is not None:
            low, high = self.geometry.bounds
            side = float((high - low).max())
            matrix = _scaling(self.fit / side if side > 0.0 else 1.0) @ _translation(-(low + (high - low) / 2))
        return _translation(self.translate) @ _rotation(self.rotate) @ _scaling(self.scale) @ matrix


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


@dataclass(frozen=True, kw_only=True, config=_CONFIG)
class Reflection:
    """The scene's defaults for rendering; the caller's and the command line's win."""

    method: Text = "ldt"
    max_bounces: Annotated[Whole, Field(ge=1, le=64)] = 1


@dataclass(frozen=True, kw_only=True, config=_CONFIG)
class Expectation:
    """What the image tests hold a method to in this scene."""

    ssim: Annotated[float, Field(strict=True, ge=0.0, le=1.0)]


@dataclass(frozen=True, kw_only=True, config=_CONFIG)
class Scene:
    """A camera, lights and objects."""

    camera: Camera
    environment: Environment = Field(default_factory=Environment)
    lighting: Lighting = Field(default_factory=Lighting)
    lights: Annotated[tuple[Light, ...], Field(alias="light", max_length=64)] = ()
    objects: Annotated[tuple[Object, ...], Field(alias="object", max_length=MAX_SIDE)] = ()
    reflection: Reflection = Field(default_factory=Reflection)
    expect: dict[str, Expectation] = Field(default_factory=dict)

    def with_camera(self, camera: Camera) -> Scene:
        """The same scene seen by another camera."""
        return dataclasses.replace(self, camera=camera)

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
        except ValidationError as error:
            raise first_fault(error, {}).within(f"object '{name}'") from None
        if not {"mesh", "shape", "params"} & set(changes):
            changed.__dict__["geometry"] = self.objects[number].geometry  # not made again
        return dataclasses.replace(self, objects=(*self.objects[:number], changed, *self.objects[number + 1 :]))

    @functools.cached_property
    def environment_image(self) -> np.ndarray | None:
        """``environment.image``: (h, w, 3) as it is stored, uint8, sRGB, or float32, linear; None without one."""
        return None if self.environment.image is None else stored_picture(self.environment.image)


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
    try:
        tables = tomllib.loads(path.read_bytes().decode("utf-8"))
    except OSError as error:
        raise InputError(f"{path}: the scene file cannot be read ({error.strerror})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"{path}: not TOML ({error})") from error
    try:
        scene = _ADAPTER.validate_python(tables)
    except ValidationError as error:
        raise first_fault(error, _allowed_keys(Scene)).within(str(path)) from None
    except InputError as error:
        raise error.within(str(path)) from None
    return _found(scene, path)


def _found(scene: Scene, path: Path) -> Scene:
    """The scene with every file found and read; a fault names the key."""
    objects = []
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
        _read(path, f"{key}.{'mesh' if entry.shape is None else 'shape'}", lambda placed=placed: placed.geometry)
        _read(path, f"{key}.material.texture", lambda placed=placed: placed.texture)
        if placed.material.texture is not None and placed.geometry.uvs is None:
            raise InputError(f"{path}: {key}.material.texture: the object has no texture coordinates (UVs)")
        objects.append(placed)
    environment = scene.environment
    if environment.image is not None:
        found = _beside(path, environment.image, "environment.image")
        environment = dataclasses.replace(environment, image=found)
    ready = dataclasses.replace(scene, objects=tuple(objects), environment=environment)
    _read(path, "environment.image", lambda: ready.environment_image)
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


def _read(path: Path, key: str, reader: Any) -> None:
    try:
        reader()
    except InputError as error:
        raise InputError(f"{path}: {key}: {error}") from None
    except MemoryError:
        raise InputError(f"{path}: {key}: too large for this machine's memory") from None
