"""Reading a scene file (TOML) with its meshes and its pictures; of a mesh file a scene is made (``mesh_scene.py``).

Files that a scene names are looked for beside it, then in the folders of ``LDTREFL_MESH_PATH``. A fault is one line
that names the scene file, the key, what is wrong and what is allowed.
"""

from __future__ import annotations

import dataclasses
import functools
import os
import typing
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import TypeAdapter, ValidationError

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError, first_fault
from ldtrefl.scene.description import Camera, Environment, Object, Scene
from ldtrefl.scene.framing import check_size
from ldtrefl.scene.includes import Include, read_includes, split_includes, up_axis, with_includes
from ldtrefl.scene.material import Material
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.mesh_scene import mesh_scene
from ldtrefl.scene.places import split_places, standing_in
from ldtrefl.scene.scene_parts import OBJECT_BYTES, SceneParts
from ldtrefl.scene.shared_geometries import SharedGeometries
from ldtrefl.scene.standing import on_the_floor, split_standing
from ldtrefl.scene.toml_text import read_toml

MESH_PATH_VARIABLE = "LDTREFL_MESH_PATH"

SCENE_ENDINGS = (".toml", "")
"""Of the names of scene files. All others are taken for mesh files."""

Result = TypeVar("Result")

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


def load_scene(
    path: str | Path,
    *,
    on: str | None = None,
    up: str | None = None,
    turn: float = 0.0,
    mirror_self: bool = False,
    size: tuple[int, int] | None = None,
    lenient: bool = False,
) -> Scene:
    """Read a scene file (TOML) with its meshes and its pictures, or make a scene of a mesh file.

    A mesh file is shown in a three-quarter view that fits, in soft studio light. Its objects stay where they are, but
    for being turned so that z is up and as ``turn`` says, and come first among the scene's.

    Args:
        path: a scene file, whose name ends in ``.toml`` or has no ending, or else a mesh file.
        on: of a mesh file: what it is put on. "studio", a matt floor; "mirror-floor"; "mirror-ball", a mirror ball
            beside it; "chrome", a floor with coloured balls that it mirrors itself.
        up: of a mesh file: its axis that points up, "x", "y", "z", "-x", "-y" or "-z". If not given, y of glTF and OBJ,
            z of others.
        turn: of a mesh file: degrees by which it is turned about that axis, counterclockwise as seen from above.
        mirror_self: of a mesh file: make it a mirror.
        size: width and height of the picture in pixels, in place of the scene's own.
        lenient: of a glTF file: show what can be read of one that requires extensions which are not.

    Raises:
        InputError: one line naming the file, the key, what is wrong and what is allowed.
    """
    path = Path(path)
    check_size(size)
    if not is_scene_file(path):
        with budget.account():
            return mesh_scene(path, on, up, turn=turn, mirror_self=mirror_self, size=size, lenient=lenient)
    given = {"on": on, "up": up, "turn": turn, "mirror_self": mirror_self, "lenient": lenient}
    for name, value in given.items():
        if value not in (None, False, 0.0):
            raise InputError(f"{path}: '{name}' goes with a mesh file, this is a scene file")
    scene = _load_toml(path)
    if size is None:
        return scene
    return scene.with_camera(dataclasses.replace(scene.camera, width=size[0], height=size[1]))


def is_scene_file(path: Path) -> bool:
    """Whether a file is taken for a scene file, by its name."""
    return path.suffix.lower() in SCENE_ENDINGS


def _load_toml(path: Path) -> Scene:
    """A scene file with all that it names."""
    tables = read_toml(path)
    try:
        tables, standing = split_standing(tables)
        tables, places = split_places(tables)
        tables, includes = split_includes(tables)
        with budget.account():
            included = _included(tables, includes, path)
        scene = _ADAPTER.validate_python(tables)
    except ValidationError as error:
        allowed = _allowed_keys(Scene)
        allowed["object"] += ["place", "places"]
        allowed |= {f"object.parts.{name}": allowed["object.material"] for name in _named_parts(tables)}
        raise first_fault(error, allowed).within(str(path)) from None
    except InputError as error:
        raise error.within(str(path)) from None
    with budget.account():
        return _found(scene, places, standing, path, included, includes)


