"""A scene -> the text of a scene file that makes the same picture, with comments for who has not seen one before."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ldtrefl.base.errors import InputError
from ldtrefl.files.atomic_write import replaceable, written_whole
from ldtrefl.scene.description import Environment, Material, Reflection, Scene
from ldtrefl.scene.includes import Include
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.picture import Picture

FILES = ("mesh", "texture", "image", "file")
"""Keys that name files."""

COMMENTS = {
    "camera": "z is up",
    "camera.fov_y": "degrees from the lower to the upper edge",
    "environment": "what a ray sees that hits nothing",
    "environment.sky": "straight up, blended with the ground by height",
    "environment.preset": "it brings light along",
    "lighting.ambient": "from all sides, as if it were the radiance of a white surface",
    "lighting.occlusion": "dims ambient light beside what stands close",
    "light.direction": "the way the light travels",
    "light.radiance": "leaving a white surface that faces it; of a sphere or rectangle, its own",
    "include": "all nodes of a glTF file",
    "include.lights": "whether its lights come, too",
    "object.mesh": "looked for beside this file, then in LDTREFL_MESH_PATH",
    "object.up_axis": "the axis of the mesh that is turned to z",
    "object.shape": "docs/scenes.md lists them",
    "object.scale": "one number, or one for each axis; then:",
    "object.rotate": "axis and degrees; then:",
    "object.material.albedo": "the colour of its scattered light",
    "object.material.emission": "radiance, added, unlit",
    "object.material.mirror": "specular reflectance; above 0 makes it a mirror",
    "picture.exposure": "stops",
    "picture.tone_mapping": "none, agx or aces",
}
"""What stands beside a key where it comes first."""

BARE = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-")
"""Characters of keys without quotation marks."""


def save_scene(path: str | Path, scene: Scene, include: Include | None = None) -> None:
    """Write a scene file. The paths of files in it are relative to its folder.

    Args:
        path: of the scene file.
        scene: what it says.
        include: what brings those objects whose meshes are in memory, which have one material, if any.

    Raises:
        InputError: it cannot be written, or an object's mesh is in no file.
    """
    path = check_scene_writable(path)
    try:
        data = scene_text(scene, path, include).encode("utf-8")
    except UnicodeEncodeError as error:
        raise InputError(f"{path}: a name in it is no text ({error.reason})") from None
    with written_whole(path) as scratch:
        scratch.write_bytes(data)


def check_scene_writable(path: str | Path) -> Path:
    """``path``, if a scene file can be written there: asked before any work is spent on it.

    Raises:
        InputError: its name does not end in .toml, or something in its place or its folder forbids it.
    """
    path = Path(path)
    if path.suffix.lower() != ".toml":
        raise InputError(f"{path}: a scene file's name ends in .toml")
    folder = replaceable(path).parent
    if not folder.is_dir():
        raise InputError(f"{path}: the folder {folder} does not exist")
    return path


def scene_text(scene: Scene, path: Path, include: Include | None = None) -> str:
    """The scene as a file at ``path``: what has its default is left out; :func:`save_scene` says what is what.

    Raises:
        InputError: an object's mesh is in no file.
    """
    lines = _Lines(path)
    lines.table("camera", "[camera]", _written(scene.camera, always=True))
    lines.table("environment", "[environment]", _environment(scene.environment))
    lines.table("lighting", "[lighting]", _written(scene.lighting, always=True))
    if scene.lighting.occlusion is not None:
        occlusion = _written(scene.lighting.occlusion, always=True)
        lines.table("lighting.occlusion", "[lighting.occlusion]", occlusion, is_part=True)
    for light in scene.lights:
        lines.table("light", "[[light]]", _written(light))
    included = [entry for entry in scene.objects if isinstance(entry.mesh, Mesh)]
    if included:
        material = included[0].material
        if include is None or any(entry.material != material for entry in included):
            name = included[0].called
            raise InputError(f"{path}: the mesh of the object '{name}' is in no file that a scene could name")
        told = include if material == Material() else dataclasses.replace(include, parts={"*": material})
        lines.table("include", "[[include]]", _written(told))
    for entry in scene.objects:
        if isinstance(entry.mesh, Mesh):
            continue
        lines.table("object", "[[object]]", _written(entry))
        if own := list(_material(entry.material)):
            lines.table("object.material", "[object.material]", own, is_part=True)
    if scene.reflection != Reflection():
        lines.table("reflection", "[reflection]", _written(scene.reflection))
    if scene.picture != Picture():
        lines.table("picture", "[picture]", _written(scene.picture))
    return "\n".join(lines.written) + "\n"


def _written(entry: Any, *, always: bool = False) -> Iterator[tuple[str, Any]]:
    """(key, value) of a dataclass; without ``always``, of those that are not as by default."""
    for field in dataclasses.fields(entry):
        value = getattr(entry, field.name)
        is_table = dataclasses.is_dataclass(value)
        if not is_table and value not in (None, {}) and (always or value != field.default):
            yield field.name, value


def _environment(environment: Environment) -> Iterator[tuple[str, Any]]:
    """(key, value) of what is not as by default, or of both colours where they are all that is seen."""
    if environment.image is None and environment.preset is None:
        yield from (("sky", environment.sky), ("ground", environment.ground))
    else:
        yield from _written(environment)


def _material(material: Material) -> Iterator[tuple[str, Any]]:
    """(key, value) of what is not as by default. The default of albedo depends on ``mirror``."""
    if material.albedo != Material(mirror=material.mirror).albedo:
        yield "albedo", material.albedo
    yield from ((key, value) for key, value in _written(material) if key != "albedo")


class _Lines:
    """The lines of a scene file, as far as they are written."""

    def __init__(self, path: Path) -> None:
        self._folder = Path(os.path.realpath(path)).parent
        self._explained: set[str] = set()
        self.written = [f"# Render it: ldtrefl render {path.name}"]

    def table(self, name: str, header: str, entries: Iterable[tuple[str, Any]], *, is_part: bool = False) -> None:
        """Write a table: its header, and (key, value) of each entry."""
        if not is_part:
            self.written.append("")
        self.written.append(header + self._comment(name))
        for key, value in entries:
            text = self._relative(value) if key in FILES else value
            self.written.append(f"{_key(key)} = {_value(text)}" + self._comment(f"{name}.{key}"))

    def _comment(self, name: str) -> str:
        """What stands beside a key, where it is the first of its kind."""
        if name not in COMMENTS or name in self._explained:
            return ""
        self._explained.add(name)
        return f"  # {COMMENTS[name]}"

    def _relative(self, file: str) -> str:
        """A file's path from the folder of the scene."""
        return Path(os.path.relpath(os.path.realpath(file), self._folder)).as_posix()


def _key(key: str) -> str:
    return key if key and BARE.issuperset(key) else _value(key)


def _value(value: object) -> str:
    """A value as TOML has it; a number is read as the same again."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + "".join(_character(c) for c in value) + '"'
    if isinstance(value, Material):
        return _value(dict(_material(value)))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value)


def _character(character: str) -> str:
    if character in '\\"':
        return "\\" + character
    return character if character.isprintable() or ord(character) > 0xFFFF else f"\\u{ord(character):04x}"
