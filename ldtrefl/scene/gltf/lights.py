"""Lights (KHR_lights_punctual) and cameras (glTF 2.0, 3.10) of a scene, in its coordinates."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.container import Document
from ldtrefl.scene.gltf.nodes import Node


@dataclass(frozen=True, eq=False)
class LightNode:
    """A light, in its place."""

    name: str
    kind: str
    """"directional", "point" or "spot"."""
    color: tuple[float, float, float]
    """Linear, times the intensity: lux of a directional light, candela of the others."""
    position: np.ndarray
    """(3,) float64."""
    direction: np.ndarray
    """(3,) float64, unit: the way that a directional or a spot light shines."""
    range: float
    """Beyond it a point or spot light does not shine; infinite if none is given."""
    cone: tuple[float, float]
    """Radians from the axis of a spot light to where it begins to fall off, and to where it ends."""


@dataclass(frozen=True, eq=False)
class CameraNode:
    """A camera, in its place."""

    name: str
    is_perspective: bool
    fov_y: float
    """Degrees, of a perspective camera."""
    half_height: float
    """Of what an orthographic camera sees."""
    aspect: float | None
    """Width over height, if the file says it."""
    position: np.ndarray
    """(3,) float64."""
    forward: np.ndarray
    """(3,) float64, unit."""
    up: np.ndarray
    """(3,) float64, unit."""


def light_of(document: Document, node: Node) -> LightNode | None:
    """The light of a node; None if it has none."""
    where = f"nodes[{node.number}]"
    table = document.extension(node.entry, "KHR_lights_punctual", where)
    if table is None:
        return None
    place = "extensions.KHR_lights_punctual"
    listed = document.table(
        document.table(document.root.get("extensions"), "extensions").get("KHR_lights_punctual"), place
    )
    lights = document.entries("lights", of=listed, place=place)
    number = table.get("light")
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < len(lights):
        raise InputError(f"{where}.{place}.light: there is no light {number!r:.40} (the file has {len(lights)})")
    entry, at = lights[number], f"{place}.lights[{number}]"
    kind = entry.get("type")
    if kind not in ("directional", "point", "spot"):
        raise InputError(f"{at}.type: allowed are directional, point, spot, got {kind!r:.40}")
    red, green, blue = document.numbers(entry, "color", at, (1.0, 1.0, 1.0))
    intensity = document.number(entry, "intensity", at, 1.0)
    reach = math.inf if entry.get("range") is None else document.number(entry, "range", at, 0.0)
    spot = document.table(entry.get("spot"), f"{at}.spot")
    inner = document.number(spot, "innerConeAngle", f"{at}.spot", 0.0)
    outer = document.number(spot, "outerConeAngle", f"{at}.spot", math.pi / 4.0)
    return LightNode(
        node.name or document.name(entry),
        kind,
        (max(red * intensity, 0.0), max(green * intensity, 0.0), max(blue * intensity, 0.0)),
        node.matrix[:3, 3].copy(),
        _unit(-node.matrix[:3, 2], (0.0, 0.0, -1.0)),
        reach,
        (inner, outer),
    )


def camera_of(document: Document, node: Node) -> CameraNode | None:
    """The camera of a node; None if it has none."""
    number = node.entry.get("camera")
    if number is None:
        return None
    entry, where = document.entry("cameras", number, f"nodes[{node.number}].camera"), f"cameras[{number}]"
    kind = entry.get("type")
    if kind not in ("perspective", "orthographic"):
        raise InputError(f"{where}.type: allowed are perspective, orthographic, got {kind!r:.40}")
    lens = document.table(entry.get(kind), f"{where}.{kind}")
    aspect: float | None = None
    fov_y, half_height = 45.0, 1.0
    if kind == "perspective":
        fov_y = math.degrees(document.number(lens, "yfov", f"{where}.{kind}", math.radians(45.0)))
        if lens.get("aspectRatio") is not None:
            aspect = document.number(lens, "aspectRatio", f"{where}.{kind}", 1.0)
    else:
        half_height = document.number(lens, "ymag", f"{where}.{kind}", 1.0)
        half_width = document.number(lens, "xmag", f"{where}.{kind}", 1.0)
        aspect = abs(half_width / half_height) if half_height and half_width else None
    if aspect is not None and not aspect > 0.0:
        aspect = None
    matrix = node.matrix
    return CameraNode(
        node.name or document.name(entry),
        kind == "perspective",
        fov_y,
        abs(half_height),
        aspect,
        matrix[:3, 3].copy(),
        _unit(-matrix[:3, 2], (0.0, 0.0, -1.0)),
        _unit(matrix[:3, 1], (0.0, 1.0, 0.0)),
    )


def _unit(vector: np.ndarray, otherwise: tuple[float, float, float]) -> np.ndarray:
    length = float(np.sqrt((vector * vector).sum()))
    return vector / length if length > 0.0 else np.array(otherwise)
