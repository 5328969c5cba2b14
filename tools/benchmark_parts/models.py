"""The meshes that rays are traced against, by name.

``knot 96 k`` is a torus knot of that many triangles; ``lucy.ply`` a file of LDTREFL_MESH_PATH; ``city`` and ``city
nested`` ten thousand boxes of sizes over six decades. Words behind a name change it: ``loop 2`` refines by two of
Loop's steps, ``rough`` then moves vertices by a third of an edge, ``outlier 1e3`` adds one triangle a thousand sizes
away, ``stray 1e3`` one that reaches from the mesh to there.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

import ldtrefl
from ldtrefl.scene import shapes

KNOTS = {
    "knot 1 k": (64, 8),
    "knot 10 k": (200, 25),
    "knot 96 k": (600, 80),
    "knot 500 k": (2000, 125),
    "knot 2 M": (5000, 200),
    "knot 10 M": (8192, 610),
}

REAL = (
    "happy_buddha.ply",
    "lucy.ply",
    "bunny_open.ply",
    "armadillo.ply",
    "cycloidal_drive.ply",
    "sheen_chair.glb",
    "boot.ply",
    "dish_with_olives.glb",
    "teapot.ply",
    "mosquito_in_amber.ply",
    "spot.glb",
)

REFINED = ("armadillo.ply loop 2", "armadillo.ply loop 3", "lucy.ply loop 2", "lucy.ply loop 2 rough")
"""Stand-ins for dense scans. The last is the one that the older tables call ``lucy.ply, finer``."""

OUTLIERS = (*(f"knot 96 k outlier 1e{power}" for power in range(1, 7)), "knot 96 k stray 1e3")

CITIES = ("city", "city nested")
BOXES = 10_000

OUTLIER_ANGLE = 0.1
"""Radians that the outlying triangle takes, seen from the mesh."""

LEVELS = re.compile(r"(?P<base>.+) loop (?P<steps>[1-4])(?P<rough> rough)?")
OUTLIER = re.compile(r"(?P<base>.+) (?P<kind>outlier|stray) (?P<sizes>1e[0-9])")


@dataclass(frozen=True)
class Model:
    """A mesh whose longest side is 2, about the origin; an outlier is not counted."""

    name: str
    vertices: np.ndarray
    """(n, 3) float32."""
    faces: np.ndarray
    """(m, 3) int32."""
    box: np.ndarray
    """(2, 3) float64: its lowest and highest corner, without the outlier."""


def every_name() -> list[str]:
    """All meshes of the full run, small ones first among the knots."""
    return [*KNOTS, *REAL, *REFINED, *OUTLIERS, *CITIES]


def model(name: str) -> Model | None:
    """The mesh of this name in its unit cube; None where its file is missing."""
    if found := OUTLIER.fullmatch(name):
        base = model(found["base"])
        return None if base is None else _with_outlier(name, base, float(found["sizes"]), found["kind"])
    mesh = load(name)
    if mesh is None:
        return None
    used = mesh.vertices[mesh.faces.ravel()]
    low, high = used.min(axis=0), used.max(axis=0)
    half = float((high - low).max()) / 2.0
    vertices = ((mesh.vertices - (low + high) / 2.0) / half).astype(np.float32)
    return Model(name, vertices, np.ascontiguousarray(mesh.faces), np.stack([low - high, high - low]) / (2.0 * half))


def load(name: str) -> ldtrefl.Mesh | None:
    """A knot, a shape, a city, or a real mesh, refined or not; None where its file is missing."""
    if name in KNOTS:
        return shapes.make("torus_knot", {"segments": list(KNOTS[name])})
    if name in shapes.names():
        return shapes.make(name)
    if name in CITIES:
        return city(BOXES, nested=name.endswith("nested"))
    if found := LEVELS.fullmatch(name):
        coarse = load(found["base"])
        return None if coarse is None else _refined(coarse, int(found["steps"]), rough=bool(found["rough"]))
    for folder in filter(None, os.environ.get("LDTREFL_MESH_PATH", "").split(os.pathsep)):
        if (Path(folder) / name).is_file():
            return ldtrefl.load_mesh(Path(folder) / name)
    return None


def _refined(mesh: ldtrefl.Mesh, steps: int, *, rough: bool) -> ldtrefl.Mesh:
    fine = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    fine.merge_vertices(merge_tex=True, merge_norm=True)
    fine = fine.subdivide_loop(iterations=steps)
    vertices = np.asarray(fine.vertices)
    if rough:
        edge = float(fine.edges_unique_length.mean())
        vertices = vertices + 0.3 * edge * np.random.default_rng(0).normal(size=vertices.shape)
    return ldtrefl.Mesh(vertices, fine.faces)


def _with_outlier(name: str, base: Model, sizes: float, kind: str) -> Model:
    """The mesh and one triangle: ``sizes`` of its longest sides away and facing it, or with one corner there."""
    far = 2.0 * sizes * np.array([1.0, 0.6, 0.3]) / np.linalg.norm([1.0, 0.6, 0.3])
    across = OUTLIER_ANGLE * np.cross(far, [0.0, 0.0, 1.0])
    n = len(base.vertices)
    corners = far + np.stack([0.0 * far, across, [0.0, 0.0, OUTLIER_ANGLE * 2.0 * sizes]])
    faces = {"outlier": [n, n + 1, n + 2], "stray": [*base.faces[0, :2], n]}[kind]
    return Model(
        name,
        np.vstack([base.vertices, corners]).astype(np.float32),
        np.vstack([base.faces, [faces]]).astype(np.int32),
        base.box,
    )


def city(count: int, *, nested: bool) -> ldtrefl.Mesh:
    """Boxes of sizes over six decades: anywhere, or nested, each some of its own sizes from the origin, so that there
    is as much to see at every scale."""
    rng = np.random.default_rng(0)
    half = 10.0 ** rng.uniform(-6, 0, count)
    if nested:
        # In pairs across the origin, which stays in the middle: float32 is finest there.
        half[1::2] = half[::2]
        middle = half[:, None] * rng.uniform(2.0, 10.0, (count, 3)) * rng.choice([-1.0, 1.0], (count, 3))
        middle[1::2] = -middle[::2]
    else:
        middle = rng.uniform(-2.0, 2.0, (count, 3))
    box = shapes.make("box")
    vertices = (box.vertices * half[:, None, None] + middle[:, None]).reshape(-1, 3)
    faces = (box.faces + len(box.vertices) * np.arange(count)[:, None, None]).reshape(-1, 3)
    return ldtrefl.Mesh(vertices, faces)
