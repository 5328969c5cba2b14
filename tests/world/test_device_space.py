"""Device space: fixed when a scene is laid out, and as precise wherever its objects move."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.world.device_space import device_space

METHODS = ("ldt", "bvh")


def scene(offset: float = 0.0) -> Scene:
    """A mirror ball and a torus, all of it moved along x."""
    return Scene(
        camera=Camera(eye=(offset, -5.0, 1.0), look_at=(offset, 0.0, 0.0), width=288, height=192),
        objects=(
            Object(name="ball", shape="sphere", material=Material(mirror=(0.9, 0.9, 0.9)), translate=(offset, 0, 0)),
            Object(name="torus", shape="torus", translate=(offset + 1.5, -1.5, 0.2)),
            Object(name="far", shape="box", scale=0.5, translate=(offset - 4.0, 1.0, 0.0)),
        ),
    )


def test_the_scene_as_it_was_laid_out_fills_the_unit_box() -> None:
    matrix = device_space(np.array([[1.0, 2.0, 3.0], [5.0, 4.0, 3.0]]))
    np.testing.assert_allclose(matrix @ [1.0, 2.0, 3.0, 1.0], [-1.0, -0.5, 0.0, 1.0])
    np.testing.assert_allclose(matrix @ [5.0, 4.0, 3.0, 1.0], [1.0, 0.5, 0.0, 1.0])
    np.testing.assert_array_equal(device_space(np.zeros((2, 3))), np.eye(4))


def test_scenes_that_come_from_one_keep_its_box() -> None:
    laid_out = scene()
    moved = laid_out.with_object("far", translate=(-9.0, 1.0, 0.0))
    np.testing.assert_array_equal(moved.layout_box, laid_out.layout_box)
    np.testing.assert_array_equal(moved.with_camera(laid_out.camera).layout_box, laid_out.layout_box)
    laid_out_there = dataclasses.replace(moved)
    assert laid_out_there.layout_box[0, 0] == -9.5


@pytest.mark.parametrize("method", METHODS)
def test_moving_the_outermost_object_changes_nothing_for_the_others(method: str) -> None:
    """It hides behind the ball: no ray of another object is followed again, and the bits are a new renderer's."""
    renderer = ldtrefl.Renderer(scene(), method)
    renderer.render()
    renderer.move("far", translate=(0.0, 60.0, 0.0))
    renderer.render()
    renderer.move("far", translate=(0.0, 70.0, 0.0))
    frame = renderer.render()
    if method == "ldt":
        assert frame.stats.counters["rays_kept"] > 0.5 * frame.stats.counters["reflector_pixels"]
    fresh = ldtrefl.Renderer(renderer.scene, method).render()
    np.testing.assert_array_equal(frame.image, fresh.image)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("offset", [1e3, 1e6])
def test_what_moves_away_is_as_precise_as_what_was_laid_out_there(method: str, offset: float) -> None:
    """Ball, torus and camera go far beyond the box that the scene was laid out in, one after the other."""
    there, renderer = scene(offset), ldtrefl.Renderer(scene(), method)
    for entry in there.objects:
        renderer.move(entry.name, translate=entry.translate)
    found, truth = renderer.render(there.camera), ldtrefl.render(there, method)
    np.testing.assert_array_equal(found.reflector_mask, truth.reflector_mask)
    assert found.hits is not None and truth.hits is not None
    differ = found.hits.triangle != truth.hits.triangle
    assert (truth.hits.object == 1).sum() > 50 and differ.sum() <= 8
    same = np.isfinite(truth.hits.distance) & ~differ
    np.testing.assert_allclose(found.hits.distance[same], truth.hits.distance[same], rtol=1e-5)


def test_an_object_that_comes_back_gives_the_first_frame_again() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    first = renderer.render()
    renderer.move("torus", translate=(1e9, 0.0, 0.0))
    renderer.render()
    renderer.move("torus", translate=(1.5, -1.5, 0.2))
    np.testing.assert_array_equal(renderer.render().image, first.image)
