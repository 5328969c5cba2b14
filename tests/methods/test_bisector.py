"""Virtual vertices by a search in image space: whole pictures against ray casting."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl.compare import metrics
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene

CAMERA = Camera(eye=(0.4, -5.0, 1.2), look_at=(0.0, 0.0, 0.1), width=330, height=220, fov_y=32.0)


def ball_scene(*things: Object) -> Scene:
    """A mirror ball before things."""
    ball = Object(
        name="ball", shape="sphere", params={"segments": [256, 128]}, material=Material(albedo=0.0, mirror=0.9)
    )
    return Scene(
        camera=CAMERA,
        objects=(ball, *things),
        lighting=Lighting(ambient=(0.5, 0.5, 0.5)),
        lights=(ldtrefl.Light(kind="directional", direction=(0.3, 0.6, -0.8), radiance=(1.0, 1.0, 1.0)),),
        environment=Environment(sky=(0.5, 0.6, 0.9), ground=(0.3, 0.25, 0.2)),
    )


FINE = ball_scene(
    Object(
        shape="torus_knot",
        params={"segments": [600, 60]},
        scale=0.5,
        translate=(-1.4, -1.3, 0.2),
        material=Material(albedo=(0.8, 0.3, 0.2)),
    ),
    Object(shape="sphere", scale=0.5, translate=(1.4, -1.2, -0.3), material=Material(albedo=(0.2, 0.5, 0.8))),
)


@pytest.mark.parametrize("samples", [1, 4])
def test_finely_tessellated_objects_in_a_ball(samples: int) -> None:
    found = ldtrefl.render(FINE, "bisector", samples=samples)
    truth = ldtrefl.render(FINE, "bvh", samples=samples, max_bounces=1)
    mask = found.reflector_mask
    assert metrics.ssim(found.image, truth.image, mask) >= 0.95
    assert metrics.ssim(ldtrefl.render(FINE, "envmap", samples=samples).image, truth.image, mask) < 0.94
    if samples == 1:
        finer = ldtrefl.render(FINE, "bisector", samples=1, fineness=8.0)
        assert metrics.ssim(finer.image, truth.image, mask) >= 0.985


def test_a_reflector_at_the_border_of_the_image_needs_a_wider_view() -> None:
    """The reflection of what lies far aside is beyond the image: triangles that reach there are drawn right."""
    near = Camera(eye=(0.4, -5.0, 1.2), look_at=(0.9, 0.0, 0.1), width=90, height=90, fov_y=14.0)
    scene = FINE.with_camera(near)
    truth = ldtrefl.render(scene, "bvh", samples=1, max_bounces=1)
    narrow, wide = (
        metrics.ssim(ldtrefl.render(scene, "bisector", samples=1, widening=by).image, truth.image, truth.reflector_mask)
        for by in (1.0, 1.6)
    )
    assert wide > narrow - 1e-3 and wide > 0.93


def test_no_reflector_is_seen() -> None:
    away = FINE.with_camera(Camera(eye=(0, -5, 1), look_at=(0, -9, 1), width=20, height=16))
    assert not ldtrefl.render(away, "bisector").reflector_mask.any()


def test_searches_that_go_on_from_the_frame_before_are_short_and_find_the_same() -> None:
    """Table 1 of the paper: 3.3 to 4.7 iterations, against those from the middle of the reflector."""
    cold, warm = (ldtrefl.Renderer(FINE, "bisector", samples=1, coherent=coherent) for coherent in (False, True))
    for number in range(4):
        camera = dataclasses.replace(CAMERA, eye=(0.4 + 0.02 * number, -5.0, 1.2))
        expected, found = cold.render(camera), warm.render(camera)
        np.testing.assert_array_equal(found.image, expected.image)
    steps = [frame.stats.counters["steps"] / frame.stats.counters["vertices"] for frame in (expected, found)]
    assert steps[1] < 4.7 < 20.0 < steps[0]


def test_frames_of_one_renderer_have_the_bits_of_new_ones() -> None:
    renderer = ldtrefl.Renderer(FINE, "bisector", samples=1)
    renderer.render()
    renderer.move("ball", translate=(0.1, 0.0, 0.0))
    moved = renderer.render().image
    ball = FINE.objects[0].changed(translate=(0.1, 0.0, 0.0))
    again = ldtrefl.render(dataclasses.replace(FINE, objects=(ball, *FINE.objects[1:])), "bisector", samples=1)
    np.testing.assert_array_equal(moved, again.image)
