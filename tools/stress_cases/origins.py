"""Case 3: rays that start on the surface, on the box, on a texel's border, inside, far away, or behind the object."""

from __future__ import annotations

import numpy as np

from ldtrefl.scene import shapes

from .judge import judge_mesh
from .outcomes import TEXELS, Limit, Outcome, limits, linear_limit

NAME = "3 origins"
TOUCHING = limits(
    Limit(wrong=60.0, p99=np.inf, why="an origin on the surface is either side of it by rounding"),
    linear=linear_limit(60.0, "a texel's error puts every other origin on the wrong side"),
)


def run(rays: int, pictures: int) -> list[Outcome]:
    """``rays`` rays of each kind."""
    mesh = shapes.make("torus_knot", {"segments": [96, 16]})
    rng = np.random.default_rng(20)
    directions = rng.normal(size=(rays, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    low, high = mesh.bounds
    corners = mesh.vertices[mesh.faces[rng.integers(0, len(mesh.faces), rays)]]
    weights = rng.dirichlet((1, 1, 1), rays)
    on_surface = (weights[:, :, None] * corners).sum(axis=1)
    in_box = rng.uniform(low, high, (rays, 3))
    on_box = in_box.copy()
    axis = rng.integers(0, 3, rays)
    on_box[np.arange(rays), axis] = np.where(rng.random(rays) < 0.5, low[axis], high[axis])
    texel = (high - low).max() / TEXELS
    on_border = (low + high) / 2 + texel * np.round((in_box - (low + high) / 2) / texel)
    outcomes = judge_mesh(NAME, "on the surface", mesh, on_surface, directions, TOUCHING)
    outcomes += judge_mesh(NAME, "on vertices", mesh, corners[:, 0], directions, TOUCHING)
    outcomes += judge_mesh(NAME, "on the box", mesh, on_box, directions)
    outcomes += judge_mesh(NAME, "on texel borders", mesh, on_border, directions)
    outcomes += judge_mesh(NAME, "inside the box", mesh, in_box, directions)
    sphere = shapes.make("sphere", {"segments": [48, 24]})
    outcomes += judge_mesh(NAME, "inside the object", sphere, 0.5 * directions[::-1], directions)
    for sizes in (1e2, 1e4, 1e7):
        towards = in_box - sizes * directions
        outcomes += judge_mesh(NAME, f"{sizes:g} sizes away", mesh, towards, in_box - towards.astype(np.float32))
    outcomes += judge_mesh(NAME, "behind everything", mesh, 3 * directions, directions, least=0.0)
    return outcomes
