"""Footprints against closed forms: a flat mirror, a convex one, and what the camera itself sees."""

import dataclasses

import numpy as np
import pytest

from ldtrefl.device.stats import Stats
from ldtrefl.frame.footprint import RayArrays, finest_footprints, footprint, pixel_spacing
from ldtrefl.frame.regions import all_objects, safe_regions
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.tracing.object_sets import run_count
from tests.frame import flat_mirror

EYE, PLACE, FOV, SIDE = 4.0, 6.0, 2.0, 64
"""Heights of the camera, which looks down, and of the thing that its rays come to; degrees and pixels of the image. At
so small an angle a pixel's rays are its angle apart to within a part in a thousand."""

PIXEL = 2 * np.tan(np.radians(FOV) / 2) / SIDE
"""Angle between neighbouring pixels, radians."""


def above(mirror: str, **params: object) -> Scene:
    """A camera that looks straight down on a mirror whose top is at height 0, and a ball above both."""
    place = (0, 0, -1) if mirror == "sphere" else (0, 0, 0)
    shiny = Object(shape=mirror, translate=place, material=Material(mirror=1.0), **params)
    ball = Object(shape="sphere", scale=0.15, translate=(0, 0, PLACE))
    camera = Camera(eye=(0, 0, EYE), look_at=(0, 0, 0), up=(0, 1, 0), width=SIDE, height=SIDE, fov_y=FOV)
    return Scene(camera=camera, objects=(shiny, ball))


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        # Rays in a flat mirror go on as if from the mirrored eye.
        (above("plane"), (EYE + PLACE) * PIXEL),
        # On a ball of radius 1 they are EYE * PIXEL apart and turn by the pixel's angle and twice the normal's.
        (above("sphere", params={"segments": [1024, 512]}), (EYE + PLACE * (1 + 2 * EYE)) * PIXEL),
    ],
    ids=["flat", "convex"],
)
def test_neighbouring_rays_are_as_far_apart_as_geometry_says(given: Scene, expected: float) -> None:
    scene = flat_mirror.on_device(given, needs_footprints=True)
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    ball, runs = scene.objects[1], np.arange(run_count(shaded.rays.pixel.shape[0]))
    found = footprint(RayArrays.of(shaded.rays), 1.0, runs, ball)
    assert found is not None
    assert found / scene.device_units_per_world_unit == pytest.approx(expected, rel=0.01)
    regions = safe_regions(gbuffer, shaded.rays, 0, Stats())
    assert finest_footprints(gbuffer, shaded.rays, regions, is_seen=False) == {1: pytest.approx(found, rel=1e-12)}


def test_pixels_on_what_the_camera_sees() -> None:
    scene = flat_mirror.on_device(above("plane"), needs_footprints=True)
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    spacing = pixel_spacing(gbuffer)
    assert spacing is not None and spacing / scene.device_units_per_world_unit == pytest.approx(EYE * PIXEL, rel=1e-6)
    # Nearer than the ball's reflection, so that is what counts where both do.
    both = finest_footprints(gbuffer, shaded.rays, all_objects(scene, shaded.rays), is_seen=True)
    assert both == {0: spacing, 1: spacing}


def test_nothing_is_known_where_nothing_is_met() -> None:
    """Rays go up; the ball stands below the mirror, and the camera may look away from all."""
    given = above("plane")
    below = Object(shape="sphere", translate=(0, 0, -9))
    scene = flat_mirror.on_device(dataclasses.replace(given, objects=(given.objects[0], below)), needs_footprints=True)
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    assert finest_footprints(gbuffer, shaded.rays, all_objects(scene, shaded.rays), is_seen=False) == {1: None}
    away = Camera(eye=(0, 0, EYE), look_at=(0, 0, 9), up=(0, 1, 0), width=8, height=8)
    nothing, shaded = flat_mirror.seen_and_shaded(
        flat_mirror.on_device(scene.scene.with_camera(away), needs_footprints=True)
    )
    assert pixel_spacing(nothing) is None
