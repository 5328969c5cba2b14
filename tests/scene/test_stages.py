"""What is put around a subject."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl import Object
from ldtrefl.scene.composed import composed
from ldtrefl.scene.framing import towards
from ldtrefl.scene.stages import CHROME, FLOOR, STAGES, STUDIO, albedo_seen_as, bare, floor_light
from ldtrefl.scene.subject import Subject

THING = Object(name="thing", shape="torus_knot", params={"segments": [96, 16]}, translate=(3.0, 1.0, 2.0))


@pytest.mark.parametrize("name", STAGES)
def test_all_stand_on_the_floor_and_nothing_touches_the_subject(name: str) -> None:
    subject = Subject.of([THING])
    stage = STAGES[name](subject)
    floor = stage.objects[0]
    assert floor.name == "floor" and floor.translate[2] == subject.base[2] < subject.points[:, 2].min()
    for ball in stage.framed:
        assert ball.translate[2] - ball.scale == pytest.approx(floor.translate[2], abs=1e-9)
        assert np.linalg.norm(subject.points - ball.translate, axis=1).min() > ball.scale


def test_a_stage_scales_with_its_subject() -> None:
    """Both are measured in their sizes, to the digits that they are written with."""
    small, large = (
        STAGES["mirror-ball"](Subject.of([dataclasses.replace(THING, scale=size, translate=(0.0, 0.0, 0.0))]))
        for size in (1.0, 1000.0)
    )
    for one, other in zip(small.objects, large.objects, strict=True):
        np.testing.assert_allclose(np.multiply(one.translate, 1000.0), other.translate, rtol=1e-3, atol=5.0)


@pytest.mark.parametrize("name", ["studio", "mirror-floor"])
def test_the_floor_and_the_horizon_are_of_one_color(name: str) -> None:
    """Far away, where the floor's reflection is that of the horizon, it meets the backdrop without a line: the
    brightness of a column of the picture that has the floor alone hardly changes from one pixel to the next."""
    scene = composed((THING,), name, size=(60, 40))
    lower = dataclasses.replace(scene.camera, look_at=tuple(np.subtract(scene.camera.eye, towards(-32.0, 4.0))))
    column = ldtrefl.render(scene.with_camera(lower)).image[:, -1]
    np.testing.assert_allclose(column[12:20], np.tile(FLOOR, (8, 1)), atol=0.02)
    assert np.abs(np.diff(column, axis=0)).max() < 0.02


def test_a_floor_of_that_albedo_looks_like_the_color() -> None:
    """As rendered, where all lights reach it."""
    color = np.array([0.3, 0.2, 0.1])
    scene = ldtrefl.Scene(
        camera=ldtrefl.Camera(eye=(0.0, -1.0, 5.0), look_at=(0.0, 0.0, 0.0), width=3, height=2),
        environment=STUDIO,
        objects=(Object(shape="plane", scale=9.0, material=ldtrefl.Material(albedo=albedo_seen_as(color))),),
    )
    np.testing.assert_allclose(ldtrefl.render(scene).image[1, 1], color, atol=1e-3)
    assert (floor_light() < 1.0).all()


@pytest.mark.parametrize("name", ["mirror-ball", "chrome"])
def test_mirrors_show_soft_boxes_to_the_camera(name: str) -> None:
    """What is brighter than white, in a tenth of a mirror and less than half of it."""
    frame = ldtrefl.render(composed((THING,), name, size=(96, 64)))
    glowing = (frame.image[frame.reflector_mask] > 1.0).all(axis=-1).mean()
    assert 0.02 < glowing < 0.3, glowing


def test_mirrors_are_where_their_names_say() -> None:
    mirrors = {
        name: [entry.name for entry in composed((THING,), name).objects if entry.is_reflector] for name in STAGES
    }
    assert mirrors == {
        "studio": [],
        "mirror-floor": ["floor"],
        "mirror-ball": ["mirror ball"],
        "chrome": ["thing"],
    }
    assert composed((THING,), "chrome").objects[0].material == CHROME
    assert not bare(Subject.of([THING])).objects


def test_the_ball_shows_the_subject() -> None:
    frame = ldtrefl.render(composed((THING,), "mirror-ball", size=(96, 64)))
    assert frame.hits is not None
    seen = (frame.hits.object == 0) & frame.reflector_mask
    assert 0.01 < seen.sum() / frame.reflector_mask.sum() < 0.3
