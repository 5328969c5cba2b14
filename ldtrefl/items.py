"""Which records stand for a mesh: its triangles, or patches of the maps where many triangles share a texel."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import warp as wp

from ldtrefl.cubemap import texel_frame
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.doubts import Doubts, doubts_of, no_doubts
from ldtrefl.patches import PATCH_MARGIN, Survey
from ldtrefl.tree import Tree
from ldtrefl.tree_build import Items, build_tree

Quality = Literal["fast", "balanced", "exact"]

SURVEY_CELLS = 48
"""Cells along the longest side in which patches and triangles are told apart."""
SURVEY_CELLS_PER_PATCH = 0.5
"""The same for coarser maps: cells to the side of a patch, which must be smaller than a cell."""

PATCH_TEXELS: dict[Quality, float] = {"fast": 4.0, "balanced": 1.6}
"""Texels along a side of a patch. The plane of one is off by the square of its side: on a torus knot at 256, 1.6 texels
give 0.1% wrong hits and a tenth of a texel of 128 at the 99th percentile; 1.75 a fifth more at 3% less time."""

LARGEST_TURN: dict[Quality, float] = {"fast": 0.5, "balanced": 1.6}
"""Radians between neighbouring patches from which they are in doubt, see ``doubts.py``."""
DOUBTFUL = 0.05
"""Share of patches in doubt up to which the others are worth having; a detailed scan is better kept as triangles, in a
grid as fine as they are."""

DENSE = 2.2
"""Small triangles per texel of surface from which patches stand for them: the maps are then the coarser picture."""
FEW_TRIANGLES = 50_000
"""Triangles up to which all are kept, however fine: they fit in the cache, and a thin object stays exact."""
FEWEST_TRIANGLES = 2_000
"""The same in maps that are trusted: fewer take no more room than patches."""
HORIZON = 1.0 / 3.0
"""Of a patch's side, how far past a doubted hit a search goes on."""


def tree_of(geometry: DeviceMesh, resolution: int, quality: Quality, *, trusted: bool = False) -> Tree:
    """The tree of a mesh; ``quality`` chooses between triangles and patches.

    ``exact`` keeps every triangle; the others keep them unless they are much finer than patches of ``PATCH_TEXELS`` of
    the maps' texels, and smooth on that scale: patches then stand for them. In ``trusted`` maps, whose texels are
    smaller than what can be seen, they do so for rough surfaces and for smaller meshes, too.
    """
    mesh, triangles = geometry.mesh, len(geometry.faces)
    if quality != "exact" and len(mesh.strays) == 0 and triangles > (FEWEST_TRIANGLES if trusted else FEW_TRIANGLES):
        frame = texel_frame(mesh, max(1, round(resolution / PATCH_TEXELS[quality])))
        survey = Survey(geometry, frame, max(1, min(SURVEY_CELLS, round(SURVEY_CELLS_PER_PATCH * max(frame.size)))))
        if survey.small > DENSE * survey.count * PATCH_TEXELS[quality] ** 2:
            doubts = no_doubts(survey) if trusted else doubts_of(survey, LARGEST_TURN[quality])
            if doubts.share < DOUBTFUL:
                return _of_patches(geometry, survey, doubts)
    items = _items(geometry)
    items.numbers = _listed_bulk(geometry)
    return build_tree(items, triangles - len(mesh.strays), _bulk_box(geometry), geometry)


def _items(geometry: DeviceMesh) -> Any:
    items = Items()
    items.vertices, items.faces = geometry.vertices, geometry.faces
    return items


def _bulk_box(geometry: DeviceMesh) -> np.ndarray:
    centre, half = geometry.mesh.unit_frame
    return (geometry.mesh.bulk - centre) / half


def _listed_bulk(geometry: DeviceMesh) -> wp.array:
    """The triangles that are no strays; an empty list if there are none."""
    strays = geometry.mesh.strays
    bulk = np.delete(np.arange(len(geometry.faces), dtype=np.int32), strays) if len(strays) else np.zeros(0, np.int32)
    return wp.array(bulk, dtype=wp.int32, device=geometry.vertices.device)


def _of_patches(geometry: DeviceMesh, survey: Survey, doubts: Doubts) -> Tree:
    """Patches, and the triangles that none stands for."""
    patches, touched = doubts.sure_patches()
    frame = survey.frame
    items = _items(geometry)
    items.numbers = _joined(patches, survey.kept_triangles(touched, doubts.near))
    items.patches = doubts.patches
    items.unit_per_cell = 1.0 / (survey.cells_per_texel * frame.scale)
    items.unit_offset = wp.vec3(*(-np.array(frame.offset) / frame.scale))
    tree = build_tree(items, items.numbers.shape[0], _bulk_box(geometry), geometry)
    view = tree.view
    view.front, view.horizon = float(survey.front), HORIZON / frame.scale
    view.half_patch = (0.5 + PATCH_MARGIN) / frame.scale
    return tree


def _joined(a: wp.array, b: wp.array) -> wp.array:
    if b.shape[0] == 0:
        return a
    both = wp.empty(a.shape[0] + b.shape[0], dtype=a.dtype, device=a.device)
    wp.copy(both, a)
    wp.copy(both, b, dest_offset=a.shape[0])
    return both
