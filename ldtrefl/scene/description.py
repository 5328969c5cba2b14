"""The scene: dataclasses that check themselves. ``load.py`` reads them from files.

Conventions: right-handed, any ``up``. Angles in degrees, radiance linear RGB; one number stands for a grey. Every
dataclass may be built in Python with the same names and checks as the file's keys; wrong values raise ``InputError``.
"""

from __future__ import annotations

import dataclasses
import fnmatch
import functools
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BeforeValidator, Field, model_validator
from pydantic.dataclasses import dataclass

from ldtrefl.base.checked import (
    CONFIG,
    SMALLEST,
    Direction,
    Flag,
    Fraction,
    Number,
    Positive,
    Real,
    Rows,
    Scale,
    Text,
    Vector,
    Whole,
    plain,
    refusing_in_one_line,
)
from ldtrefl.base.errors import InputError, printable, unknown_name
from ldtrefl.base.notices import warn_once
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene import shapes
from ldtrefl.scene.environment import Environment
from ldtrefl.scene.layout import Layout
from ldtrefl.scene.lights import Light, Lighting
from ldtrefl.scene.material import Material
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.picture import Picture
from ldtrefl.scene.placement import UpAxis, placement
from ldtrefl.scene.readers import load_mesh
from ldtrefl.scene.smoothing import smoothed_facets

