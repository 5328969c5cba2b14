"""Mesh files -> :class:`Mesh`: geometry, stored normals, texture coordinates and looks of their parts.

trimesh's readers read the files. What they return is walked here: each piece is placed by the nodes of the file's
scene, its normals by the inverse transpose, and a mirrored piece is wound the other way, so that it keeps its outside.
Triangles stand in the order of the file, part by part. Normals that a file stores are used; pieces without any
get smooth ones, each piece by itself: the file says that they are not one surface.

Nothing is unpacked or read before the memory that it may take is asked for (``budget.py``).
"""

from __future__ import annotations

import io
import logging
import stat
import weakref
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from trimesh.exchange.load import mesh_formats, mesh_loaders

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.base.sharing import shared_while_used
from ldtrefl.files.mesh_textures import stored_texture, take_memory_for_textures, texture_of
from ldtrefl.files.pillow_limit import no_pixel_limit
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.normals import split_by_side
from ldtrefl.scene.readers.archives import ARCHIVES, archive_kind, mesh_files
from ldtrefl.scene.readers.memory import BYTES_PER_TRIANGLE, BYTES_PER_VERTEX, reading_bytes
from ldtrefl.scene.readers.mesh_polygons import CORNER_LIST, FACES, has_polygons, in_triangles
from ldtrefl.scene.readers.polygons import triangles_of
from ldtrefl.scene.readers.reader_words import words_of_reader
from ldtrefl.scene.welding import first_of_equals

_log = logging.getLogger("ldtrefl")

UNIT = 1e-3
"""How far from 1 the length of a stored normal may be; others are made unit vectors."""


@dataclass(frozen=True, eq=False)
class _Piece:
    """A run of triangles with one look, in the file's own coordinates."""

    vertices: np.ndarray
    """(n, 3) float64."""
    faces: np.ndarray
    """(m, 3) int64."""
    normals: np.ndarray | None
    """(n, 3) float64, as stored."""
    visual: Any
    """trimesh's: ``uv`` and ``material``."""


def load_mesh(path: str | Path) -> Mesh:
    """Read any file that trimesh reads, an archive of such files too; base colours and textures come along.

    The same file is read once, and again only when it has changed.

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


@shared_while_used
def _load_mesh(path: str, _modified: int, _size: int) -> Mesh:
    if archive_kind(path) is None and Path(path).suffix.lower().lstrip(".") not in mesh_formats():
        kinds = ", ".join(sorted([*mesh_formats(), *(ending.lstrip(".") for ending in ARCHIVES)]))
        raise InputError(f"{path}: not a kind of mesh file that can be read (allowed: {kinds})")
    # What NumPy would warn of ends in a check of the mesh.
    with budget.account(), np.errstate(all="ignore"):
        try:
            pieces: list[_Piece] = []
            asked = 0.0
            for data, kind, beside in mesh_files(path):
                needed = reading_bytes(data, kind)
                budget.take(needed, f"reading it as {kind}")
                with words_of_reader() as words:
                    pieces += _pieces(data, kind, beside)
                if words and kind.startswith("stl"):
                    raise InputError(f"not a mesh that can be read ({words[0]})")
                for line in words:
                    _log.warning("%s: %s", path, " ".join(line.split()))
                asked += needed
            if not pieces:
                raise InputError("the mesh has no triangles")
            take_memory_for_textures([_material(piece) for piece in _one_of_each_material(pieces)[0]])
            # What was asked for to read the file is free again.
            budget.take(max(0.0, _joining_bytes(pieces) - asked), "its mesh")
            return _joined(pieces)
        except InputError as error:
            raise error.within(path) from None
        except Exception as error:  # whatever a damaged file provokes in a reader is the file's fault
            raise InputError(f"{path}: not a mesh that can be read ({type(error).__name__}: {error})") from error


def _pieces(data: bytes, kind: str, beside: Any) -> list[_Piece]:
    """The pieces of a mesh file, in its own order, where its nodes place them."""
    options = {"fix_texture": False} if kind == "ply" else {}
    if kind in ("obj", "off"):
        data = _as_utf8(data)
    if has_polygons(data, kind):
        data = in_triangles(data, kind)
    read = mesh_loaders[kind](file_obj=io.BytesIO(data), file_type=kind, resolver=beside, metadata=None, **options)
    if kind == "ply":
        read = _split_by_texture(read)
    if "geometry" not in read:
        geometry, nodes = {"": read}, [{"geometry": "", "frame_to": ""}]
    else:
        geometry = read["geometry"]
        nodes = read.get("graph") or [{"geometry": name, "frame_to": name} for name in geometry]
    own = {name: piece for name, entry in geometry.items() if (piece := _piece(entry)) is not None}
    placed = _placed([_node(node) for node in nodes], read.get("base_frame", "world"))
    return [_moved(own[name], matrix) for name, matrix in placed if name in own]


def _as_utf8(data: bytes) -> bytes:
    """A text file without a byte order mark; what is not UTF-8, as some comments, is taken for Latin-1."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    try:
        data.decode()
    except UnicodeDecodeError:
        return data.decode("latin-1").encode()
    return data


