"""A mesh file as a scene: its objects, upright, on a stage of ``stages.py`` or by themselves."""

from __future__ import annotations

import typing
from contextlib import suppress
from pathlib import Path

from ldtrefl.base.errors import unknown_name
from ldtrefl.files.regular_files import check_regular
from ldtrefl.scene.composed import composed
from ldtrefl.scene.description import Object, Scene
from ldtrefl.scene.placement import UpAxis

Y_UP = (".glb", ".gltf", ".obj")
"""Files with y up: glTF by its specification, OBJ as most programs write it and as Blender reads it. Of the others
Blender takes z for up, as 3MF and what is printed from STL do."""


def mesh_scene(
    path: Path,
    on: str | None = None,
    up: str | None = None,
    *,
    mirror_self: bool = False,
    size: tuple[int, int] | None = None,
) -> Scene:
    """The scene of a mesh file; :func:`ldtrefl.load_scene` says what is what.

    Raises:
        InputError: the file cannot be read, or an option is not allowed.
    """
    with suppress(OSError):  # a missing file: its reader says so
        check_regular(path, "a mesh file")
    if up is not None and up not in typing.get_args(UpAxis):
        raise unknown_name("axis", up, typing.get_args(UpAxis))
    return composed(objects_of_file(path, typing.cast(UpAxis | None, up)), on, mirror_self=mirror_self, size=size)


def objects_of_file(path: Path, up: UpAxis | None) -> tuple[Object, ...]:
    """What a mesh file holds, upright: z up, its front to -y.

    Args:
        path: the file.
        up: its axis that points up; that of its kind if not given.
    """
    return (Object(name=path.stem, mesh=str(path), up_axis=up or usual_up_axis(path)),)


def usual_up_axis(path: Path) -> UpAxis:
    """The axis that points up in most files of this kind, by the ending of its name."""
    return "y" if path.suffix.lower() in Y_UP else "z"
