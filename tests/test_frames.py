"""Frames after frames: what is kept changes no bit, and what moved is done again."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl.render import Frame
from ldtrefl.scene import Camera, Lighting, Material, Object, Scene

MIRROR = Material(mirror=(0.9, 0.9, 0.9))


def scene(**changes: object) -> Scene:
    """A mirror ball between a knot, a torus and a box, on a large plate that device space is made for."""
    given = Scene(
        camera=Camera(eye=(0, -5, 1.5), look_at=(0, 0, 0), width=160, height=112, fov_y=40),
        objects=(
            Object(name="ball", shape="sphere", material=MIRROR),
            Object(name="plate", shape="plane", scale=4.0, translate=(0, 0, -1.1)),
            Object(name="knot", shape="torus_knot", params={"segments": [300, 40]}, scale=0.5, translate=(1.5, -1, 0)),
            Object(name="torus", shape="torus", scale=0.4, translate=(-1.4, -1.2, 0.2)),
            Object(name="box", shape="box", scale=0.2, translate=(0, -1.6, -0.6)),
        ),
    )
    return dataclasses.replace(given, **changes)


def assert_as_fresh(renderer: ldtrefl.Renderer, frame: Frame, method: str = "ldt", **options: object) -> None:
    """A frame is, to the bit, what a new renderer makes of the same scene."""
    fresh = ldtrefl.render(renderer.scene, method, **options)
    np.testing.assert_array_equal(frame.image, fresh.image)
    np.testing.assert_array_equal(frame.reflection, fresh.reflection)
    assert frame.hits is not None and fresh.hits is not None
    for name in ("distance", "object", "triangle"):
        np.testing.assert_array_equal(getattr(frame.hits, name), getattr(fresh.hits, name))


def test_a_still_frame_is_not_made_again() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    first, second = renderer.render(), renderer.render()
    np.testing.assert_array_equal(first.image, second.image)
    assert second.stats.counters["frames_kept"] == 1 and second.stats.counters["rays"] == 0
    assert {stage for stage, seconds in second.stats.seconds.items() if seconds > 0.0} == {"composite"}
    assert set(second.stats.seconds) == set(first.stats.seconds)
    third = renderer.render(camera=dataclasses.replace(renderer.scene.camera, eye=(0.5, -5, 1.5)))
    assert "frames_kept" not in third.stats.counters and third.stats.counters["rays"] > 0


def test_only_what_a_move_touches_is_done_again() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    first = renderer.render()
    before = first.image.copy()
    renderer.move("torus", translate=(-1.5, -1.1, 0.1))
    second = renderer.render()
    assert_as_fresh(renderer, second)
    counters = second.stats.counters
    assert 0 < counters["rays"] < 0.5 * first.stats.counters["rays"]
    assert counters["rays"] + counters["rays_kept"] == counters["reflector_pixels"]
    assert "objects_peeled" not in counters
    np.testing.assert_array_equal(first.image, before)  # what was handed out stays as it was
    renderer.move("torus", rotate=(1, 1, 0, 50), scale=0.3)
    assert_as_fresh(renderer, renderer.render())


def test_moves_of_several_objects_in_turn() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    renderer.render()
    for name, place in (("torus", (-1, -1.5, 0)), ("knot", (1.2, -1.4, 0.3)), ("torus", (-1, -1.5, 0.3))):
        renderer.move(name, translate=place)
        assert_as_fresh(renderer, renderer.render())
    renderer.move("box", translate=(0.1, -1.7, -0.5))
    renderer.move("knot", translate=(1.3, -1.4, 0.3))
    assert_as_fresh(renderer, renderer.render())


@pytest.mark.parametrize(
    ("name", "place"),
    [("ball", (0.2, 0.1, 0.1)), ("plate", (1.0, 0, -1.2)), ("box", (0, 0, 30)), ("torus", (0, -3, 0.9))],
    ids=["the mirror", "device space", "far away", "before the mirror"],
)
def test_moves_that_change_everything(name: str, place: tuple[float, float, float]) -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    renderer.render()
    renderer.move(name, translate=place)
    assert_as_fresh(renderer, renderer.render())


@pytest.mark.parametrize(
    ("method", "options"),
    [
        ("ldt", {"max_bounces": 3}),
        ("ldt", {"skip": "none"}),
        ("ldt", {"search": "linear"}),
        ("ldt", {"cull": "flat"}),
        ("bvh", {}),
    ],
)
def test_moves_with_every_option(method: str, options: dict[str, object]) -> None:
    renderer = ldtrefl.Renderer(scene(), method, **options)
    renderer.render()
    renderer.move("torus", translate=(-1.2, -1.4, 0))
    assert_as_fresh(renderer, renderer.render(), method, **options)


def test_a_moved_object_moves_its_shadow() -> None:
    light = ldtrefl.Light(kind="directional", direction=(0.3, 0.2, -1), radiance=(2, 2, 2))
    renderer = ldtrefl.Renderer(scene(lights=(light,), lighting=Lighting(shadows=True)), "ldt")
    renderer.render()
    renderer.move("torus", translate=(-1.2, -1.4, 0.4))
    assert_as_fresh(renderer, renderer.render())


def test_environment_maps_follow_a_move() -> None:
    renderer = ldtrefl.Renderer(scene(), "envmap")
    renderer.render()
    renderer.move("torus", translate=(-1.2, -1.4, 0.4))
    np.testing.assert_array_equal(renderer.render().image, ldtrefl.render(renderer.scene, "envmap").image)


def test_a_move_that_cannot_be_is_refused() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    with pytest.raises(ldtrefl.InputError, match=r"unknown object 'toros'; did you mean 'torus'\?"):
        renderer.move("toros", scale=2.0)
    with pytest.raises(ldtrefl.InputError, match=r"scale: should be greater than 0, got -1\.0"):
        renderer.move("torus", scale=-1.0)
    with pytest.raises(ldtrefl.InputError, match=r"rotate: the axis must not be the zero vector"):
        renderer.move("torus", rotate=(0, 0, 0, 10))
