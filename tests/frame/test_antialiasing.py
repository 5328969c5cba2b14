"""Antialiased images: against the filter's closed form, and against all samples everywhere."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

import ldtrefl
from ldtrefl.frame import visibility
from ldtrefl.frame.sample_pattern import DEVIATION, RADIUS, levels
from ldtrefl.methods import base
from ldtrefl.scene.description import Camera, Environment, Material, Object, Scene
from tests.conftest import USUAL_SAMPLES
from tests.frame_scenes import assert_as_fresh, scene

WIDTH, HEIGHT = 96, 64


def edge(offset: float, axis: int) -> Scene:
    """A black wall before a white sky, whose edge lies ``offset`` pixels past the middle of the image."""
    distance, fov = 100.0, 20.0
    pixel = 2 * distance * math.tan(math.radians(fov / 2)) / HEIGHT
    half = 50.0 * pixel * WIDTH
    place = [0.0, 0.0, 0.0]
    # Pixels count to the right and down; the wall is on their lesser side.
    place[0 if axis == 0 else 2] = offset * pixel - half if axis == 0 else half - offset * pixel
    wall = Object(
        shape="box", scale=(half, 0.001, half), translate=tuple(place), material=Material(albedo=0.0), smooth=False
    )
    camera = Camera(eye=(0, -distance, 0), look_at=(0, 0, 0), fov_y=fov, width=WIDTH, height=HEIGHT)
    return Scene(camera=camera, environment=Environment(sky=1.0, ground=1.0), objects=(wall,))


def share_beyond(offset: float) -> float:
    """Of the filter about 0, what lies past ``offset``."""

    def integral(low: float, high: float) -> float:
        scale = DEVIATION * math.sqrt(2.0)
        whole = 0.5 * DEVIATION * math.sqrt(2.0 * math.pi) * (math.erf(high / scale) - math.erf(low / scale))
        return whole - (high - low) * math.exp(-0.5 * (RADIUS / DEVIATION) ** 2)

    return integral(min(max(offset, -RADIUS), RADIUS), RADIUS) / integral(-RADIUS, RADIUS)


@pytest.mark.parametrize("axis", [0, 1], ids=["across", "down"])
@pytest.mark.parametrize("offset", [0.0, 0.13, 0.5, 0.77])
def test_an_edge_has_the_filters_closed_form(offset: float, axis: int) -> None:
    image = ldtrefl.render(edge(offset, axis), "bvh", samples=256, adaptive=False).image[..., 0]
    profile = image[HEIGHT // 2] if axis == 0 else image[:, WIDTH // 2]
    count = len(profile)
    expected = [share_beyond(offset - (i + 0.5 - count / 2)) for i in range(count)]
    np.testing.assert_allclose(profile, expected, atol=0.01)


@pytest.mark.parametrize(("samples", "off"), [(2, 0.45), (4, 0.2), (16, 0.08)])
def test_few_samples_are_nearly_as_good(samples: int, off: float) -> None:
    described = edge(0.3, 0)
    truth = ldtrefl.render(described, "bvh", samples=256).image
    found = ldtrefl.render(described, "bvh", samples=samples).image
    assert np.abs(found - truth).max() < off
    assert np.abs(ldtrefl.render(described, "bvh", samples=1).image - truth).max() > 0.2


@pytest.mark.parametrize("method", ["ldt", "bvh", "envmap"])
def test_what_is_not_sampled_needs_no_samples(method: str) -> None:
    adaptive = ldtrefl.Renderer(scene(), method, samples=16).render()
    everywhere = ldtrefl.Renderer(scene(), method, samples=16, adaptive=False).render()
    centres = ldtrefl.render(scene(), method, samples=1)
    assert (everywhere.sample_counts == 16).all()
    assert set(np.unique(adaptive.sample_counts)) == {1, 4, 16}
    error, before = (np.abs(frame.image - everywhere.image).mean() for frame in (adaptive, centres))
    assert error < 0.25 * before
    assert adaptive.stats.counters["samples"] == adaptive.sample_counts.sum() < 0.5 * everywhere.sample_counts.sum()
    np.testing.assert_array_equal(adaptive.reflector_mask, centres.reflector_mask)
    np.testing.assert_array_equal(adaptive.reflection, centres.reflection)


def test_one_sample_is_the_image_at_pixels_centres() -> None:
    frame = ldtrefl.render(scene(), "ldt", samples=1)
    assert (frame.sample_counts == 1).all() and "samples" not in frame.stats.counters
    more = ldtrefl.render(scene(), "ldt", samples=4)
    neighbours = sliding_window_view(np.pad(more.sample_counts, 1, constant_values=1), (3, 3))
    alone = (neighbours == 1).all(axis=(2, 3))
    assert 0.2 < alone.mean() < 1.0
    weights = levels(4)[0].weights.reshape(3, 3)
    blended = (sliding_window_view(frame.image, (3, 3), axis=(0, 1)) * weights).sum(axis=(3, 4))
    inner = alone[1:-1, 1:-1]
    np.testing.assert_allclose(more.image[1:-1, 1:-1][inner], blended[inner], atol=1e-6)


def test_no_bit_depends_on_threads() -> None:
    images = []
    for threads in (1, 2, 3):
        ldtrefl.set_threads(threads)
        images.append(ldtrefl.render(scene(), "ldt", samples=9).image)
    assert (images[0] == images[1]).all() and (images[0] == images[2]).all()


@pytest.mark.parametrize("method", ["ldt", "bvh", "envmap"])
def test_a_large_image_has_the_bits_of_a_whole_one(monkeypatch: pytest.MonkeyPatch, method: str) -> None:
    whole = ldtrefl.render(scene(), method, samples=6)
    monkeypatch.setattr("ldtrefl.renderer.LARGEST_WHOLE", 1)
    monkeypatch.setattr(visibility, "BAND_PIXELS", 24 * whole.image.shape[1])
    banded = ldtrefl.render(scene(), method, samples=6)
    np.testing.assert_array_equal(banded.sample_counts, whole.sample_counts)
    np.testing.assert_array_equal(banded.image, whole.image)
    np.testing.assert_array_equal(banded.reflection, whole.reflection)
    assert banded.stats.counters["pixels"] == whole.stats.counters["pixels"]


def test_a_frame_that_is_kept_or_changed_is_as_fresh() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt", samples=4)
    first = renderer.render()
    again = renderer.render()
    assert again.stats.counters["frames_kept"] == 1
    np.testing.assert_array_equal(first.image, again.image)
    np.testing.assert_array_equal(first.sample_counts, again.sample_counts)
    again.image[...] = 7
    np.testing.assert_array_equal(first.image, renderer.render().image)
    renderer.move("torus", translate=(-1.5, -1.1, 0.1))
    moved = renderer.render()
    assert_as_fresh(renderer, moved, samples=4)


def test_samples_are_the_callers_or_the_scenes_or_four(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(base, "DEFAULT_SAMPLES", USUAL_SAMPLES)
    described = scene()
    assert ldtrefl.render(described, "bvh").sample_counts.max() == 4
    of_scene = dataclasses.replace(described, reflection=dataclasses.replace(described.reflection, samples=2))
    assert ldtrefl.render(of_scene, "bvh").sample_counts.max() == 2
    assert ldtrefl.render(of_scene, "bvh", samples=3).sample_counts.max() == 3


@pytest.mark.parametrize("value", [0, -1, 1025, 2.5, "many", True])
def test_other_numbers_are_refused(value: object) -> None:
    with pytest.raises(ldtrefl.InputError, match="method bvh: samples: should be"):
        ldtrefl.Renderer(scene(), "bvh", samples=value)
