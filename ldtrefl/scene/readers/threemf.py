"""3MF files (3MF core specification 1.3, materials extension 1.2) -> pieces, in millimetres.

A file is a ZIP archive of XML. A model has objects, which are meshes or made of other objects, and a list of what is to
be built, where each stands. Colours are sRGB and belong to corners of triangles, to triangles or to objects.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from xml.etree import ElementTree

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.files.srgb import linear_from_srgb
from ldtrefl.scene.joining import joining_bytes
from ldtrefl.scene.piece import Piece, moved
from ldtrefl.scene.readers.corner_tables import split_corners
from ldtrefl.scene.readers.pictures import Pictures
from ldtrefl.scene.surface_material import PLAIN, Texture, Wrap

MILLIMETRES = {
    **{"micron": 0.001, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0},
}

BYTES_PER_BYTE = 40.0
"""Bytes that a byte of unpacked XML takes; measured."""

MOST_PLACED = 100_000
"""Objects that are placed: a few that are made of each other can stand for any number."""

LONGEST_HEAD = 1 << 14
"""Bytes of a model among which the prefixes of namespaces are looked for."""

DEEPEST = 32
"""Objects made of objects made of objects."""

SHOWN = {
    *("model", "metadata", "metadatagroup", "resources", "build", "item", "object", "mesh", "vertices", "vertex"),
    *("triangles", "triangle", "components", "component", "basematerials", "base", "colorgroup", "color"),
    *("texture2d", "texture2dgroup", "tex2coord"),
}

MOST_NOTES = 20
"""Lines about what is not shown: a file may hold any number of words."""

SOLID = ("model", "solidsupport", "surface", "other")
"""Types of objects that are shown; of supports, which a printer takes away again, a line says so."""

EXTENSIONS = ("/core/2015/02", "/material/2015/02", "/production/2015/06")
"""How the namespaces end of what is read."""

PREFIX = re.compile(rb"""xmlns:([\w.-]+)\s*=\s*["']([^"'<]*)["']""")

TILES: dict[str, Wrap] = {"wrap": "repeat", "mirror": "mirror", "clamp": "clamp", "none": "clamp"}

Key = tuple[str, str]
"""A model of the archive and an id in it."""


@dataclass(eq=False)
class _Mesh:
    """A mesh as it is stored."""

    vertices: np.ndarray
    triangles: np.ndarray
    """(m, 3)."""
    groups: list[str]
    """The id of the group of properties of each triangle; '' for none."""
    properties: np.ndarray
    """(m, 3): which of that group each corner has."""


@dataclass(eq=False)
class _Package:
    """What has been read of an archive."""

    archive: zipfile.ZipFile
    meshes: dict[Key, _Mesh] = field(default_factory=dict)
    components: dict[Key, list[tuple[Key, np.ndarray]]] = field(default_factory=dict)
    colors: dict[Key, list[tuple[float, ...]]] = field(default_factory=dict)
    names: dict[Key, list[str]] = field(default_factory=dict)
    """Of base materials."""
    uvs: dict[Key, tuple[str, list[tuple[float, float]]]] = field(default_factory=dict)
    textures: dict[Key, Texture | None] = field(default_factory=dict)
    scales: dict[str, float] = field(default_factory=dict)
    items: list[tuple[Key, np.ndarray]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    visits: int = 0
    """Objects that were placed."""

    def read(self, name: str, pictures: Pictures, *, is_root: bool) -> None:
        """Read a model of the archive."""
        if name in self.scales:
            return
        text = self.file(name)
        if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
            raise InputError(f"{name}: XML with a document type is not read")
        try:
            root = ElementTree.fromstring(text)
        except ElementTree.ParseError as error:
            raise InputError(f"'{name}' in it is not XML ({error})") from error
        unit = root.get("unit", "millimeter")
        if unit not in MILLIMETRES:
            raise InputError(f"{name}: unit '{unit[:40]}', allowed are {', '.join(MILLIMETRES)}")
        self.scales[name] = MILLIMETRES[unit]
        for space in _required(root, text):
            self.note(f"the extension '{space[:80]}' that it requires")
        for entry in root.iter():
            kind, key = _tag(entry), (name, entry.get("id", ""))
            if kind == "object":
                self._object(entry, key)
            elif kind in ("basematerials", "colorgroup"):
                self.colors[key] = [_color(of.get("displaycolor") or of.get("color") or "#FFFFFF") for of in entry]
                if kind == "basematerials":
                    self.names[key] = [of.get("name", "") for of in entry]
            elif kind == "texture2dgroup":
                pairs = [(float(of.get("u", 0)), float(of.get("v", 0))) for of in entry]
                self.uvs[key] = (entry.get("texid", ""), pairs)
            elif kind == "texture2d":
                picture = pictures.get(entry.get("path", "").lstrip("/"))
                wraps = [TILES.get(entry.get(of, "wrap"), "repeat") for of in ("tilestyleu", "tilestylev")]
                self.textures[key] = None if picture is None else Texture(picture, wrap=(wraps[0], wraps[1]))
            elif kind == "item" and is_root:
                self.items.append((_reference(entry, name), _transform(entry)))
            elif kind not in SHOWN:
                self.note(f"the element '{kind}'")
        for path in {place for parts in self.components.values() for (place, _), _ in parts} | {
            place for (place, _), _ in self.items
        }:
            self.read(path, pictures, is_root=False)

    def file(self, name: str) -> bytes:
        """A file of the archive, whose memory is asked for."""
        entry = self.archive.getinfo(name.lstrip("/"))
        budget.take(BYTES_PER_BYTE * entry.file_size, f"'{name}' in it")
        return self.archive.read(entry)

    def _object(self, entry: ElementTree.Element, key: Key) -> None:
        for child in entry:
            if _tag(child) == "components":
                self.components[key] = [(_reference(of, key[0]), _transform(of)) for of in child]
            elif _tag(child) == "mesh" and entry.get("type", "model") not in SOLID:
                self.note(f"objects of the type '{entry.get('type', '')[:40]}'")
            elif _tag(child) == "mesh":
                self.meshes[key] = _mesh(child, entry.get("pid", ""), int(entry.get("pindex", 0)))

    def placed(self, key: Key, matrix: np.ndarray, depth: int = 0) -> Iterator[tuple[Key, np.ndarray]]:
        """The meshes that an object stands for, and where."""
        self.visits += 1
        if self.visits > MOST_PLACED:
            raise InputError(f"more than {MOST_PLACED} objects are placed")
        if depth > DEEPEST:
            raise InputError(f"objects are made of each other more than {DEEPEST} deep")
        if key in self.meshes:
            yield key, matrix
        for other, place in self.components.get(key, []):
            yield from self.placed(other, np.einsum("ij,jk->ik", matrix, self.scaled(place, key[0])), depth + 1)

    def pieces(self, key: Key) -> list[Piece]:
        """A mesh as pieces, one for each picture and each base material, in millimetres."""
        mesh, name = self.meshes[key], key[0]
        count = len(mesh.vertices)
        if not len(mesh.triangles):
            return []
        if int(mesh.triangles.min()) < 0 or int(mesh.triangles.max()) >= count:
            wrong = int(np.argmax((mesh.triangles < 0) | (mesh.triangles >= count)) // 3)
            raise InputError(f"object {key[1]}: triangle {wrong} has a vertex that there is not, of {count}")
        looks, numbers = self._looks(mesh, name)
        used = [k for k in range(len(looks)) if (numbers == k).any()]
        pieces = [self._piece(mesh, name, *looks[k], numbers == k) for k in used]
        return [replace(piece, continues=k > 0) for k, piece in enumerate(pieces)]

    def _looks(self, mesh: _Mesh, name: str) -> tuple[list[tuple[str, str]], np.ndarray]:
        """((the id of a picture, the name of a base material) of each look; (m,) which look each triangle has)."""
        looks: dict[tuple[str, str], int] = {}
        groups, numbers = np.array(mesh.groups), np.zeros(len(mesh.groups), np.int64)
        for group in dict.fromkeys(mesh.groups):
            texture, names = self.uvs.get((name, group), ("", []))[0], self.names.get((name, group), [])
            chosen = groups == group
            found = [looks.setdefault((texture, material), len(looks)) for material in names or [""]]
            first = np.clip(mesh.properties[chosen, 0] if names else 0, 0, len(found) - 1)
            numbers[chosen] = np.array(found)[first]
        return list(looks), numbers

    def _piece(self, mesh: _Mesh, name: str, texture: str, material: str, chosen: np.ndarray) -> Piece:
        triangles = mesh.triangles[chosen]
        rows = np.ones((len(triangles), 3, 2 if texture else 4), np.float64)
        groups = np.array(mesh.groups)[chosen]
        for group in dict.fromkeys(groups.tolist()):
            values = self.uvs[name, group][1] if texture else self.colors.get((name, group))
            if not values:
                if group and not texture:
                    self.note(f"the properties '{group}' of triangles")
                continue
            table = np.array(values, np.float64)
            numbers = mesh.properties[chosen][groups == group]
            if int(numbers.min()) < 0 or int(numbers.max()) >= len(table):
                raise InputError(f"a triangle has property {int(numbers.max())} of group {group}, of {len(table)}")
            rows[groups == group] = table[numbers]
        look = PLAIN if not texture else replace(PLAIN, name=texture, base_texture=self.textures.get((name, texture)))
        vertices = mesh.vertices * self.scales[name]
        if material:
            look = replace(look, name=material)
            if (rows == rows[0, 0]).all():
                red, green, blue, alpha = rows[0, 0].tolist()
                look, rows = replace(look, base_color=(red, green, blue)), np.ones(rows.shape)
                if alpha < 1.0:
                    self.note("alpha of its colours")
        if not texture and (rows == 1.0).all() and chosen.all():
            return Piece(vertices, triangles, None, None, look)
        corners, faces = split_corners(triangles, rows.reshape(-1, rows.shape[2]))
        values_of = rows.reshape(-1, rows.shape[2])[corners].astype(np.float32)
        taken = vertices[triangles.reshape(-1)[corners]]
        if texture:
            return Piece(taken, faces, None, values_of, look)
        if (rows == 1.0).all():
            return Piece(taken, faces, None, None, look)
        return Piece(taken, faces, None, None, look, colors=values_of)

    def scaled(self, place: np.ndarray, name: str) -> np.ndarray:
        """A place that a model gives in its unit, in millimetres."""
        result = place.copy()
        result[:3, 3] *= self.scales[name]
        return result

    def note(self, line: str) -> None:
        if line not in self.notes and len(self.notes) < MOST_NOTES:
            self.notes.append(line)


def pieces_of_3mf(data: bytes) -> tuple[list[Piece], list[str]]:
    """The pieces of a 3MF file, and what it holds that they do not show, a line each.

    Raises:
        InputError: it is damaged, or larger than is allowed.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return _pieces_of(archive)
    except InputError:
        raise
    except (zipfile.BadZipFile, NotImplementedError) as error:
        raise InputError(f"not an archive of ZIP that can be read ({error})") from error
    except (KeyError, ValueError, OverflowError) as error:
        raise InputError(f"something that is named is missing, or is no number ({error})") from error


