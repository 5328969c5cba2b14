"""The key ``place = "floor"`` of a scene file: an ``[[object]]`` that stands on what is under it.

    [[object]]
    mesh = "statue.ply"
    place = "floor"

The object is moved along the scene's ``up`` until its lowest point is as high as the highest point under its box, of
the objects without the key; at height 0 if nothing is. Under it is what does not rise above the top of its box, as
``translate`` leaves it. Of what does, such as a room or a taller thing beside it, only those surfaces count that are
level and below that top: the room's floor, but neither its ceiling nor its walls.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence

import numpy as np

from ldtrefl.base.errors import InputError
from ldtrefl.scene.description import Object
from ldtrefl.scene.layout import CORNERS, Layout
from ldtrefl.scene.mesh import Mesh

FLOOR = "floor"
"""The one value of the key."""

LEVEL = 0.7
"""Cosine of the angle between up and the normal of a surface that something can stand on."""


def split_standing(tables: dict[str, object]) -> tuple[dict[str, object], frozenset[int]]:
    """A scene file's tables without the key, and the numbers of the ``[[object]]`` tables that have it.

    Raises:
        InputError: naming a key whose value is another, or beside ``places``.
    """
    entries = tables.get("object")
    if not isinstance(entries, list):  # refused with the other tables
        return tables, frozenset()
    numbers = [number for number, entry in enumerate(entries) if isinstance(entry, dict) and "place" in entry]
    rest = list(entries)
    for number in numbers:
        value = entries[number]["place"]
        if value != FLOOR:
            raise InputError(f"object[{number}].place: should be '{FLOOR}', got {value!r:.60}")
        if "places" in entries[number]:
            raise InputError(f"object[{number}]: 'place' and 'places' exclude each other")
        rest[number] = {key: value for key, value in entries[number].items() if key != "place"}
    return tables | {"object": rest}, frozenset(numbers)


def on_the_floor(objects: Sequence[Object], standing: Collection[int], up: np.ndarray) -> list[Object]:
    """The objects, with those of some numbers moved onto what is under them.

    Args:
        objects: all of a scene, with their meshes.
        standing: numbers of those that are moved; they do not stand on each other.
        up: (3,) of any length.

    Raises:
        InputError: one is moved to where no object may be.
    """
    moved = list(objects)
    if not standing:
        return moved
    axes = _axes(up)
    layout = Layout.of(objects)
    low, high = _boxes(layout, axes)
    supports = np.array([number not in standing for number in range(len(objects))])
    for number in sorted(standing):
        own = _placed(layout.meshes[layout.mesh_of[number]], layout.world_from_object[number], axes)
        box = np.array([own.min(axis=0), own.max(axis=0)])
        overlaps = (low[:, :2] <= box[1, :2]).all(axis=1) & (high[:, :2] >= box[0, :2]).all(axis=1)
        under = [
            _highest_under(layout.meshes[layout.mesh_of[other]], layout.world_from_object[other], axes, box)
            for other in np.flatnonzero(supports & overlaps & (low[:, 2] <= box[1, 2]))
        ]
        highest = max(under, default=-np.inf)
        lift = (highest if np.isfinite(highest) else 0.0) - box[0, 2]
        translate = np.add(objects[number].translate, lift * axes[2])
        moved[number] = dataclasses.replace(objects[number], translate=translate)
        moved[number].share_geometry(objects[number].geometry)
    return moved


def _axes(up: np.ndarray) -> np.ndarray:
    """(3, 3): three unit vectors at right angles, the last of them up."""
    up = np.asarray(up, float) / np.sqrt(np.vecdot(up, up))
    first = np.eye(3)[np.abs(up).argmin()]
    across = np.cross(up, first)
    across /= np.sqrt(np.vecdot(across, across))
    return np.array([np.cross(across, up), across, up])


def _boxes(layout: Layout, axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) the least and the largest coordinates along the axes of each object's box."""
    bounds = np.array([mesh.bounds for mesh in layout.meshes])
    corners = np.where(CORNERS == 0, bounds[:, :1], bounds[:, 1:])[layout.mesh_of]
    placed = np.einsum("nij,nkj->nki", layout.world_from_object[:, :3, :3], corners)
    along = np.einsum("nki,ai->nka", placed + layout.world_from_object[:, None, :3, 3], axes)
    return along.min(axis=1), along.max(axis=1)