def _named_parts(tables: dict[str, Any]) -> set[str]:
    """The names under ``parts`` of all objects of a scene file."""
    entries = tables.get("object")
    listed = [entry.get("parts") for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []
    return {name for parts in listed if isinstance(parts, dict) for name in parts}


def _included(tables: dict[str, Any], includes: list[Include], path: Path) -> list[SceneParts]:
    """What the scene file includes. Where it has no camera, ``tables`` is given the first that there is."""
    if not includes:
        return []
    camera = _camera_of(tables)
    parts = read_includes(includes, functools.partial(_file_near, path), up_axis(camera))
    found = [camera for part in parts for camera in part.cameras]
    if "camera" not in tables and found:
        tables["camera"] = found[0]
    return parts


def _camera_of(tables: dict[str, Any]) -> Camera | None:
    """The camera of a scene file's tables; None if it has none, or one that will be refused."""
    try:
        return TypeAdapter(Camera).validate_python(tables["camera"])
    except (KeyError, ValidationError):
        return None


def _found(
    scene: Scene,
    places: dict[int, np.ndarray],
    standing: frozenset[int],
    path: Path,
    included: list[SceneParts],
    includes: list[Include],
) -> Scene:
    """The scene with every file found and read, its objects in their ``places`` and ``standing`` where they should; a
    fault names the key."""
    count = len(scene.objects) - len(places) + sum(map(len, places.values()))
    _at(path, "object", lambda: budget.take(OBJECT_BYTES * count, f"a list of {count}"))
    shared = SharedGeometries()
    objects: list[Object] = []
    lifted: list[int] = []
    for index, entry in enumerate(scene.objects):
        key = f"object[{index}]"
        found = _found_object(entry, key, path, shared)
        lifted += [len(objects)] if index in standing else []
        if index in places:
            objects += _at(path, key, functools.partial(standing_in, found, places[index]))
        else:
            objects.append(found)
    environment = _found_environment(scene.environment, path)
    laid_out = dataclasses.replace(scene, objects=tuple(objects), environment=environment)
    try:
        laid_out = with_includes(laid_out, included, includes)
        laid_out.layout  # noqa: B018  (it refuses sizes that are not allowed)
    except InputError as error:
        for key, entry in zip(_keys(len(scene.objects), places), objects, strict=True):
            _at(path, key, entry.world_from_object)
        raise error.within(str(path)) from None
    if not lifted:
        return laid_out
    up = np.array(scene.camera.up)
    moved = _at(path, "object", lambda: on_the_floor(laid_out.objects, lifted, up))
    return dataclasses.replace(laid_out, objects=tuple(moved))


def _keys(tables: int, places: dict[int, np.ndarray]) -> Iterator[str]:
    """Where each object stands in the scene file."""
    for index in range(tables):
        if index in places:
            yield from (f"object[{index}]: places[{number}]" for number in range(len(places[index])))
        else:
            yield f"object[{index}]"


def _found_object(entry: Object, key: str, path: Path, shared: SharedGeometries) -> Object:
    """An object with its mesh and texture read; ``shared`` has the meshes of those before it."""
    found = _with_files_found(entry, key, path)
    kind = "mesh" if entry.shape is None else "shape"
    _at(path, f"{key}.{kind}", lambda: shared.give(found))
    materials = {"material": found.material} | {f"parts.{name}": own for name, own in found.parts.items()}
    for name, material in materials.items():
        if material.texture is not None:
            _at(path, f"{key}.{name}.texture", functools.partial(getattr, material, "picture"))
            if found.geometry.uvs is None:
                raise InputError(f"{path}: {key}.{name}.texture: the object has no texture coordinates (UVs)")
    return found


def _with_files_found(entry: Object, key: str, path: Path) -> Object:
    """An object with the paths of the files that it names."""
    changes: dict[str, Any] = {}
    if isinstance(entry.mesh, str):
        changes["mesh"] = _beside(path, entry.mesh, f"{key}.mesh")
    if entry.material.texture is not None:
        changes["material"] = _with_picture_found(entry.material, f"{key}.material", path)
    if entry.parts:
        parts = entry.parts.items()
        changes["parts"] = {name: _with_picture_found(own, f"{key}.parts.{name}", path) for name, own in parts}
    return dataclasses.replace(entry, **changes) if changes else entry


def _with_picture_found(material: Material, key: str, path: Path) -> Material:
    """A material with the path of the picture that it names."""
    if material.texture is None:
        return material
    return dataclasses.replace(material, texture=_beside(path, material.texture, f"{key}.texture"))


def _found_environment(environment: Environment, path: Path) -> Environment:
    """The environment with its picture read."""
    key = "environment.image"
    if environment.image is None:
        return environment
    found = dataclasses.replace(environment, image=_beside(path, environment.image, key))
    _at(path, key, lambda: found.picture)
    return found


def _beside(scene_path: Path, name: str, key: str) -> str:
    """The file called ``name`` near the scene; a fault names the scene file."""
    try:
        return _file_near(scene_path, name, key)
    except InputError as error:
        raise error.within(str(scene_path)) from None


def _file_near(scene_path: Path, name: str, key: str) -> str:
    """The file called ``name`` beside the scene, or else in the folders of LDTREFL_MESH_PATH."""
    listed = os.environ.get(MESH_PATH_VARIABLE, "").split(os.pathsep)
    folders = [scene_path.parent, *(Path(folder) for folder in listed if folder)]
    for folder in folders:
        candidate = folder / name
        try:
            if candidate.is_file():
                return str(candidate)
        except (OSError, ValueError) as error:
            raise InputError(f"{key}: '{name}' is no file name ({error})") from error
    places = "beside the scene and in LDTREFL_MESH_PATH" + ("" if len(folders) > 1 else " (which is not set)")
    raise InputError(f"{key}: no file '{name}' (looked {places})")


def _at(path: Path, key: str, read: Callable[[], Result]) -> Result:
    """What ``read`` gives; a fault names the scene file and the key."""
    try:
        return read()
    except InputError as error:
        raise InputError(f"{path}: {key}: {error}") from None
    except MemoryError:
        raise InputError(f"{path}: {key}: too large for this machine's memory") from None
