"""Mesh files of any kind -> :class:`Mesh`, with normals, texture coordinates, colours, materials and textures.

    a file, or those in an archive -> the reader of its kind -> pieces -> one mesh

What a file says and its mesh does not show is named, in a line each.

Nothing is unpacked or read before the memory that it may take is asked for (``memory.py``).
"""

from __future__ import annotations

import logging
import stat
import weakref
from pathlib import Path

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError, printable
from ldtrefl.base.sharing import shared_while_current
from ldtrefl.files.pillow_limit import no_pixel_limit
from ldtrefl.scene.gltf.asset import Asset
from ldtrefl.scene.gltf.pieces import placed_pieces
from ldtrefl.scene.joining import joined_mesh, joining_bytes
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.piece import Piece
from ldtrefl.scene.readers.archives import ARCHIVES, archive_kind, is_mesh_kind, mesh_files, mesh_kinds
from ldtrefl.scene.readers.files_beside import FilesBeside, NamedFiles
from ldtrefl.scene.readers.memory import reading_bytes
from ldtrefl.scene.readers.obj import pieces_of_obj
from ldtrefl.scene.readers.off import pieces_of_off
from ldtrefl.scene.readers.ply import pieces_of_ply
from ldtrefl.scene.readers.stl import pieces_of_stl
from ldtrefl.scene.readers.threemf import pieces_of_3mf
from ldtrefl.scene.readers.trimesh_warnings import trimesh_warnings

_log = logging.getLogger("ldtrefl")

GLTF = ("glb", "gltf")
"""Kinds that our own reader reads."""

ALONE = {"off": pieces_of_off, "3mf": pieces_of_3mf, "stl": pieces_of_stl, "stl_ascii": pieces_of_stl}
"""Readers of kinds that name no other files."""


def load_mesh(path: str | Path) -> Mesh:
    """Read a mesh file of any kind, an archive of such files too; materials and textures come along.

    The same file is read once, and again only when it or a file beside it that it names has changed.

    Raises:
        InputError: the file is missing, unreadable, too large, or holds no sound mesh; the message names it.
    """
    path = Path(path)
    try:
        status = path.stat()
    except OSError as error:
        raise InputError(f"{path}: no such mesh ({error.strerror})") from error
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{path}: not a file")
    with no_pixel_limit(), budget.account() as account:
        before = account.taken
        mesh = _load_mesh(str(path.resolve()), status.st_mtime_ns, status.st_size)
        taken = account.taken - before
        if taken == 0 and mesh in _needed:
            # It is in use already, and part of another scene then.
            budget.take(_needed[mesh], f"the mesh {path}")
        elif taken:
            _needed[mesh] = taken
    return mesh


_needed: weakref.WeakKeyDictionary[Mesh, int] = weakref.WeakKeyDictionary()
"""Bytes that were taken for the meshes in use."""


_beside: weakref.WeakKeyDictionary[Mesh, list[FilesBeside]] = weakref.WeakKeyDictionary()
"""The files beside their own that were read for the meshes in use."""


def _is_current(mesh: Mesh) -> bool:
    """Whether the files beside its own are as they were when the mesh was read."""
    return all(files.are_as_read() for files in _beside[mesh])


@shared_while_current(_is_current)
def _load_mesh(path: str, _modified: int, _size: int) -> Mesh:
    """The mesh of a file as it stands: the time of its last change and its size tell whether it is the same."""
    if archive_kind(path) is None and not is_mesh_kind(Path(path).suffix.lower().lstrip(".")):
        kinds = ", ".join(sorted([*mesh_kinds(), *(ending.lstrip(".") for ending in ARCHIVES)]))
        raise InputError(f"{path}: not a kind of mesh file that can be read (allowed: {kinds})")
    # What NumPy would warn of ends in a check of the mesh.
    with budget.account(), np.errstate(all="ignore"):
        try:
            pieces, files = _read_pieces(path)
            budget.take(joining_bytes(pieces), "its mesh")
            mesh = joined_mesh(pieces)
            _beside[mesh] = files
            return mesh
        except InputError as error:
            raise error.within(path) from None
        except Exception as error:  # whatever a damaged file provokes in a reader is the file's fault
            raise InputError(f"{path}: not a mesh that can be read ({type(error).__name__}: {error})") from error


def _read_pieces(path: str) -> tuple[list[Piece], list[FilesBeside]]:
    """(the pieces of all mesh files in a file, what read the files beside it)."""
    pieces: list[Piece] = []
    files: list[FilesBeside] = []
    for data, kind, beside in mesh_files(path):
        if isinstance(beside, FilesBeside):
            files.append(beside)
        found, not_shown = _read(data, kind, beside)
        pieces += found
        for line in dict.fromkeys(not_shown):
            _log.warning("%s: not shown: %s", path, printable(line))
    if not pieces:
        raise InputError("the mesh has no triangles")
    return pieces, files


def _read(data: bytes, kind: str, beside: NamedFiles) -> tuple[list[Piece], list[str]]:
    """(the pieces of a mesh file of some kind, what it holds that they do not show)."""
    if kind in GLTF:
        asset = Asset.read(data, beside.get)
        return placed_pieces(asset), asset.not_shown()
    if kind in ALONE:
        pieces, not_shown = ALONE[kind](data)
    else:
        reader = {"obj": pieces_of_obj, "ply": pieces_of_ply}.get(kind)
        pieces, not_shown = reader(data, beside.get) if reader else _read_by_trimesh(data, kind, beside)
    return pieces, not_shown + (["alpha of its colours"] if any(map(_hides_alpha, pieces)) else [])


def _hides_alpha(piece: Piece) -> bool:
    """Whether vertices have an alpha that counts for nothing. Many programs write some, and few mean it."""
    is_opaque = piece.material.alpha_mode == "opaque"
    return piece.colors is not None and is_opaque and bool((piece.colors[:, 3] < 1.0).any())


def _read_by_trimesh(data: bytes, kind: str, beside: NamedFiles) -> tuple[list[Piece], list[str]]:
    """The same of kinds without a reader of our own."""
    from ldtrefl.scene.readers.trimesh_pieces import pieces_by_trimesh  # noqa: PLC0415  trimesh takes half a second

    with budget.given_back():
        budget.take(reading_bytes(data, kind), f"reading it as {kind}")
    with trimesh_warnings() as warnings:
        pieces = pieces_by_trimesh(data, kind, beside)
    return pieces, [" ".join(line.split()) for line in warnings]
