"""A square with a material of a file, and a camera that looks straight at it: what tests of looks see."""

from __future__ import annotations

import numpy as np

import ldtrefl
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.surface_material import SurfaceMaterial

CORNERS = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])
UVS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
"""v = 0 at the bottom row: the picture stands upright for who looks down with +y up."""

PIXELS = 8
WHITE = Lighting(ambient=(1, 1, 1))
DARK = Environment(sky=(0, 0, 0), ground=(0, 0, 0))


def square(material: SurfaceMaterial, uvs: np.ndarray | None = UVS, **more: np.ndarray) -> Mesh:
    """The square from -1 to 1 in x and y, facing +z."""
    return Mesh(CORNERS, FACES, None, uvs, (Part(0, material),), **more)


def places() -> tuple[np.ndarray, np.ndarray]:
    """(h, w) x and y of what each pixel of :func:`seen` sees."""
    middles = (np.arange(PIXELS) + 0.5) / PIXELS * 2.0 - 1.0
    return np.meshgrid(middles, -middles)


def seen(
    mesh: Mesh,
    material: Material | None = None,
    *,
    from_below: bool = False,
    method: str = "bvh",
    lights: tuple[Light, ...] = (),
    parts: dict[str, Material] | None = None,
    **scene: object,
) -> np.ndarray:
    """(h, w, 3) what a camera sees that looks down on the square with +y up, from far enough that rays are parallel to
    a thousandth; or up from below, with +x to the left."""
    height = -1000.0 if from_below else 1000.0
    fov = float(2.0 * np.degrees(np.arctan(1.0 / 1000.0)))
    camera = Camera(eye=(0, 0, height), look_at=(0, 0, 0), up=(0, 1, 0), width=PIXELS, height=PIXELS, fov_y=fov)
    thing = Object(mesh=mesh, material=Material() if material is None else material, parts=parts or {})
    given = {"environment": DARK, "lighting": WHITE, "lights": lights, **scene}
    return ldtrefl.render(Scene(camera=camera, objects=(thing,), **given), method).image
