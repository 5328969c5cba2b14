"""Which objects the camera's rays are searched for in."""

import dataclasses

import numpy as np
import pytest

from ldtrefl.frame import search_choice
from ldtrefl.frame.drawn_objects import DrawnObjects
from ldtrefl.frame.instances import MANY
from ldtrefl.frame.search_choice import ImageBoxes, objects_to_search
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world import triangle_numbers
from tests.frame.flat_mirror import on_device

CAMERA = Camera(eye=(0, -6, 1.5), look_at=(0, 0, 0), width=96, height=64, fov_y=40)
KNOT = Object(shape="torus_knot", params={"segments": [400, 40]})
"""32,000 triangles."""


def chosen(camera: Camera, *objects: Object) -> list[int]:
    return objects_to_search(on_device(Scene(camera=camera, objects=objects)), camera).tolist()


def test_many_small_triangles_are_searched() -> None:
    ball = Object(shape="sphere", params={"segments": [60, 30]})
    assert chosen(CAMERA, ball, KNOT, dataclasses.replace(KNOT, translate=(0.5, 0, 0))) == [1, 2]


def test_what_covers_many_pixels_for_its_triangles_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    large = dataclasses.replace(CAMERA, width=1500, height=1000)
    assert chosen(large, KNOT) == []
    # 32,000 triangles against the pixels of a box that fills the image.
    monkeypatch.setattr(search_choice, "TRIANGLE_NANOSECONDS", 10.0)
    close = dataclasses.replace(CAMERA, fov_y=9)
    pixels = CAMERA.width * CAMERA.height
    for cost, searched in ((320_000 / pixels - 0.1, [0]), (320_000 / pixels + 0.1, [])):
        monkeypatch.setattr(search_choice, "PIXEL_NANOSECONDS", cost)
        assert chosen(close, KNOT) == searched


def test_small_meshes_and_those_of_many_objects_are_drawn() -> None:
    assert chosen(CAMERA, dataclasses.replace(KNOT, params={"segments": [200, 40]})) == []
    assert chosen(CAMERA, *[KNOT] * (MANY - 1)) == list(range(MANY - 1))
    assert chosen(CAMERA, *[KNOT] * MANY) == []


def test_what_is_close_or_beside_the_view_is_drawn() -> None:
    assert chosen(dataclasses.replace(CAMERA, eye=(0.05, 0.03, 0.0)), KNOT) == []
    assert chosen(dataclasses.replace(CAMERA, eye=(0, -1.001, 0)), KNOT) == []
    assert chosen(dataclasses.replace(CAMERA, look_at=(0, -12, 0)), KNOT) == []
    # A thin rod seen from its end is small in the image, and yet rounding would be seen there.
    rod = dataclasses.replace(KNOT, scale=(0.01, 1.0, 0.01))
    assert chosen(dataclasses.replace(CAMERA, eye=(0, -1.2, 0)), rod) == [0]
    assert chosen(dataclasses.replace(CAMERA, eye=(0, -1.01, 0)), rod) == []


def test_where_triangles_are_numbered_in_groups_all_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(triangle_numbers, "MOST_NUMBERS", 20_000)
    assert chosen(CAMERA, KNOT) == []


def test_boxes_hold_all_that_is_seen() -> None:
    objects = (KNOT, dataclasses.replace(KNOT, rotate=(1, 2, 3, 50), scale=(1.0, 0.2, 0.5), translate=(1.2, -1, 0.5)))
    scene = on_device(Scene(camera=CAMERA, objects=objects))
    drawn = DrawnObjects.of(scene, CAMERA, np.arange(2))
    boxes = ImageBoxes.of(scene, drawn)
    for number in range(2):
        alone = draw_gbuffer(on_device(Scene(camera=CAMERA, objects=objects[number : number + 1])), CAMERA)
        rows, columns = np.nonzero(alone.objects >= 0)
        assert boxes.first_x[number] <= columns.min() <= columns.max() <= boxes.last_x[number]
        assert boxes.first_y[number] <= rows.min() <= rows.max() <= boxes.last_y[number]
        assert boxes.last_x[number] - boxes.first_x[number] < 1.5 * np.ptp(columns) + 6
