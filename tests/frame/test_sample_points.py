"""What points between the pixels' centres see: what pixels see, where they are centres."""

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.device.stats import Stats
from ldtrefl.frame.sample_points import camera_rays, regions_of, seen_at
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.tracing.scene_bvh import SceneBvh
from tests.frame.flat_mirror import on_device
from tests.frame_scenes import scene


def centres(shape: tuple[int, int]) -> np.ndarray:
    """(h * w, 2) float64."""
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    return np.stack([x.ravel(), y.ravel()], axis=1)


@pytest.mark.parametrize("distance", [1.0, 1e4])
def test_points_see_what_is_drawn_at_pixels_centres(distance: float) -> None:
    camera = Camera(
        eye=(0.3 * distance, -6.0 * distance, 2.0 * distance),
        look_at=(0, 0, 0),
        width=120,
        height=80,
        fov_y=float(np.degrees(2 * np.arctan(0.3 / distance))),
    )
    described = Scene(camera=camera, objects=scene().objects)
    on = on_device(described)
    image = draw_gbuffer(on, camera)
    place = wp.array(centres(image.shape), dtype=wp.vec2d, device=on.device)
    rays = camera_rays(image, place)
    regions = regions_of(image, rays)
    points = seen_at(image, place, rays, regions, SceneBvh().bound(on, regions.shown, Stats()), by_bounds=True)
    assert points.shape == (1, image.pixel_count)
    same = points.objects.ravel() == image.objects.ravel()
    same &= points.triangles.ravel() == image.triangles.ravel()
    assert same.mean() > 0.9995  # what lies on the edge of two triangles is either's
    seen = image.reflector_mask.ravel()
    assert (points.reflector_mask.ravel() == seen)[same].all() and seen.any()
    assert np.flatnonzero(points.reflector_mask).tolist() == points.reflector_pixels.numpy().tolist()


@pytest.mark.parametrize(
    ("method", "options"),
    [("ldt", {}), ("ldt", {"error": 1.0}), ("ldt", {"search": "linear"}), ("bvh", {}), ("envmap", {})],
    ids=str,
)
def test_a_sample_at_a_pixels_centre_has_its_radiance(method: str, options: dict[str, object]) -> None:
    renderer = ldtrefl.Renderer(scene(), method, samples=1, **options)
    image, gbuffer = renderer.render().image, renderer.gbuffer
    assert gbuffer is not None
    place = wp.array(centres(gbuffer.shape), dtype=wp.vec2d, device=gbuffer.scene.device)
    radiance = renderer._seen(gbuffer, Stats(), place).numpy()
    off = np.abs(radiance - image.reshape(-1, 3)).max(axis=1)
    assert np.quantile(off, 0.995) < 1e-4


def test_what_no_point_sees_is_not_searched() -> None:
    far = Object(shape="sphere", translate=(0, -50, 0), name="behind the camera")
    described = Scene(camera=scene().camera, objects=(*scene().objects, far))
    on = on_device(described)
    image = draw_gbuffer(on, described.camera)
    place = wp.array(centres(image.shape), dtype=wp.vec2d, device=on.device)
    shown = regions_of(image, camera_rays(image, place)).shown
    assert len(on.objects) - 1 not in shown
    assert set(np.unique(image.objects)) - {-1} <= shown