def _pieces_of(archive: zipfile.ZipFile) -> tuple[list[Piece], list[str]]:
    package = _Package(archive)
    pictures = Pictures(package.file)
    root = _root(archive)
    package.read(root, pictures, is_root=True)
    made: dict[Key, list[Piece]] = {}
    pieces: list[Piece] = []
    for item, start in package.items:
        for key, matrix in package.placed(item, package.scaled(start, root)):
            if key not in made:
                made[key] = package.pieces(key)
            budget.take(joining_bytes(made[key]), f"object {key[1]}")
            pieces += [moved(piece, matrix) for piece in made[key]]
    return pieces, package.notes + pictures.not_shown


def _required(root: ElementTree.Element, text: bytes) -> list[str]:
    """The namespaces of the extensions that a model requires, and that are not read."""
    spaces = {
        prefix.decode(): space.decode("utf-8", "replace") for prefix, space in PREFIX.findall(text[:LONGEST_HEAD])
    }
    found = [spaces.get(prefix, prefix) for prefix in root.get("requiredextensions", "").split()]
    return [space for space in found if not space.endswith(EXTENSIONS)]


def _root(archive: zipfile.ZipFile) -> str:
    """The name of the model that the archive is about."""
    names = archive.namelist()
    found = [name for name in names if name.lower() == "3d/3dmodel.model"] or [
        name for name in names if name.lower().endswith(".model")
    ]
    if not found:
        raise InputError("not a 3MF file: it holds no model")
    return found[0]


