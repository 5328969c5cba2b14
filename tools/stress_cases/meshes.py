"""Case 4: meshes that are degenerate, overlapping, open, inconsistent, tiny, or no meshes at all."""

from __future__ import annotations

from typing import Any

import numpy as np

import ldtrefl
from ldtrefl.scene import shapes

from .inputs import moved, rays_about
from .judge import judge_mesh
from .outcomes import DENSE, TEXELS, Limit, Outcome, limits, linear_limit

NAME = "4 meshes"
NEEDLES = limits(
    Limit(
        wrong=60.0,
        p99=np.inf,
        defects=0.1,
        place=np.inf,
        why="aimed at what is a millionth wide: hit or miss is chance, and so are barycentrics of a rounded place, and "
        "of a hundred rays moved aside none may meet it",
    ),
    linear=linear_limit(100.0, "thinner than a texel: finite answers alone"),
)
HOLES = limits(linear=linear_limit(20.0, "an edge in every texel's way"))


def joined(*meshes: ldtrefl.Mesh) -> ldtrefl.Mesh:
    """Several meshes as one."""
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    faces = [mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=False)]
    return ldtrefl.Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def run(rays: int, pictures: int) -> list[Outcome]:
    """``rays`` rays a mesh."""
    outcomes = []
    for name, mesh in made().items():
        held_to = {"dense": DENSE, "dense, a part wound inwards": DENSE, "holes": HOLES, "needles": NEEDLES}.get(name)
        origins, directions = rays_about(mesh, rays, 30)
        if name == "needles":  # nothing meets them by chance
            chosen = mesh.faces[np.random.default_rng(32).integers(0, len(mesh.faces), rays)]
            directions = (mesh.vertices[chosen].mean(axis=1) - origins).astype(np.float32)
        outcomes += judge_mesh(NAME, name, mesh, origins, directions, held_to)
    return outcomes + [patched(name, mesh) for name, mesh in made().items() if name.startswith("dense")] + refused()


def patched(name: str, mesh: ldtrefl.Mesh) -> Outcome:
    """Whether patches stand for a dense mesh's triangles: without them it tests nothing that other meshes do not."""
    trees = [ldtrefl.peel(mesh.vertices, mesh.faces, TEXELS, quality=quality).tree for quality in ("balanced", "fast")]
    outcome = Outcome(NAME, f"{name}: patches stand for triangles", "peel", tried=2, limit="in both qualities")
    outcome.passed = all(tree.patches for tree in trees)
    return outcome


def made() -> dict[str, ldtrefl.Mesh]:
    """The meshes by name."""
    rng = np.random.default_rng(31)
    sphere = shapes.make("sphere", {"segments": [48, 24]})
    knot = shapes.make("torus_knot", {"segments": [96, 16]})
    box = shapes.make("box")
    starts = rng.uniform(-1, 1, (300, 3))
    ends = rng.uniform(-1, 1, (300, 3))
    beside = ends + 1e-6 * rng.normal(size=(300, 3))
    needles = np.concatenate([starts, ends, beside])
    zero_area = np.column_stack([np.arange(300), np.arange(300), np.arange(300) + 300])
    line = np.column_stack([np.arange(300), np.arange(300) + 300, np.arange(300) + 300])
    soup = sphere.vertices[sphere.faces].reshape(-1, 3)
    mixed = knot.faces.copy()
    flip = rng.random(len(mixed)) < 0.5
    mixed[flip] = mixed[flip][:, ::-1]
    dense = shapes.make("torus_knot", {"segments": [2000, 125]})
    small = moved(shapes.make("sphere", {"segments": [600, 300]}), 0.25, (0.0, 0.0, 0.0))
    return {
        "one triangle": ldtrefl.Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.5]]), np.array([[0, 1, 2]])),
        "a flat plane": shapes.make("plane", {"segments": 7}),
        "needles": ldtrefl.Mesh(needles, np.column_stack([np.arange(300), np.arange(300) + 300, np.arange(300) + 600])),
        "zero-area and duplicate triangles": ldtrefl.Mesh(
            np.concatenate([needles[:600], sphere.vertices]),
            np.concatenate([zero_area, line, sphere.faces + 600, sphere.faces + 600]),
        ),
        "coplanar overlaps": joined(
            box, moved(box, (0.5, 1.0, 0.5)), moved(shapes.make("box", {"segments": 5}), (1.0, 0.7, 1.0))
        ),
        "200 nested shells": joined(
            *(moved(shapes.make("sphere", {"segments": [12, 6]}), 1 - k / 201) for k in range(200))
        ),
        "shells a thousandth of a texel apart": joined(sphere, moved(sphere, 1 - 1e-5)),
        "holes": ldtrefl.Mesh(knot.vertices, knot.faces[rng.random(len(knot.faces)) < 0.7]),
        "inconsistent winding": ldtrefl.Mesh(knot.vertices, mixed),
        "1e-20 sized": moved(knot, 1e-20),
        "1e20 sized": moved(knot, 1e20),
        "no shared vertices": ldtrefl.Mesh(soup, np.arange(len(soup)).reshape(-1, 3)),
        "dense": dense,
        "dense, a part wound inwards": joined(dense, ldtrefl.Mesh(small.vertices, small.faces[:, ::-1])),
    }


def refused() -> list[Outcome]:
    """What is no mesh is refused in one line that names the first fault."""
    good = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    wrong: dict[str, tuple[Any, Any, str]] = {
        "index too large": (good, [[0, 1, 2], [0, 1, 3]], "triangle 1"),
        "negative index": (good, [[0, -1, 2]], "triangle 0"),
        "NaN vertex": ([*good, [0, np.nan, 0]], [[0, 1, 2]], "vertex 3"),
        "infinite vertex": ([[np.inf, 0, 0], *good], [[0, 1, 2]], "vertex 0"),
        "no triangles": (good, np.zeros((0, 3), int), "no triangles"),
        "no vertices": (np.zeros((0, 3)), [[0, 1, 2]], "triangle 0"),
        "fractional indices": (good, [[0, 1, 1.5]], "whole"),
        "words": ("abc", [[0, 1, 2]], "vertices"),
    }
    outcomes = []
    for by, function in (("peel", ldtrefl.peel), ("bvh", ldtrefl.Raycaster)):
        for what, (vertices, faces, named) in wrong.items():
            said = "nothing"
            try:
                function(vertices, faces)
            except ldtrefl.InputError as error:
                said = str(error)
            except Exception as error:  # anything else is the fault that is looked for
                said = f"{type(error).__name__}: {error}\n"
            outcome = Outcome(NAME, f"refused: {what}", by, tried=1, limit=f"one line that names '{named}'")
            outcome.passed = named in said and "\n" not in said
            outcome.defects = int(not outcome.passed)
            outcomes.append(outcome)
    return outcomes
