"""Which pixels need more samples: steps and edges, not what changes steadily."""

import numpy as np
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.frame.contrast import AT_EDGE, WITHIN, groups_of_contrast, objects_seen, pixels_of_contrast
from ldtrefl.frame.gbuffer import GBuffer, GBufferView
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world.camera import whole_image
from tests.frame.flat_mirror import on_device
from tests.frame_scenes import scene

HEIGHT, WIDTH = 70, 100


def marked(image: np.ndarray, objects: np.ndarray) -> np.ndarray:
    """(h, w) bool: the pixels that are found."""
    on = on_device(Scene(camera=Camera(eye=(0, -5, 0), look_at=(0, 0, 0)), objects=(Object(shape="sphere"),)))
    camera, view = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=WIDTH, height=HEIGHT), GBufferView()
    view.object = wp.array(objects.ravel(), dtype=wp.int32, device=on.device)
    gbuffer = GBuffer(on, camera, view, whole_image(camera))
    radiance = wp.array(image.reshape(-1, 3).astype(np.float32), dtype=wp.vec3, device=on.device)
    found = np.zeros(HEIGHT * WIDTH, bool)
    pixels = pixels_of_contrast(gbuffer, None, radiance, 4)
    found[pixels] = True
    assert len(np.unique(pixels)) == len(pixels)
    return found.reshape(HEIGHT, WIDTH)


def grey(values: np.ndarray) -> np.ndarray:
    """(h, w, 3) from (h, w)."""
    return np.repeat(np.broadcast_to(values, (HEIGHT, WIDTH))[..., None], 3, axis=2)


X, Y = np.arange(WIDTH), np.arange(HEIGHT)[:, None]
ALIKE = np.zeros((HEIGHT, WIDTH), np.int32)


def test_a_step_is_found_on_both_sides_along_either_axis_and_in_any_channel() -> None:
    for channel in range(3):
        image = grey(np.full((HEIGHT, WIDTH), 0.4))
        image[:, 66:, channel] = 0.6
        assert np.flatnonzero(marked(image, ALIKE).all(axis=0)).tolist() == [65, 66]
        assert marked(image, ALIKE).sum() == 2 * HEIGHT
        image = grey(np.full((HEIGHT, WIDTH), 0.4))
        image[31:, :, channel] = 0.6
        assert np.flatnonzero(marked(image, ALIKE).all(axis=1)).tolist() == [30, 31]


def test_what_changes_steadily_is_left_alone() -> None:
    assert not marked(grey(0.1 + 0.05 * X + 0.02 * Y), ALIKE).any()


def test_at_the_edge_of_an_object_less_is_enough() -> None:
    step = 1.2 * 0.5 * AT_EDGE * 2 * np.sqrt(0.5) * 1.5**1.5
    image = grey(np.where(X < 64, 0.5, 0.5 + step))
    assert 0.5 * step < 0.5 * WITHIN * 2 * np.sqrt(0.5) * 1.5**1.5  # within an object: too little
    assert not marked(image, ALIKE).any()
    edge = np.where(X < 64, 0, 1) + ALIKE
    assert np.flatnonzero(marked(image, edge).all(axis=0)).tolist() == [63, 64]
    assert not marked(grey(np.full((HEIGHT, WIDTH), 0.5)), edge).any()


def test_the_scale_is_the_eyes() -> None:
    """Steps of equal ratio are found in the dark as in the light; bright ones far less."""
    for level, step, is_found in ((0.01, 0.02, True), (0.5, 0.02, False), (0.5, 0.3, True), (50.0, 5.0, False)):
        assert marked(grey(np.where(X < 50, level, level + step)), ALIKE).any() == is_found


def test_samples_of_a_pixel_that_differ() -> None:
    device = launch.resolve_device(None)
    values = np.full((4, 3, 3), 0.5, np.float32)
    values[1, 2, 1] = 0.9
    values[3, 1] = 0.52
    radiance = wp.array(values.reshape(-1, 3), dtype=wp.vec3, device=device)
    assert groups_of_contrast(radiance, 3).tolist() == [1]


def test_objects_behind_mirrors_are_told_apart() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    frame, gbuffer = renderer.render(), renderer.gbuffer
    assert gbuffer is not None and frame.hits is not None
    seen = objects_seen(gbuffer, frame.hits).numpy().reshape(gbuffer.shape)
    mirrors = gbuffer.reflector_mask
    for number in np.unique(gbuffer.objects[mirrors]):
        of_one = mirrors & (gbuffer.objects == number)
        reflected = frame.hits.object[of_one]
        # As many numbers as there are objects behind it, at least: later bounces may tell more apart.
        assert len(np.unique(seen[of_one])) >= len(np.unique(reflected))
    assert len(np.unique(seen)) > len(np.unique(gbuffer.objects))
