"""The key ``[[include]]`` of a scene file: everything that stands in a glTF file, placed as a whole.

    [[include]]
    file = "room.glb"               # looked for where meshes are
    scale = 1.0                     # of all of it; then rotate, translate
    rotate = [0.0, 0.0, 1.0, 90.0]
    translate = [0.0, 0.0, 0.5]
    lights = true                   # bring its lights
    lenient = false                 # show what can be read of it if it requires extensions that are not
    parts = { "glass*" = { mirror = 0.9 } }  # what is said of nodes or materials of these names

Its nodes become objects under their names, its lights are added to the scene's, and where the scene file has no
``[camera]``, its first camera is taken. glTF is y up: the file is turned so that it stands upright in a scene whose
camera's ``up`` is an axis, as z is without one.
"""

from __future__ import annotations

import dataclasses
import fnmatch
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from ldtrefl.base.checked import CONFIG, Flag, Number, Scale, Text, Vector, plain, refusing_in_one_line
from ldtrefl.base.errors import InputError, first_fault, unknown_name
from ldtrefl.scene.description import Camera, Scene
from ldtrefl.scene.material import Material
from ldtrefl.scene.placement import placements
from ldtrefl.scene.scene_parts import SceneParts

MOST_INCLUDES = 1000
"""Files that a scene may include."""


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Include:
    """A table of ``[[include]]``."""

    file: Text
    """A glTF file."""
    scale: Scale = 1.0
    rotate: Annotated[tuple[Number, Number, Number, Number], BeforeValidator(plain)] = (0.0, 0.0, 1.0, 0.0)
    """Axis and degrees."""
    translate: Vector = (0.0, 0.0, 0.0)
    lights: Flag = True
    """Whether its lights are brought."""
    lenient: Flag = False
    """Whether what can be read is shown of a file that requires extensions which are not."""
    parts: Mapping[str, Material] = Field(default_factory=dict)
    """Names of its nodes or materials, or patterns of such with * and ?: what is said of them in place of the file."""


_ADAPTER: TypeAdapter[Any] = TypeAdapter(dict[str, Annotated[list[Include], Field(max_length=MOST_INCLUDES)]])


def split_includes(tables: dict[str, object]) -> tuple[dict[str, object], list[Include]]:
    """A scene file's tables without the key, and what it holds.

    Raises:
        InputError: naming the key that is not allowed.
    """
    if "include" not in tables:
        return tables, []
    try:
        includes = _ADAPTER.validate_python({"include": tables["include"]})["include"]
    except ValidationError as error:
        raise first_fault(error, {"include": [field.name for field in dataclasses.fields(Include)]}) from None
    return {key: value for key, value in tables.items() if key != "include"}, includes


def read_includes(includes: list[Include], find: Callable[[str, str], str], up: str) -> list[SceneParts]:
    """What each file holds, in its place.

    Args:
        includes: the tables.
        find: the path of a file, from its name and its key.
        up: the axis that points up in the scene.

    Raises:
        InputError: a file cannot be had or read; the message names the key.
    """
    if not includes:
        return []
    from ldtrefl.scene.gltf.to_scene import scene_parts  # noqa: PLC0415  its readers take a quarter of a second

    found = []
    for number, include in enumerate(includes):
        key = f"include[{number}]"
        path = find(include.file, f"{key}.file")
        try:
            held = scene_parts(Path(path), up=up, lenient=include.lenient)
            parts = told(held, _with_pictures_found(include, key, find))
            found.append(moved_as_told(parts, include))
        except InputError as error:
            raise error.within(key) from None
    return found


def with_includes(scene: Scene, parts: list[SceneParts], includes: list[Include]) -> Scene:
    """The scene with what was included behind its own objects and lights.

    Raises:
        InputError: there are more lights or objects than are allowed.
    """
    objects = [entry for part in parts for entry in part.objects]
    lights = [light for part, include in zip(parts, includes, strict=True) if include.lights for light in part.lights]
    return dataclasses.replace(scene, objects=(*scene.objects, *objects), lights=(*scene.lights, *lights))


def up_axis(camera: Camera | None) -> str:
    """The axis along which a camera's ``up`` points, by its name in ``to_scene.UPRIGHT``; z if it is none, or for
    None."""
    if camera is None:
        return "z"
    up = np.asarray(camera.up, float)
    axis = int(np.argmax(np.abs(up)))
    if np.count_nonzero(up) != 1:
        return "z"
    return ("" if up[axis] > 0 else "-") + "xyz"[axis]


def _with_pictures_found(include: Include, key: str, find: Callable[[str, str], str]) -> dict[str, Material]:
    """The materials of ``parts`` with the paths of the pictures that they name."""
    found = dict(include.parts)
    for name, own in include.parts.items():
        if own.texture is not None:
            texture = find(own.texture, f"{key}.parts.{name}.texture")
            found[name] = dataclasses.replace(own, texture=texture)
    return found


def told(parts: SceneParts, materials: Mapping[str, Material]) -> SceneParts:
    """Parts of a scene with what is said of nodes and materials of these names.

    Raises:
        InputError: a name fits neither.
    """
    for name in materials:
        if not any(fnmatch.fnmatchcase(known, name) for known in _known_names(parts)):
            raise unknown_name("node or material", name, _known_names(parts)).within(f"parts.{name}")
    if not materials:
        return parts
    objects = []
    for entry in parts.objects:
        own = next((own for name, own in materials.items() if fnmatch.fnmatchcase(entry.name, name)), entry.material)
        objects.append(entry.changed(material=own, parts=dict(materials)))
    return dataclasses.replace(parts, objects=tuple(objects))


def _known_names(parts: SceneParts) -> set[str]:
    """Names of nodes and materials."""
    materials = {part.material.name for entry in parts.objects for part in entry.geometry.parts}
    return {entry.name for entry in parts.objects} | materials - {""}


def moved_as_told(parts: SceneParts, include: Include) -> SceneParts:
    """Parts of a scene moved as the table says.

    Raises:
        InputError: the axis of the rotation is no direction.
    """
    if not any(include.rotate[:3]):
        raise InputError("rotate: the axis must not be the zero vector")
    scale = np.broadcast_to(include.scale, (1, 3)).astype(float)
    turn, shift = np.array([include.rotate], float), np.array([include.translate], float)
    matrix = placements(np.zeros((1, 2, 3)), np.array([np.nan]), scale, turn, shift)[0]
    if np.array_equal(matrix, np.eye(4)):
        return parts
    return parts.moved(matrix)