def _piece(entry: dict[str, Any]) -> _Piece | None:
    """A geometry as the reader gives it; None if it has no triangles."""
    faces, vertices = entry.get("faces"), entry.get("vertices")
    if faces is None or vertices is None or len(faces) == 0:
        return None
    faces = np.asarray(faces)
    if faces.ndim == 2 and faces.shape[1] == 4:
        faces = faces.reshape(-1)[triangles_of(np.asarray(vertices, float)[faces.reshape(-1)], np.full(len(faces), 4))]
    vertices = np.asarray(vertices, np.float64)
    if vertices.ndim == 2 and faces.ndim == 2 and faces.dtype.kind in "iu":
        if int(faces.min()) < 0 or int(faces.max()) >= len(vertices):
            Mesh(vertices, faces)  # says which triangle
    return _Piece(vertices, faces, _stored_normals(entry.get("vertex_normals"), vertices), entry.get("visual"))


def _stored_normals(stored: Any, vertices: np.ndarray) -> np.ndarray | None:
    """Normals as a file holds them; None if it has none of use. What is not finite becomes 0, which means undefined."""
    if stored is None or np.shape(stored) != vertices.shape:
        return None
    normals = np.array(stored, np.float64)
    normals[~np.isfinite(normals).all(axis=1)] = 0.0
    lengths = np.sqrt(np.einsum("ij,ij->i", normals, normals))
    if not lengths.any():
        return None
    is_other = (np.abs(lengths - 1.0) > UNIT) & (lengths > 0.0)
    normals[is_other] /= lengths[is_other, None]
    return normals


def _node(node: Any) -> dict[str, Any]:
    """A node of trimesh's scene graph as it calls its parts."""
    return node if isinstance(node, dict) else {"frame_to": node[1], "frame_from": node[0], **node[2]}


def _placed(nodes: list[dict[str, Any]], base: str) -> list[tuple[str, np.ndarray]]:
    """(name of a geometry, (4, 4) matrix of its place in the file's world), node by node."""
    parents = {node["frame_to"]: node for node in reversed(nodes)}
    known: dict[str, np.ndarray] = {base: np.eye(4)}

    def world(frame: str) -> np.ndarray:
        # Not by recursion: a chain of nodes may be as long as the file.
        chain = []
        while frame not in known and frame in parents:
            chain.append(parents[frame])
            known[frame] = np.eye(4)  # ends a loop of nodes
            frame = parents[frame].get("frame_from", base)
        matrix = known.get(frame, np.eye(4))
        for node in reversed(chain):
            matrix = known[node["frame_to"]] = _product(matrix, _matrix(node))
        return matrix

    return [
        (node["geometry"], _product(world(node.get("frame_from", base)), _matrix(node)))
        for node in nodes
        if node.get("geometry") is not None
    ]