def _placed(mesh: Mesh, world_from_object: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """(n, 3): the vertices that the mesh's triangles have, along the axes."""
    return _along(mesh.vertices[mesh.is_used], world_from_object, axes)


def _along(vertices: np.ndarray, world_from_object: np.ndarray, axes: np.ndarray) -> np.ndarray:
    placed = np.einsum("ni,ji->nj", vertices, world_from_object[:3, :3]) + world_from_object[:3, 3]
    return np.einsum("nj,aj->na", placed, axes)


def _highest_under(mesh: Mesh, world_from_object: np.ndarray, axes: np.ndarray, box: np.ndarray) -> float:
    """The highest point of a mesh inside the sides of a box, (2, 3) along the axes; of a mesh that rises above its top
    there, the highest of its level triangles that do not. -inf if there is none.

    Over a rectangle, a triangle is highest at one of its corners, at a corner of the rectangle, or where an edge of one
    crosses an edge of the other.
    """
    vertices = _along(mesh.vertices, world_from_object, axes)
    triangles = vertices[mesh.faces]
    overlaps = (triangles.min(axis=1)[:, :2] <= box[1, :2]) & (triangles.max(axis=1)[:, :2] >= box[0, :2])
    triangles = triangles[overlaps.all(axis=1)]
    if not len(triangles):
        return -np.inf
    heights = np.concatenate(
        [_corners_inside(triangles, box), _over_corners(triangles, box), _edges_across(triangles, box)], axis=1
    ).max(axis=1)
    if heights.max() > box[1, 2]:
        heights = heights[_is_level(triangles) & (heights <= box[1, 2])]
    return float(heights.max(initial=-np.inf))


def _is_level(triangles: np.ndarray) -> np.ndarray:
    """(m,) whether the triangles face up, more or less."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return normals[:, 2] > LEVEL * np.sqrt(np.einsum("ij,ij->i", normals, normals))


def _corners_inside(triangles: np.ndarray, box: np.ndarray) -> np.ndarray:
    """(m, 3) heights of the triangles' corners inside the rectangle, -inf of those outside."""
    inside = ((triangles[..., :2] >= box[0, :2]) & (triangles[..., :2] <= box[1, :2])).all(axis=2)
    return np.where(inside, triangles[..., 2], -np.inf)


def _over_corners(triangles: np.ndarray, box: np.ndarray) -> np.ndarray:
    """(m, 4) heights of the triangles at the rectangle's corners, -inf where they are not over them."""
    columns = []
    a, b, c = (triangles[:, k] for k in range(3))
    area = _cross(b - a, c - a)
    for x, y in ((0, 0), (0, 1), (1, 0), (1, 1)):
        corner = np.array([box[x, 0], box[y, 1], 0.0])
        with np.errstate(all="ignore"):  # triangles that stand on edge are over no corner
            second, third = _cross(corner - a, c - a) / area, _cross(b - a, corner - a) / area
            first = 1.0 - second - third
            height = first * a[:, 2] + second * b[:, 2] + third * c[:, 2]
            is_over = (first >= 0.0) & (second >= 0.0) & (third >= 0.0)
        columns.append(np.where(is_over, height, -np.inf))
    return np.stack(columns, axis=1)


def _edges_across(triangles: np.ndarray, box: np.ndarray) -> np.ndarray:
    """(m, 12) heights where the triangles' edges cross the rectangle's, -inf where they do not."""
    columns = []
    for k in range(3):
        begin, end = triangles[:, k], triangles[:, (k + 1) % 3]
        for axis in (0, 1):
            for side in box[:, axis]:
                with np.errstate(all="ignore"):  # an edge along this side crosses the others, or ends inside
                    share = (side - begin[:, axis]) / (end[:, axis] - begin[:, axis])
                    point = begin + share[:, None] * (end - begin)
                    crosses = (share >= 0.0) & (share <= 1.0)
                    crosses &= (point[:, 1 - axis] >= box[0, 1 - axis]) & (point[:, 1 - axis] <= box[1, 1 - axis])
                columns.append(np.where(crosses, point[:, 2], -np.inf))
    return np.stack(columns, axis=1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(m,) cross products of what (m, 3) vectors are seen from above."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
