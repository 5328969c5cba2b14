"""A mesh file as a scene: its objects, upright, on a stage of ``stages.py`` or by themselves.

Of a glTF file each node that has a mesh is an object; alone they are seen by the file's first camera and lit by its
lights, where it has any. Any other file is one object.
"""

from __future__ import annotations

import dataclasses
import typing
from contextlib import suppress
from pathlib import Path

import numpy as np

from ldtrefl.base.errors import InputError, unknown_name
from ldtrefl.files.regular_files import check_regular
from ldtrefl.scene.composed import composed
from ldtrefl.scene.decomposition import placed
from ldtrefl.scene.description import Object, Scene
from ldtrefl.scene.includes import Include, moved_as_told
from ldtrefl.scene.placement import UpAxis, placements
from ldtrefl.scene.scene_parts import SceneParts
from ldtrefl.scene.stages import makes_a_mirror

GLTF = ("glb", "gltf")

Y_UP = (*GLTF, "obj")
"""Files with y up: glTF by its specification, OBJ as most programs write it and as Blender reads it. Of the others
Blender takes z for up, as 3MF and what is printed from STL do."""

FULL_TURN = 360.0
"""Degrees."""

PACKED = (".zip", ".gz", ".tgz", ".bz2")
"""How the names of archives end, whose mesh files say what they are (``readers/archives.py``)."""

FROM_Y_UP: dict[UpAxis, tuple[float, float, float, float]] = {
    "x": (0.0, 1.0, 0.0, -90.0),
    "y": (0.0, 0.0, 1.0, 0.0),
    "z": (1.0, 0.0, 0.0, -90.0),
    "-x": (0.0, 1.0, 0.0, 90.0),
    "-y": (1.0, 0.0, 0.0, 180.0),
    "-z": (1.0, 0.0, 0.0, 90.0),
}
"""Axis and degrees of the rotation of a file that was turned to have its y up, but has another axis up."""


def mesh_scene(
    path: Path,
    on: str | None = None,
    up: str | None = None,
    *,
    turn: float = 0.0,
    mirror_self: bool = False,
    size: tuple[int, int] | None = None,
    lenient: bool = False,
) -> Scene:
    """The scene of a mesh file; :func:`ldtrefl.load_scene` says what is what.

    Raises:
        InputError: the file cannot be read, or an option is not allowed.
    """
    if not abs(turn) <= FULL_TURN:
        raise InputError(f"turn: should be degrees from -{FULL_TURN:g} to {FULL_TURN:g}, got {turn}")
    with suppress(OSError):  # a missing file: its reader says so
        check_regular(path, "a mesh file")
    as_one = (mirror_self or makes_a_mirror(on)) and not lenient
    parts = parts_of_file(path, up_axis_of(path, up), turn=turn, as_one=as_one, lenient=lenient)
    camera = parts.cameras[0] if parts.cameras else None
    return composed(parts.objects, on, lights=parts.lights, camera=camera, mirror_self=mirror_self, size=size)


def up_axis_of(path: Path, up: str | None) -> UpAxis:
    """The axis of a file that points up: ``up``, or else that of most files of its kind, by the ending of its name. In
    an archive the endings of the mesh files count.

    Raises:
        InputError: ``up`` is no axis.
    """
    if up is None:
        kinds = _kinds(path)
        return "y" if kinds and all(kind in Y_UP for kind in kinds) else "z"
    if up not in typing.get_args(UpAxis):
        raise unknown_name("axis", up, typing.get_args(UpAxis))
    return typing.cast(UpAxis, up)


def parts_of_file(
    path: Path, up: UpAxis, *, turn: float = 0.0, as_one: bool = False, lenient: bool = False
) -> SceneParts:
    """What a mesh file holds, upright: z up, its front to -y.

    Args:
        path: the file.
        up: its axis that points up.
        turn: degrees by which its objects are turned about z, counterclockwise as seen from above. Its lights and
            cameras stay.
        as_one: make one object of all that it holds, which a scene file can give one material.
        lenient: read what can be read of a glTF file that requires extensions which are not.

    Raises:
        InputError: the file cannot be read.
    """
    try:
        whole = Object(name=path.stem, mesh=str(path), up_axis=up, rotate=(0.0, 0.0, 1.0, turn))
    except InputError as error:
        raise InputError(f"{path}: a mesh file's name must be text in UTF-8") from error
    upright = include_of(path, up)
    if upright is None:
        return SceneParts((whole,), (), (), ())
    from ldtrefl.scene.gltf.to_scene import scene_parts  # noqa: PLC0415  its readers take a quarter of a second

    held = scene_parts(path, lenient=lenient)
    parts = moved_as_told(held, upright)
    objects = moved_as_told(held, _turned(upright, turn)).objects if turn else parts.objects
    return SceneParts((whole,) if as_one else objects, parts.lights, parts.cameras, parts.names)


def is_gltf(path: Path) -> bool:
    """Whether a file, or the only mesh file in an archive, is a glTF file, by the ending of its name."""
    kinds = _kinds(path)
    return len(kinds) == 1 and kinds[0] in GLTF


def _kinds(path: Path) -> list[str]:
    """The kinds of mesh files that a file has."""
    if path.suffix.lower() not in PACKED:
        return [path.suffix.lower().lstrip(".")]
    from ldtrefl.scene.readers.archives import kinds_inside  # noqa: PLC0415

    return kinds_inside(str(path))


def include_of(path: Path, up: UpAxis, turn: float = 0.0, *, lenient: bool = False) -> Include | None:
    """What a scene file says to have the objects of a file, upright and turned; None if it is no glTF file, and one
    object."""
    if not is_gltf(path):
        return None
    upright = Include(file=str(path), rotate=FROM_Y_UP[up], lights=False, lenient=lenient)
    return _turned(upright, turn) if turn else upright


def _turned(include: Include, turn: float) -> Include:
    """What is included, turned by ``turn`` degrees about z besides."""
    both = np.array([(0.0, 0.0, 1.0, turn), include.rotate])
    about_z, first = placements(np.zeros((2, 2, 3)), np.full(2, np.nan), np.ones((2, 3)), both, np.zeros((2, 3)))
    return dataclasses.replace(include, rotate=placed(np.einsum("ij,jk->ik", about_z, first))["rotate"])