def _matrix(node: dict[str, Any]) -> np.ndarray:
    matrix = node.get("matrix")
    return np.eye(4) if matrix is None else np.asarray(matrix, np.float64).reshape(4, 4)


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Not by BLAS, whose threads go on spinning."""
    return np.einsum("ij,jk->ik", a, b)


def _moved(piece: _Piece, matrix: np.ndarray) -> _Piece:
    """The piece moved by a matrix: normals by the inverse transpose, and faces turned if it mirrors."""
    if np.array_equal(matrix, np.eye(4)):
        return piece
    linear = matrix[:3, :3]
    vertices = np.einsum("ni,ki->nk", piece.vertices, linear) + matrix[:3, 3]
    # The determinant times the inverse transpose: it exists when the inverse does not.
    cofactors = np.cross(linear[[1, 2, 0]], linear[[2, 0, 1]])
    mirrors = float((linear[0] * cofactors[0]).sum()) < 0.0
    normals = piece.normals
    if normals is not None:
        normals = _stored_normals(np.einsum("ni,ki->nk", normals, -cofactors if mirrors else cofactors), vertices)
    return _Piece(vertices, piece.faces[:, ::-1] if mirrors else piece.faces, normals, piece.visual)


def _joining_bytes(pieces: list[_Piece]) -> float:
    vertices, triangles = (sum(map(len, of)) for of in ([p.vertices for p in pieces], [p.faces for p in pieces]))
    return BYTES_PER_VERTEX * vertices + BYTES_PER_TRIANGLE * triangles


def _joined(pieces: list[_Piece]) -> Mesh:
    """One mesh of all pieces, each a part. Smooth normals are made where a piece has none, piece by piece."""
    first_vertex = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    first_triangle = np.cumsum([0, *(len(piece.faces) for piece in pieces)]).tolist()
    vertices = np.concatenate([piece.vertices for piece in pieces])
    faces = np.concatenate([piece.faces for piece in pieces])
    if len(pieces) > 1:
        faces = faces + np.repeat(first_vertex[:-1], np.diff(first_triangle))[:, None]
    uvs = _joined_uvs(pieces)
    examples, numbers = _one_of_each_material(pieces)
    looks = [_look(example) for example in examples]
    parts = []
    for first, piece, number in zip(first_triangle[:-1], pieces, numbers, strict=True):
        color, texture = looks[number]
        parts.append(Part(first, color, texture if _uvs(piece) is not None else None))
    mesh = Mesh(vertices, faces, None, uvs, tuple(parts))
    return _with_normals(mesh, pieces, first_vertex, first_triangle)


def _with_normals(mesh: Mesh, pieces: list[_Piece], first_vertex: np.ndarray, first_triangle: list[int]) -> Mesh:
    """The mesh with the normals that its pieces store, and smooth ones for those that store none."""
    is_without = np.array([piece.normals is None for piece in pieces])
    stored = [np.zeros(piece.vertices.shape) if piece.normals is None else piece.normals for piece in pieces]
    normals = np.concatenate(stored).astype(np.float32)
    normals.flags.writeable = False  # and so it is not copied
    if not is_without.any():
        return mesh.with_normals(normals)
    number = np.repeat(np.arange(len(pieces)), np.diff(first_vertex))
    triangles = np.flatnonzero(np.repeat(is_without, np.diff(first_triangle)))
    every = len(triangles) == len(mesh.faces)
    sources, split, smooth = split_by_side(
        mesh.vertices, mesh.faces if every else mesh.faces[triangles], number if len(pieces) > 1 else None
    )
    is_smooth = is_without[number[sources]]
    normals = np.where(is_smooth[:, None], smooth, normals[sources])
    normals.flags.writeable = False
    if len(sources) == len(mesh.vertices):
        return mesh.with_normals(normals)
    faces = mesh.faces.copy()
    faces[triangles] = split
    return Mesh(mesh.vertices[sources], faces, normals, None if mesh.uvs is None else mesh.uvs[sources], mesh.parts)


def _split_by_texture(read: dict[str, Any]) -> dict[str, Any]:
    """What trimesh reads of a PLY file, with a vertex for each of the texture coordinates that its triangles' corners
    give it, and its normal with it."""
    table = read.get("metadata", {}).get("_ply_raw", {}).get(FACES, {}).get("data")
    names = table if isinstance(table, dict) else getattr(getattr(table, "dtype", None), "names", None) or ()
    if table is None or CORNER_LIST not in names or read.get("faces") is None:
        return read
    pairs, faces = table[CORNER_LIST], np.asarray(read["faces"])
    pairs = np.asarray(pairs["f1"] if pairs.dtype.names else pairs, np.float64)
    if pairs.shape != (len(faces), 6) or not np.isfinite(pairs).all():
        return read
    corners = np.column_stack([faces.reshape(-1), pairs.reshape(-1, 2)]).astype(np.float64)
    firsts = first_of_equals(corners)
    if firsts is None:
        firsts = np.arange(len(corners))
    chosen, numbers = np.unique(firsts, return_inverse=True)
    result = {**read, "faces": numbers.reshape(faces.shape)}
    for name in ("vertices", "vertex_normals"):
        if read.get(name) is not None:
            result[name] = np.asarray(read[name])[faces.reshape(-1)[chosen]]
    material = getattr(read.get("visual"), "material", None)
    result["visual"] = trimesh.visual.TextureVisuals(uv=corners[chosen, 1:], material=material)
    return result


def _joined_uvs(pieces: list[_Piece]) -> np.ndarray | None:
    """(n, 2) float32 of all pieces, 0 for those without; None if none has any."""
    found = [_uvs(piece) for piece in pieces]
    if all(uv is None for uv in found):
        return None
    none = [np.zeros((len(piece.vertices), 2), np.float32) for piece in pieces]
    return np.concatenate([zeros if uv is None else uv for uv, zeros in zip(found, none, strict=True)])


def _material(piece: _Piece) -> Any:
    return getattr(piece.visual, "material", None)


def _one_of_each_material(pieces: list[_Piece]) -> tuple[list[_Piece], list[int]]:
    """(a piece of each material, for each piece the number of its material): a material of many pieces is read once."""
    # By identity: trimesh compares materials by hashes of their unpacked pictures.
    examples = {id(_material(piece)): piece for piece in pieces}
    numbers = {identity: number for number, identity in enumerate(examples)}
    return list(examples.values()), [numbers[id(_material(piece))] for piece in pieces]


def _uvs(piece: _Piece) -> np.ndarray | None:
    uv = getattr(piece.visual, "uv", None)
    if uv is None or np.shape(uv) != (len(piece.vertices), 2) or not np.isfinite(uv).all():
        return None
    return np.asarray(uv, np.float32)


def _look(piece: _Piece) -> tuple[tuple[float, float, float], StoredPicture | None]:
    """A piece's base colour, linear, and its texture as it is stored (glTF: factors are linear, textures sRGB)."""
    material = _material(piece)
    if material is None:
        return (1.0, 1.0, 1.0), None
    factor = getattr(material, "baseColorFactor", None)
    color = (1.0, 1.0, 1.0)
    if factor is not None:
        scale = 255.0 if np.asarray(factor).dtype.kind in "iu" else 1.0
        r, g, b = (float(channel) / scale for channel in np.asarray(factor)[:3])
        color = (r, g, b)
    picture = texture_of(material)
    return color, None if picture is None else stored_texture(picture)
