"""Scenes of things that touch mirrors, and mirrors that touch: seen near the contact, at any size.

All is lit by its own glow and the sky, so that :func:`paths_of` knows every pixel.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from picture_edges import near_edge

import ldtrefl
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene

from .paths import Paths

Vector = tuple[float, float, float]
Things = list[dict[str, Any]]

BALL: dict[str, Any] = {"shape": "sphere", "params": {"segments": [64, 32]}}
RING: dict[str, Any] = {"shape": "torus", "params": {"segments": [64, 24], "minor": 0.35}}
BOWL: dict[str, Any] = {"shape": "bowl", "params": {"segments": [64, 24]}}
MIRROR = Material(albedo=(0, 0, 0), mirror=(0.9, 0.9, 0.9))

FAR_LARGER = 1e6
"""How many times larger than the things that touch the rest of a scene may be."""

ASIDE = np.array([3.3e5, -2.7e5, 0.0])
"""Where on a floor so large they stand, but for its middle."""


def glowing(red: float, green: float, blue: float) -> Material:
    """A material that radiates, and reflects nothing."""
    return Material(albedo=(0, 0, 0), emission=(red, green, blue))


ORANGE = glowing(0.9, 0.4, 0.1)


def tiles(parity: int, count: int = 12) -> ldtrefl.Mesh:
    """The white fields of a board of ``count`` fields a side, or the black ones."""
    board = shapes.make("plane", {"segments": count})
    column, row, _ = np.floor((board.vertices[board.faces].mean(axis=1) + 1) * count / 2).astype(int).T
    return ldtrefl.Mesh(board.vertices, board.faces[(column + row) % 2 == parity])


def mirror_floor() -> Things:
    """A flat mirror."""
    return [{"shape": "plane", "scale": 4.0, "material": MIRROR, "smooth": False}]


def checker_floor() -> Things:
    """A board that glows."""
    colors = glowing(0.9, 0.85, 0.7), glowing(0.15, 0.1, 0.3)
    return [{"mesh": tiles(k), "scale": 3.0, "material": colors[k], "smooth": False} for k in range(2)]


def box(material: Material) -> Things:
    """A box on the floor."""
    return [
        {"shape": "box", "scale": 0.6, "translate": (0, 0, 0.6), "rotate": (0, 0, 1, 20), "material": material}
        | {"smooth": False}
    ]


def ball(material: Material, x: float = 0.0) -> Things:
    """A ball on the floor."""
    return [BALL | {"translate": (x, 0, 1), "material": material}]


def lamp() -> Things:
    """Something to be seen in mirrors."""
    thing = {"name": "lamp", "shape": "box", "scale": 0.3, "translate": (-1.8, 0.2, 0.8), "smooth": False}
    return [thing | {"material": ORANGE}]


def bowl_with_ball() -> Things:
    """A ball at the bottom of a mirror bowl."""
    vertices = shapes.make(BOWL["shape"], BOWL["params"]).vertices
    bottom = float(vertices[np.hypot(*vertices[:, :2].T) < 1e-9, 2].max())
    return [
        BOWL | {"material": MIRROR, "translate": (0, 0, -bottom)},
        BALL | {"scale": 0.3, "translate": (0, 0, 0.3), "material": ORANGE},
    ]


TOUCHING: dict[str, tuple[Callable[[], Things], Vector]] = {
    "ball on a mirror floor": (lambda: mirror_floor() + ball(ORANGE), (0, 0, 0)),
    "box on a mirror floor": (lambda: mirror_floor() + box(ORANGE), (-0.359, -0.769, 0)),
    "mirror ball on a checker floor": (lambda: checker_floor() + ball(MIRROR), (0, 0, 0)),
    "mirror box on a checker floor": (lambda: checker_floor() + box(MIRROR), (-0.359, -0.769, 0)),
    "mirror box on a mirror floor": (lambda: mirror_floor() + lamp() + box(MIRROR), (-0.359, -0.769, 0)),
    "mirror balls side by side": (lambda: checker_floor() + ball(MIRROR, -1) + ball(MIRROR, 1), (0, 0, 1)),
    "mirror ring on a mirror floor": (
        lambda: mirror_floor() + lamp() + [RING | {"translate": (0, 0, 0.35), "material": MIRROR}],
        (0, -1, 0),
    ),
    "ball in a mirror bowl": (bowl_with_ball, (0, 0, 0.05)),
}
"""What touches what -> the things, and where they touch or nearly."""


def touching(
    what: str, pixels: int, *, size: float = 1.0, fov: float = 28.0, floor: float = 1.0, aside: np.ndarray | None = None
) -> Scene:
    """A scene of :data:`TOUCHING`.

    Args:
        what: its name.
        pixels: along a side of the picture.
        size: how large all of it is.
        fov: degrees; few of them show the contact alone.
        floor: how many times larger a mirror floor is.
        aside: (3,) how far all but a mirror floor stands from the middle, before ``size``.
    """
    made, contact = TOUCHING[what]
    offset = np.zeros(3) if aside is None else aside
    objects = []
    for thing in made():
        is_floor = thing.get("shape") == "plane"
        place = np.array(thing.get("translate", (0, 0, 0))) + (0 if is_floor else offset)
        scale = size * thing.get("scale", 1.0) * (floor if is_floor else 1.0)
        objects.append(Object(**(thing | {"scale": scale, "translate": tuple((size * place).tolist())})))
    eye, look_at = (tuple((size * (np.array(point) + offset)).tolist()) for point in ((0.4, -3.2, 1.4), contact))
    return Scene(
        camera=Camera(eye=eye, look_at=look_at, fov_y=fov, width=pixels, height=pixels),
        environment=Environment(sky=(0.5, 0.7, 1.0), ground=(0.05, 0.2, 0.05)),
        lighting=Lighting(ambient=(0, 0, 0)),
        objects=tuple(objects),
    )


def near_edges(scene: Scene, paths: Paths) -> np.ndarray:
    """(h, w) bool: pixels a pixel or less from one whose path meets other objects, or other facets of those that are
    not smooth."""
    is_flat = np.array([entry.smooth is False for entry in scene.objects] + [False])
    met = np.stack([e.object + len(is_flat) * np.where(is_flat[e.object], e.triangle, 0) for e in paths.ends], axis=-1)
    return near_edge(met)
