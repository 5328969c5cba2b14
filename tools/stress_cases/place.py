"""Case 1: objects of size 1e-6 to 1e6, far from the origin, stretched, seen from far away."""

from __future__ import annotations

import numpy as np

import ldtrefl
from ldtrefl.scene import shapes

from .inputs import moved, rays_about
from .judge import judge_mesh
from .outcomes import Limit, Outcome, limits, linear_limit
from .pictures import judge_same_pictures

SAME_PICTURE = 0.1
"""Percent of the pixels, silhouettes, that may differ by more than 2% when the whole scene is scaled and moved."""


def run(rays: int, pictures: int) -> list[Outcome]:
    """``rays`` rays a mesh, pictures of ``pictures`` pixels a side."""
    mesh = shapes.make("torus_knot", {"segments": [96, 16]})
    outcomes = []
    for scale in (1e-6, 1.0, 1e6):
        for sizes_off in (0.0, 1e3):
            placed = moved(mesh, scale, scale * sizes_off)
            # Rays are float32: at a thousand sizes from the origin they start on a lattice of 1e-4 sizes, and so does
            # the truth's ray.
            outcomes += judge_mesh(
                "1 scale and place", f"size {scale:g}, {sizes_off:g} sizes off", placed, *rays_about(placed, rays, 1)
            )
    stretched = moved(mesh, (1.0, 1e-3, 1.0))
    flat = limits(
        Limit(radius=0.1, p999=0.1, why="a thousandth as high as wide: grazing rays all around"),
        linear=linear_limit(50.0, "a quarter of a texel thick"),
    )
    outcomes += judge_mesh("1 scale and place", "stretched 1:1000", stretched, *rays_about(stretched, rays, 2), flat)
    needle = moved(mesh, (1e-3, 1e-3, 1.0))
    outcomes += judge_mesh("1 scale and place", "needle 1000:1", needle, *rays_about(needle, rays, 3), flat)

    base = scene_at(1.0, 0.0, pictures)
    for scale, sizes_off in ((1e-6, 0.0), (1e6, 0.0), (1.0, 1e6), (1e-6, 1e6), (1e6, 1e6)):
        what = f"scene times {scale:g}, {sizes_off:g} sizes off"
        outcomes += judge_same_pictures(
            "1 scale and place", what, base, scene_at(scale, sizes_off, pictures), SAME_PICTURE
        )
    far = scene_at(1.0, 0.0, pictures, distance=1e5)
    outcomes += judge_same_pictures(
        "1 scale and place",
        "camera 1e5 sizes away, twice",
        far,
        scene_at(1e3, 0.0, pictures, distance=1e5),
        SAME_PICTURE,
    )
    return outcomes


def scene_at(scale: float, sizes_off: float, pixels: int, distance: float = 4.0) -> ldtrefl.Scene:
    """A mirror ball and a knot, scaled and moved as a whole."""
    offset = scale * sizes_off

    def place(x: float, y: float, z: float) -> tuple[float, float, float]:
        return scale * x + offset, scale * y + offset, scale * z + offset

    eye = np.array([-0.3, -1.0, 0.3]) / np.linalg.norm([-0.3, -1.0, 0.3]) * distance
    fov = float(np.degrees(2 * np.arctan(1.5 / distance)))
    return ldtrefl.Scene(
        camera=ldtrefl.Camera(eye=place(*eye), look_at=place(0.3, 0.0, 0.0), fov_y=fov, width=pixels, height=pixels),
        lights=(ldtrefl.Light(kind="directional", direction=(0.3, 0.8, -0.7), radiance=(1.0, 1.0, 1.0)),),
        objects=(
            ldtrefl.Object(
                shape="sphere", scale=scale, translate=place(0, 0, 0), material=ldtrefl.Material(mirror=(0.9,) * 3)
            ),
            ldtrefl.Object(shape="torus_knot", scale=0.6 * scale, translate=place(1.4, -1.0, 0.1)),
        ),
    )
