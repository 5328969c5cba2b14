"""The meshes, scenes and rays that the benchmark's parts share."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
import warp as wp

import ldtrefl
from ldtrefl import launch, shapes, skips
from ldtrefl.scene import Camera, Light, Material, Object, Scene
from ldtrefl.trace import Tracer, array_of_views, batch_kernel

KNOTS = {
    "knot 1 k": (64, 8),
    "knot 10 k": (200, 25),
    "knot 96 k": (600, 80),
    "knot 500 k": (2000, 125),
    "knot 2 M": (5000, 200),
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

SCAN = "lucy.ply, finer"
"""A stand-in for a dense scan: lucy with every triangle in sixteen on Loop's limit surface, roughened by a third of an
edge."""

ROOT = Path(__file__).parent.parent.parent

SKIPS_BUT_FRAMES = [name for name in skips.names() if name != "frames"]
"""So that every frame is made anew."""


def mirror_rays(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) float32 origins and directions in the unit space of an object beside a mirror ball."""
    eye, scale, place = np.array([0, -4.0, 0.6]), 1.3, np.array([0.6, -1.9, 0.5])
    forward = -eye / np.linalg.norm(eye)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    half = np.tan(np.radians(20.0))
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, (np.arange(height) + 0.5) / height * 2 - 1)
    rays = forward + (x * half * width / height)[..., None] * right + (y * half)[..., None] * down
    rays = (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).reshape(-1, 3)
    b = rays @ eye
    square = b * b - eye @ eye + 1.0
    rays, b, square = rays[square > 0], b[square > 0], square[square > 0]
    points = eye + (-b - np.sqrt(square))[:, None] * rays
    directions = rays - 2 * (rays * points).sum(axis=1, keepdims=True) * points
    return ((points - place) / scale).astype(np.float32), directions.astype(np.float32)


class Batch:
    """A tracer's kernel over fixed rays, its outputs allocated once."""

    def __init__(self, tracer: Tracer, view: Any, origins: wp.array, directions: wp.array) -> None:
        n, device = origins.shape[0], origins.device
        self.t, self.triangle = wp.empty(n, dtype=float, device=device), wp.empty(n, dtype=int, device=device)
        outputs = [self.t, wp.empty(n, dtype=wp.vec3, device=device), self.triangle]
        outputs += [wp.empty(n, dtype=wp.vec2, device=device), wp.zeros(n, dtype=wp.uint8, device=device)]
        self._view = view  # owns the arrays that the kernel's copy points to
        views = array_of_views([view], tracer.view, device)
        self._arguments = [views, wp.vec3d(0.0, 0.0, 0.0), wp.float64(1.0), origins, directions, *outputs]
        self._kernel, self._count, self._device = batch_kernel(tracer), n, device

    def __call__(self) -> None:
        launch.launch(self._kernel, self._count, self._arguments, self._device)


def load(name: str) -> ldtrefl.Mesh | None:
    """A knot, a shape, or a real mesh; None where it is missing."""
    if name in KNOTS:
        return shapes.make("torus_knot", {"segments": list(KNOTS[name])})
    if name in shapes.names():
        return shapes.make(name)
    if name == SCAN:
        coarse = load("lucy.ply")
        return None if coarse is None else _finer(coarse)
    for folder in filter(None, os.environ.get("LDTREFL_MESH_PATH", "").split(os.pathsep)):
        if (Path(folder) / name).is_file():
            return ldtrefl.load_mesh(Path(folder) / name)
    return None


def _finer(mesh: ldtrefl.Mesh) -> ldtrefl.Mesh:
    fine = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    fine.merge_vertices(merge_tex=True, merge_norm=True)
    fine = fine.subdivide_loop(iterations=2)
    edge = float(fine.edges_unique_length.mean())
    return ldtrefl.Mesh(
        fine.vertices + 0.3 * edge * np.random.default_rng(0).normal(size=fine.vertices.shape), fine.faces
    )


def knot_scene(segments: tuple[int, int], width: int, height: int) -> Scene:
    """A mirror ball and a torus knot."""
    knot = Object(
        name="knot",
        shape="torus_knot",
        params={"segments": list(segments)},
        rotate=(1, 0.3, 0, 50),
        scale=0.75,
        translate=(1.2, -1.1, 0.1),
    )
    return Scene(
        camera=Camera(eye=(-0.5, -4.5, 0.8), look_at=(0.4, 0, 0.0), fov_y=36, width=width, height=height),
        lights=(Light(kind="directional", direction=(0.3, 0.8, -0.7), radiance=(1.0, 1.0, 1.0)),),
        objects=(
            Object(name="ball", shape="sphere", material=Material(albedo=(0.02,) * 3, mirror=(0.9,) * 3)),
            knot,
        ),
    )