MAX_SIDE = 16384
"""The most pixels along a side of an image."""
MAX_OBJECTS = 1 << 20
"""The most objects in a scene."""
MAX_LIGHTS = 64
"""The most lights in a scene."""
MAX_SAMPLES = 1024
"""The most samples of a pixel."""
AMBIENT = (0.15, 0.15, 0.15)
"""Ambient light of which nothing is said, but of a preset of the environment."""
PARALLEL = 1e-9
"""Sine of the angle between the line of sight and ``up``: below it float64's rounding decides where right is."""
NARROWEST = 1e-6
"""The smallest field of view in degrees: at 16,384 pixels a pixel's share is still far above float64's rounding."""


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
        if np.linalg.norm(np.cross(forward / np.linalg.norm(forward), up)) < PARALLEL:
            raise ValueError("up is parallel to the line from eye to look_at")
        return self


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Object:
    """A mesh or a shape, placed: upright and fitted, then scale, rotate, translate."""

    name: str = ""
    mesh: Text | Mesh | None = None
    """A file that trimesh reads, or (in Python) a :class:`Mesh`."""
    shape: Text | None = None
    params: Mapping[str, object] = Field(default_factory=dict)
    up_axis: UpAxis = "z"
    """The axis of the mesh that is turned to +z."""
    matrix: Rows | None = None
    """Three rows of four numbers, by which the mesh is moved first; instead of ``fit``."""
    fit: Positive | None = None
    """Centre the bounding box at 0 and scale its longest side to this, first."""
    scale: Scale = 1.0
    rotate: Annotated[tuple[Number, Number, Number, Number], BeforeValidator(plain)] = (0.0, 0.0, 1.0, 0.0)
    """Axis and degrees."""
    translate: Vector = (0.0, 0.0, 0.0)
    smooth: Flag | None = None
    """Shading normals. None: as the mesh says. True: interpolated, those of facets that the mesh's file leaves flat, as
    all of STL files, too. False: the facet's."""
    material: Material = Material()
    parts: Mapping[str, Material] = Field(default_factory=dict)
    """Names of materials of the mesh's file, or patterns of such with * and ?: what is said of those parts in place of
    ``material``. The first that fits counts."""

    def __post_init__(self) -> None:
        # No validators of the class: they would be asked again when a scene takes the object.
        if (self.mesh is None) == (self.shape is None):
            raise ValueError("needs either 'mesh' or 'shape', and not both")
        if self.params and self.shape is None:
            raise ValueError("'params' goes with 'shape'")
        if self.matrix is not None and self.fit is not None:
            raise ValueError("'matrix' and 'fit' exclude each other")
        x, y, z, _ = self.rotate
        if abs(x) < SMALLEST and abs(y) < SMALLEST and abs(z) < SMALLEST:
            raise ValueError(f"rotate: the axis must not be the zero vector, nor shorter than {SMALLEST:g}")
        for key, material in {"material": self.material, **self.parts}.items():
            if (excess := material.excess) is not None:
                total, channel = excess
                named = printable(key)
                warn_once(
                    f"object '{self.called}': {named}.albedo and {named}.mirror add up to {total:.3g} in {channel}: "
                    "above 1 it gives back more light than falls on it"
                )

    @property
    def called(self) -> str:
        """What a line to the user calls the object."""
        return printable(self.name or self.shape or (self.mesh if isinstance(self.mesh, str) else "without a name"))

    @functools.cached_property
    def geometry(self) -> Mesh:
        """The mesh in the object's own coordinates; objects with the same file or shape share one."""
        if self.shape is not None:
            return shapes.make(self.shape, self.params)
        mesh = self.mesh if isinstance(self.mesh, Mesh) else load_mesh(str(self.mesh))
        return smoothed_facets(mesh) if self.smooth else mesh

    def share_geometry(self, mesh: Mesh) -> None:
        """Take the mesh of an object of the same file or shape: it is then neither made nor counted again."""
        object.__setattr__(self, "geometry", mesh)

    def changed(self, **changes: object) -> Object:
        """The same object with other values for some fields.

        Raises:
            InputError: an unknown field, or a value that is not allowed.
        """
        known = {entry.name for entry in dataclasses.fields(Object)}
        values: dict[str, Any] = changes  # pydantic checks them
        for field in sorted(changes.keys() - known):
            raise unknown_name("field of an object", field, known)
        try:
            changed = dataclasses.replace(self, **values)
            if not {"mesh", "shape", "params", "smooth"} & set(changes):
                changed.share_geometry(self.geometry)
            changed.world_from_object()  # refuses sizes that are not allowed
        except InputError as error:
            raise error.within(f"object '{self.name}'") from None
        return changed

    def deformed(self, vertices: ArrayLike) -> Object:
        """The same object with these (n, 3) vertices, for the same faces.

        Raises:
            InputError: more or fewer vertices than it has, or one that is not finite.
        """
        try:
            mesh = self.geometry.with_vertices(vertices)
        except InputError as error:
            raise error.within(f"object '{self.name}'") from None
        return self.changed(mesh=mesh, shape=None, params={})

    @property
    def texture(self) -> StoredPicture | None:
        """The picture that ``material.texture`` names; None without one."""
        return self.material.picture

    def material_of(self, name: str) -> Material:
        """What the scene says of a part whose material has this name in the mesh's file."""
        found = (material for pattern, material in self.parts.items() if fnmatch.fnmatchcase(name, pattern))
        return next(found, self.material)

    @property
    def is_reflector(self) -> bool:
        """Whether the scene makes the object, or a part of it, a mirror. What its file reflects does not count."""
        return any(any(self.material_of(part.material.name).mirror) for part in self.geometry.parts)

    def world_from_object(self) -> np.ndarray:
        """The object's place: (4, 4) float64, from the mesh's own coordinates to the world.

        Raises:
            InputError: fit, scale and the mesh's own size give a size that is not allowed.
        """
        return self._world_from_object.copy()

    @functools.cached_property
    def _world_from_object(self) -> np.ndarray:
        place = (self.fit, self.scale, self.rotate, self.translate, self.up_axis, self.matrix)
        return placement(self.geometry.fit_bounds, *place)


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Reflection:
    """The scene's defaults for rendering; the caller's and the command line's win."""

    method: Text = "ldt"
    max_bounces: Annotated[Whole, Field(ge=1, le=64)] = 4
    least_weight: Annotated[Real, Field(ge=0.0, le=1.0)] = 1.0 / 512.0
    """A ray ends at a mirror if less than this share of what it meets next would still arrive."""
    threshold: Fraction = 0.05
    """A surface that reflects less, as seen from where it is looked at, sends no ray: it shows the environment. What an
    object's ``mirror`` says always sends one."""
    rough_limit: Fraction = 0.25
    """A surface that is rougher sends no ray: it shows the environment, blurred."""
    samples: Annotated[Whole, Field(ge=1, le=MAX_SAMPLES)] | None = None
    """The most samples of a pixel: it has one, and more where it differs from its neighbours; 4 if not given."""


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
    objects: Annotated[tuple[Object, ...], Field(alias="object", max_length=MAX_OBJECTS)] = ()
    reflection: Reflection = Field(default_factory=Reflection)
    picture: Picture = Field(default_factory=Picture)
    expect: dict[str, Expectation] = Field(default_factory=dict)

    @functools.cached_property
    def layout(self) -> Layout:
        """Where the objects stand, and their meshes.

        Raises:
            InputError: a mesh cannot be had, or an object's size is not allowed.
        """
        return Layout.of(self.objects)

    @functools.cached_property
    def layout_box(self) -> np.ndarray:
        """(2, 3) float64: the lowest and highest corner of the box about all objects in the world, as the scene was
        laid out. Scenes that :meth:`with_camera` and :meth:`with_object` make of it keep that box, wherever objects
        move."""
        return self.layout.box

    def _laid_out_alike(self, other: Scene, layout: Layout) -> Scene:
        """A scene that comes from this one, with its ``layout_box`` and its objects' names."""
        vars(other).update(layout_box=self.layout_box, layout=layout, _numbers=self._numbers)
        return other

    def with_camera(self, camera: Camera) -> Scene:
        """The same scene seen by another camera."""
        return self._laid_out_alike(dataclasses.replace(self, camera=camera), self.layout)

    @functools.cached_property
    def _numbers(self) -> dict[str, int]:
        """The number of each name, of the first object that has it."""
        numbers: dict[str, int] = {}
        for number, entry in enumerate(self.objects):
            numbers.setdefault(entry.name, number)
        return numbers

    def number_of(self, name: str) -> int:
        """The number of the object called ``name``, the first of several.

        Raises:
            InputError: there is none.
        """
        if name not in self._numbers:
            raise unknown_name("object", name, self._numbers)
        return self._numbers[name]

    def with_object(self, name: str, **changes: object) -> Scene:
        """The same scene with other values for fields of the object called ``name``.

        Raises:
            InputError: an unknown object or field, or a value that is not allowed.
        """
        number = self.number_of(name)
        return self.with_objects({number: self.objects[number].changed(**changes)})

    def with_vertices(self, name: str, vertices: ArrayLike) -> Scene:
        """The same scene with the mesh of the object called ``name`` deformed: (n, 3) vertices, for the same faces.

        Raises:
            InputError: an unknown object, more or fewer vertices than it has, or one that is not finite.
        """
        number = self.number_of(name)
        return self.with_objects({number: self.objects[number].deformed(vertices)})

    def with_objects(self, changed: Mapping[int, Object]) -> Scene:
        """The same scene with objects in the place of those of some numbers, each made from that one."""
        objects = list(self.objects)
        for number, entry in changed.items():
            objects[number] = entry
        placed = {number: (entry.geometry, entry.world_from_object()) for number, entry in changed.items()}
        return self._laid_out_alike(dataclasses.replace(self, objects=tuple(objects)), self.layout.with_objects(placed))

    @property
    def environment_image(self) -> StoredPicture | None:
        """The environment's picture; None without one."""
        return self.environment.picture

    @property
    def ambient(self) -> tuple[float, float, float]:
        """Ambient light: what ``lighting`` says, or that of the environment's preset, or ``AMBIENT``."""
        if self.lighting.ambient is not None:
            return self.lighting.ambient
        surroundings, strength = self.environment.surroundings, self.environment.strength
        if surroundings is None:
            return AMBIENT
        red, green, blue = surroundings.ambient
        return strength * red, strength * green, strength * blue
