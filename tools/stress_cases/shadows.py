"""Case 19: shadows where geometry says, from where things touch, however large the rest of the scene is.

A box stands on a floor and light falls at 45 degrees: its shadow is a strip that begins at the box. And a dense smooth
mesh, for whose triangles patches stand, must not shade itself.
"""

from __future__ import annotations

import time

import numpy as np

import ldtrefl
from ldtrefl.scene.description import Camera, Light, Lighting, Material, Object, Scene

from .inputs import camera_rays
from .outcomes import Outcome

NAME = "19 shadows"
WHITE = Material(albedo=(1, 1, 1))
METHODS = {"exact": ("ldt", {"quality": "exact"}), "balanced": ("ldt", {}), "bvh": ("bvh", {})}
MARGIN = 1e-4
"""Of the box's size, how close to the shadow's edge pixels are looked at."""

LIT = 1e-3
"""By how much the radiance of a lit point of the floor, which is 1, may be off."""

SEEN = 0.02
"""A difference in radiance that is seen."""


def run(rays: int, pictures: int) -> list[Outcome]:
    """Pictures of ``pictures`` pixels a side."""
    scenes = {f"size {size:g}": (box_on_floor(size, pictures), size) for size in (1e-6, 1e-4, 1.0, 1e4, 1e6)}
    for distance in (1e2, 1e4, 1e6, 1e8):
        outlier = Object(shape="box", scale=0.3, translate=(-distance, 0.7 * distance, -0.3 * distance))
        scenes[f"a box {distance:g} sizes away"] = box_on_floor(1.0, pictures, outlier), 1.0
    for floor in (1e2, 1e4, 1e6):
        scenes[f"a floor of {floor:g} sizes"] = box_on_floor(1.0, pictures, floor=floor), 1.0
    outcomes = []
    for what, (scene, size) in scenes.items():
        for by, (method, options) in METHODS.items():
            start = time.perf_counter()
            image = ldtrefl.render(scene, method, **options, samples=1).image[..., 0]
            outcome = Outcome(NAME, what, by, seconds=time.perf_counter() - start)
            outcomes.append(judge_strip(outcome, image, points_on_floor(scene, size)))
    for shape, segments in (("torus_knot", (2000, 125)), ("sphere", (1000, 500)), ("torus", (1000, 400))):
        outcomes.append(judge_dense(shape, segments, pictures))
    return outcomes


def box_on_floor(size: float, pixels: int, *others: Object, floor: float = 2.0) -> Scene:
    """A box from -0.3 to 0.3 sizes that stands on a floor; light falls at 45 degrees towards +x."""

    def place(x: float, y: float, z: float) -> tuple[float, float, float]:
        return size * x, size * y, size * z

    return Scene(
        camera=Camera(eye=place(1.6, -0.9, 1.0), look_at=place(0.5, 0, 0), width=pixels, height=pixels, fov_y=35),
        lighting=Lighting(ambient=(0, 0, 0), shadows=True),
        lights=(Light(kind="directional", direction=(1, 0, -1), radiance=(np.sqrt(2.0),) * 3),),
        objects=(
            Object(shape="plane", scale=floor * size, rotate=(0, 0, 1, 10), material=WHITE),
            Object(shape="box", scale=0.3 * size, translate=place(0, 0, 0.3), material=WHITE),
            *others,
        ),
    )


def points_on_floor(scene: Scene, size: float) -> np.ndarray:
    """(h, w, 3) where each pixel's ray meets the floor, in sizes; NaN where it does not."""
    camera = scene.camera
    rays = camera_rays(camera)[1].reshape(camera.height, camera.width, 3)
    eye = np.asarray(camera.eye) / size
    return eye + np.where(rays[..., 2] < 0, -eye[2] / rays[..., 2], np.nan)[..., None] * rays


def judge_strip(outcome: Outcome, image: np.ndarray, points: np.ndarray) -> Outcome:
    """Dark on the strip 0.3 < x < 0.9, |y| < 0.3 of the floor, lit in front of the box and beyond the strip."""
    x, y = points[..., 0], points[..., 1]
    inside = (x > 0.3 + MARGIN) & (x < 0.9 - MARGIN) & (np.abs(y) < 0.3 - MARGIN)
    outside = (np.abs(x) < 1.9) & (np.abs(y) < 1.9) & ((y < -0.3 - MARGIN) | (x > 0.9 + MARGIN))
    outcome.tried = int(inside.sum() + outside.sum())
    outcome.wrong_hits, outcome.wrong_misses = int((image[outside] < 1.0 - LIT).sum()), int((image[inside] > 0).sum())
    outcome.defects = outcome.wrong_hits + outcome.wrong_misses + int((image[outside] > 1.0 + LIT).sum())
    outcome.non_finite = int((~np.isfinite(image)).sum())
    outcome.limit = "no pixel of the floor lit in the shadow, none dark beside it"
    enough = min(int(inside.sum()), int(outside.sum())) > image.size / 50 and (inside & (x < 0.32)).any()
    outcome.passed = outcome.defects == 0 and outcome.non_finite == 0 and bool(enough)
    return outcome


def judge_dense(shape: str, segments: tuple[int, int], pixels: int) -> Outcome:
    """Patches against the ray caster's shadows."""
    scene = Scene(
        camera=Camera(eye=(1, -4, 2), look_at=(0, 0, 0), width=pixels, height=pixels, fov_y=32),
        lighting=Lighting(ambient=(0, 0, 0), shadows=True),
        lights=(Light(kind="directional", direction=(0.9, 0.3, -0.3), radiance=(1, 1, 1)),),
        objects=(Object(shape=shape, params={"segments": segments}),),
    )
    truth = ldtrefl.render(scene, "bvh", samples=1).image[..., 0]
    start = time.perf_counter()
    image = ldtrefl.render(scene, "ldt", samples=1).image[..., 0]
    outcome = Outcome(NAME, f"a dense {shape} in its own shadow", "balanced", tried=image.size)
    outcome.seconds = time.perf_counter() - start
    outcome.defects = int((np.abs(image - truth) > SEEN).sum())
    outcome.non_finite = int((~np.isfinite(image)).sum())
    outcome.limit = "at most one pixel in 10,000 off by more than 0.02, or one"
    shown = min((truth > SEEN).sum(), (truth == 0.0).sum())
    outcome.passed = outcome.defects <= max(1, image.size // 10_000) and shown > image.size / 50
    return outcome
