"""Case 22: any mesh as a chrome statue, and before mirrors: the maps' pictures against the ray caster's.

Real meshes are those of LDTREFL_MESH_PATH, which are left out where they are missing. The others are open,
inconsistent, overlapping or no surface at all.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import ldtrefl
from ldtrefl.compare.bounces import errors_by_bounce
from ldtrefl.compare.metrics import ssim
from ldtrefl.scene import shapes

from . import meshes
from .inputs import moved
from .outcomes import TEXELS, Outcome
from .pictures import not_finite

NAME = "22 chrome"
LEAST_SSIM = 0.999
HELD = {
    # Where two triangles with other normals lie in one place, either may be met.
    "coplanar overlaps as a mirror": 0.9,
    "coplanar overlaps before mirrors": 0.99,
}
"""Other least values."""
CHROME = ldtrefl.Material(mirror=(0.9,) * 3)
RED, BLUE = ldtrefl.Material(albedo=(0.8, 0.25, 0.2)), ldtrefl.Material(albedo=(0.2, 0.35, 0.8))
LIGHT = ldtrefl.Light(kind="directional", direction=(-0.4, 0.5, -0.8), radiance=(2.0, 2.0, 1.9))
FEW_TRIANGLES = 10_000
"""Triangles up to which a mesh is taken where there are only some pixels."""

FEW_PIXELS = 10_000


def run(rays: int, pictures: int) -> list[Outcome]:
    """Pictures of ``pictures`` rows, each half as wide again."""
    outcomes = []
    for name, mesh in all_meshes():
        if len(mesh.faces) > FEW_TRIANGLES and pictures**2 < FEW_PIXELS:
            continue
        outcomes.append(compared(f"{name} as a mirror", statue(mesh, pictures)))
        outcomes.append(compared(f"{name} before mirrors", before_mirrors(mesh, pictures)))
    return sorted(outcomes, key=lambda outcome: outcome.ssim)


def all_meshes() -> Iterator[tuple[str, ldtrefl.Mesh]]:
    """(name, mesh) of real meshes and of those that are none."""
    yield from sheets().items()
    yield from ((name, mesh) for name, mesh in meshes.made().items() if name not in ("1e-20 sized", "1e20 sized"))
    for folder in filter(None, os.environ.get("LDTREFL_MESH_PATH", "").split(os.pathsep)):
        for path in sorted(Path(folder).glob("*")):
            if path.suffix in (".ply", ".glb"):
                yield path.name, ldtrefl.load_mesh(path)


def sheets() -> dict[str, ldtrefl.Mesh]:
    """What is open, crosses itself, or has edges of three triangles."""
    sphere = shapes.make("sphere", {"segments": [48, 24]})
    x, y, _ = shapes.make("plane", {"segments": 8}).vertices.T
    faces = shapes.make("plane", {"segments": 8}).faces
    wave = ldtrefl.Mesh(np.stack([x, y, 0.3 * np.sin(3 * x)], axis=1), faces)
    standing = ldtrefl.Mesh(wave.vertices[:, [2, 1, 0]], faces)
    half = ldtrefl.Mesh(sphere.vertices, sphere.faces[sphere.vertices[sphere.faces].mean(axis=1)[:, 2] < 0.2])
    return {
        "a wave": wave,
        "a wave, turned over": ldtrefl.Mesh(wave.vertices, faces[:, ::-1]),
        "a wave, both sides": meshes.joined(wave, ldtrefl.Mesh(wave.vertices, faces[:, ::-1])),
        "two sheets that cross": meshes.joined(wave, standing),
        "three sheets at an edge": three_at_an_edge(),
        "a half of a sphere": half,
        "spheres that overlap": meshes.joined(sphere, moved(sphere, 0.8, (0.7, 0.2, 0.3))),
    }


def three_at_an_edge() -> ldtrefl.Mesh:
    """Three leaves that share the vertices of one edge."""
    spine = np.array([[0, 0, -1], [0, 0, 1]])
    angles = np.radians([80.0, 200.0, 320.0])
    tips = np.concatenate([np.stack([[np.cos(a), np.sin(a), -1], [np.cos(a), np.sin(a), 1]]) for a in angles])
    faces = [face for k in (2, 4, 6) for face in ([0, k, k + 1], [0, k + 1, 1])]
    return ldtrefl.Mesh(np.concatenate([spine, tips]), faces)


def statue(mesh: ldtrefl.Mesh, rows: int) -> ldtrefl.Scene:
    """A mesh as a mirror on a floor, a ball and a knot before it."""
    return in_daylight(
        rows,
        ldtrefl.Object(mesh=mesh, fit=2.2, rotate=(1, 0, 0, 90), material=CHROME),
        ldtrefl.Object(shape="plane", scale=5.0, translate=(0, 0, -1.15), material=BLUE),
        ldtrefl.Object(shape="sphere", scale=0.35, translate=(1.3, -1.0, -0.8), material=RED),
        ldtrefl.Object(shape="torus_knot", params={"segments": [96, 16]}, scale=0.5, translate=(-1.5, -0.9, -0.5)),
    )


def before_mirrors(mesh: ldtrefl.Mesh, rows: int) -> ldtrefl.Scene:
    """A mesh before a mirror ball, over a mirror floor."""
    return in_daylight(
        rows,
        ldtrefl.Object(mesh=mesh, fit=1.4, rotate=(1, 0, 0, 90), translate=(1.1, -0.8, -0.2), material=RED),
        ldtrefl.Object(shape="sphere", translate=(-0.7, 0.2, 0.0), material=CHROME),
        ldtrefl.Object(shape="plane", scale=5.0, translate=(0, 0, -1.0), material=CHROME),
    )


def in_daylight(rows: int, *objects: ldtrefl.Object) -> ldtrefl.Scene:
    """Objects before a camera."""
    camera = ldtrefl.Camera(eye=(0.4, -5.0, 1.2), look_at=(0, 0, -0.1), fov_y=32.0, width=3 * rows // 2, height=rows)
    return ldtrefl.Scene(camera=camera, objects=objects, lights=(LIGHT,))


def compared(what: str, scene: ldtrefl.Scene) -> Outcome:
    """The maps' picture against the ray caster's."""
    truth, renderer = ldtrefl.render(scene, "bvh", samples=1), ldtrefl.Renderer(scene, "ldt", samples=1)
    start = time.perf_counter()
    frame = renderer.render()
    outcome = Outcome(NAME, what, "balanced", seconds=time.perf_counter() - start)
    least = HELD.get(what, LEAST_SSIM)
    outcome.limit = f"SSIM >= {least:g}, all pixels finite"
    outcome.non_finite = not_finite(frame) + not_finite(truth)
    mask = truth.reflector_mask
    if frame.hits is None or truth.hits is None:  # of a mirror thinner than a pixel no pixel may see anything
        outcome.passed = outcome.non_finite == 0 and not mask.any() and not frame.reflector_mask.any()
        return outcome
    for errors in errors_by_bounce(frame.hits, truth.hits, renderer.texel_sizes(TEXELS), mask):
        outcome.tried += errors.compared
        outcome.wrong_hits += errors.wrong_hits
        outcome.wrong_misses += errors.wrong_misses
        outcome.disagree += errors.wrong_hits + errors.wrong_misses + errors.wrong_objects
    outcome.ssim = ssim(frame.image, truth.image, mask)
    outcome.passed = outcome.non_finite == 0 and outcome.ssim >= least
    return outcome
