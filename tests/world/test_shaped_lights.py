"""Spheres, rectangles and spot lights in device space."""

import numpy as np
import pytest

from ldtrefl.scene.description import Light
from ldtrefl.scene.presets.base import DistantRectangle
from ldtrefl.world.shaped_lights import BRIGHTEST, SHAPED, distant_rectangle, shaped_light

HALF = np.diag([0.5, 0.5, 0.5, 1.0])
"""A world unit is half a device unit."""
HALF[:3, 3] = [1, 0, 0]


def test_a_sphere() -> None:
    record = shaped_light(Light(kind="sphere", position=(2, 4, 6), radius=3.0, radiance=(1, 2, 3)), HALF)
    assert record.kind == SHAPED["sphere"] and list(record.position) == [2, 2, 3] and record.radius == 1.5
    assert list(record.radiance) == [1, 2, 3]
    assert (record.samples, record.visible) == (16, 1)


def test_a_rectangle_has_half_sides_that_span_the_side_it_shines_to() -> None:
    light = Light(kind="rectangle", position=(0, 0, 2), direction=(0, 2, 0), width=4, height=2, radiance=1.0, samples=9)
    record = shaped_light(light, HALF)
    assert list(record.axis) == [0, 1, 0] and list(record.up) == [0, 0, 0.5] and record.samples == 9
    np.testing.assert_allclose(np.cross(record.right, record.up), 0.5 * np.array(record.axis))


def test_a_spot() -> None:
    given = {"position": (0, 0, 2), "direction": (0, 0, -3), "intensity": 8.0, "inner_angle": 20, "outer_angle": 60}
    record = shaped_light(Light(kind="spot", **given), HALF)
    assert list(record.axis) == [0, 0, -1] and list(record.radiance) == [2, 2, 2]
    assert (record.samples, record.visible, record.radius) == (1, 0, 0.0)
    factor, offset = record.cone
    assert factor * np.cos(np.radians(60)) + offset == pytest.approx(0.0, abs=1e-6)
    assert factor * np.cos(np.radians(20)) + offset == pytest.approx(1.0, abs=1e-6)
    assert shaped_light(Light(kind="spot", radius=0.2, **given), HALF).samples == 16


def test_the_brightest_and_the_sharpest_are_finite() -> None:
    given = {"position": (0, 0, 2), "direction": (0, 0, -3), "intensity": 1e15, "inner_angle": 30, "outer_angle": 30}
    record = shaped_light(Light(kind="spot", radius=1e15, **given), np.diag([1e15, 1e15, 1e15, 1.0]))
    assert list(record.radiance) == [np.float32(BRIGHTEST)] * 3
    assert np.isfinite([record.radius, *record.cone]).all()


def test_a_rectangle_of_an_environment_is_turned_with_it() -> None:
    light = DistantRectangle((0.0, 0.6, 0.8), (0.5, 0.0, 0.0), (0.0, -0.24, 0.18), (1.0, 2.0, 3.0))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    record = distant_rectangle(light, turn, 2.0, 16)
    assert (record.kind, record.distant, record.visible, record.samples) == (SHAPED["rectangle"], 1, 0, 16)
    assert [distant_rectangle(light, turn, 2.0, samples).samples for samples in (1, 1000)] == [4, 64]
    np.testing.assert_allclose(record.position, (-0.6, 0.0, 0.8), atol=1e-7)
    np.testing.assert_allclose(record.axis, (0.6, 0.0, -0.8), atol=1e-7)
    np.testing.assert_allclose(np.cross(record.right, record.up), 0.15 * np.array(record.axis), atol=1e-7)
    assert list(record.radiance) == [2.0, 4.0, 6.0]