def _mesh(entry: ElementTree.Element, group: str, index: int) -> _Mesh:
    """A mesh, with the group of properties that its object gives to triangles without one."""
    vertices: list[tuple[float, ...]] = []
    triangles: list[tuple[int, ...]] = []
    groups: list[str] = []
    properties: list[tuple[int, ...]] = []
    for part in entry:
        if _tag(part) == "vertices":
            vertices += [(float(of.get("x", "")), float(of.get("y", "")), float(of.get("z", ""))) for of in part]
        elif _tag(part) == "triangles":
            for of in part:
                triangles.append((int(of.get("v1", "")), int(of.get("v2", "")), int(of.get("v3", ""))))
                has_own = of.get("p1") is not None
                first = int(of.get("p1", index))
                groups.append(of.get("pid", group))
                properties.append(
                    (first, int(of.get("p2", first)), int(of.get("p3", first))) if has_own else (index,) * 3
                )
    return _Mesh(
        np.array(vertices, np.float64).reshape(-1, 3),
        np.array(triangles, np.int64).reshape(-1, 3),
        groups,
        np.array(properties, np.int64).reshape(-1, 3),
    )


def _tag(entry: ElementTree.Element) -> str:
    """The name of an element, without its namespace."""
    return str(entry.tag).rpartition("}")[2]


def _reference(entry: ElementTree.Element, name: str) -> Key:
    """The object that an item or a component refers to, in its own model or, by the production extension, another."""
    path = next((value for key, value in entry.attrib.items() if key.endswith("}path")), name)
    return (path.lstrip("/"), entry.get("objectid", ""))


def _transform(entry: ElementTree.Element) -> np.ndarray:
    """(4, 4): the file has the columns of the first three rows, one after another."""
    matrix = np.eye(4)
    words = entry.get("transform", "").split()
    if words:
        matrix[:3] = np.array(words, np.float64).reshape(4, 3).T
    if not np.isfinite(matrix).all():
        raise InputError("a transform is not finite")
    return matrix


def _color(text: str) -> tuple[float, ...]:
    """Linear red, green, blue, and alpha of '#RRGGBB' or '#RRGGBBAA'."""
    values = bytes.fromhex(text.strip().removeprefix("#"))
    if len(values) not in (3, 4):
        raise InputError(f"a colour should be '#RRGGBB' or '#RRGGBBAA', got '{text[:40]}'")
    red, green, blue = linear_from_srgb(np.array(list(values[:3])) / 255.0).tolist()
    return (red, green, blue, values[3] / 255.0 if len(values) == 4 else 1.0)
