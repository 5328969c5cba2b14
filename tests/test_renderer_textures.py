"""Filtered textures in whole frames: both methods agree, no bit depends on threads or history, mirrors show means."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.compare.metrics.structural_similarity import ssim
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene

SIDE = 128
GREY = Environment(sky=(0.5, 0.5, 0.5), ground=(0.5, 0.5, 0.5))


@pytest.fixture(autouse=True)
def all_threads() -> Iterator[None]:
    yield
    ldtrefl.set_threads(None)


@pytest.fixture(params=[None, 0.9], ids=["plain", "look"])
def checkered(request: pytest.FixtureRequest, tmp_path: Path) -> Scene:
    """A ball that mirrors a checkered floor, and a mirror behind it that shows both."""
    checker = ((np.indices((512, 512)) // 8).sum(axis=0) % 2)[..., None] * np.ones(3)
    ldtrefl.save_image(tmp_path / "checker.exr", checker.astype(np.float32))
    floor = Material(albedo=1.0, texture=str(tmp_path / "checker.exr"), roughness=request.param)
    objects = (
        Object(name="floor", shape="plane", scale=(20, 20, 1), material=floor),
        Object(name="ball", shape="sphere", translate=(0, 0, 1), material=Material(mirror=0.9)),
        Object(
            name="wall",
            shape="plane",
            scale=3.0,
            rotate=(1, 0, 0, 90),
            translate=(0, 3, 1),
            smooth=False,
            material=Material(mirror=0.8),
        ),
    )
    camera = Camera(eye=(0.5, -7, 1.6), look_at=(0, 0, 0.9), fov_y=25.0, width=SIDE, height=SIDE)
    return Scene(camera=camera, objects=objects, environment=GREY, lighting=Lighting(ambient=(1, 1, 1)))


def test_both_methods_agree(checkered: Scene) -> None:
    by_rays = ldtrefl.render(checkered, "bvh", filter_textures=True, samples=1).image
    by_maps = ldtrefl.render(checkered, "ldt", filter_textures=True, samples=1).image
    assert ssim(by_rays, by_maps, np.ones((SIDE, SIDE), bool)) > 0.999


def test_threads_and_history_change_no_bit(checkered: Scene) -> None:
    renderer = ldtrefl.Renderer(checkered, "ldt", filter_textures=True)
    first = renderer.render().image
    ldtrefl.set_threads(1)
    assert np.array_equal(ldtrefl.render(checkered, "ldt", filter_textures=True).image, first)
    renderer.move("ball", translate=(0.3, 0, 1))
    renderer.render()
    renderer.move("ball", translate=(0.3, 0.2, 1))
    again = ldtrefl.Renderer(checkered, "ldt", filter_textures=True)
    again.move("ball", translate=(0.3, 0.2, 1))
    assert np.array_equal(renderer.render().image, again.render().image)


def test_what_mirrors_show_is_near_the_mean_of_many_rays(checkered: Scene) -> None:
    """In the ball and in the mirror that shows the ball: filtered pixels against the means of 64 rays each."""
    many = 8
    camera = checkered.camera
    fine = Camera(eye=camera.eye, look_at=camera.look_at, fov_y=camera.fov_y, width=many * SIDE, height=many * SIDE)
    truth = (
        ldtrefl.render(checkered.with_camera(fine), "bvh", samples=1)
        .image.reshape(SIDE, many, SIDE, many, 3)
        .mean(axis=(1, 3))
    )
    seen = ldtrefl.render(checkered, "bvh", samples=1)
    filtered = ldtrefl.render(checkered, "bvh", filter_textures=True, samples=1).image
    inside = seen.reflector_mask
    for step in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        inside = inside & np.roll(seen.reflector_mask, step, (0, 1))
    errors = [np.sqrt(np.mean((image - truth)[inside] ** 2)) for image in (seen.image, filtered)]
    assert errors[1] < 0.4 * errors[0], errors


def test_a_scene_without_textures_is_not_touched(checkered: Scene) -> None:
    plain = checkered.with_object("floor", material=Material(albedo=0.5))
    renderer = ldtrefl.Renderer(plain, "ldt", filter_textures=True, samples=1)
    assert np.array_equal(renderer.render().image, ldtrefl.render(plain, "ldt", samples=1).image)
    hits = renderer.render().hits
    assert hits is not None and hits.rays.footprint.shape[0] == 0


def test_textures_are_filtered_if_pixels_have_several_samples(checkered: Scene) -> None:
    by_default, filtered, plain = (
        ldtrefl.render(checkered, "ldt", **options).image
        for options in (
            {"samples": 4},
            {"samples": 4, "filter_textures": True},
            {"samples": 4, "filter_textures": False},
        )
    )
    assert np.array_equal(by_default, filtered) and not np.array_equal(by_default, plain)
    one = [ldtrefl.render(checkered, "ldt", samples=1, **more).image for more in ({}, {"filter_textures": False})]
    assert np.array_equal(*one)
