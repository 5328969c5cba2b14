"""Lights and cameras where their nodes place them."""

import math

import numpy as np
import pytest

from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.asset import Asset
from tests.scene.gltf.writer import Written, nothing_beside

DOWN = [-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
"""The rotation that turns -z to -y."""


def asset(lights: list[dict[str, object]], **node: object) -> Asset:
    """A file of some lights, the first of them in a node."""
    file = Written(extensions={"KHR_lights_punctual": {"lights": lights}})
    file.add("nodes", {"extensions": {"KHR_lights_punctual": {"light": 0}}, **node})
    return Asset.read(file.as_glb(), nothing_beside)


def test_a_directional_light_shines_along_its_node() -> None:
    (light,) = asset([{"type": "directional", "color": [1, 0.5, 0], "intensity": 4}], rotation=DOWN).lights()
    assert (light.kind, light.color) == ("directional", (4, 2, 0))
    np.testing.assert_allclose(light.direction, [0, -1, 0], atol=1e-15)


def test_point_and_spot_lights_stand_in_their_nodes() -> None:
    (point,) = asset([{"type": "point", "range": 7}], translation=[1, 2, 3]).lights()
    assert (point.kind, point.color, point.range, point.position.tolist()) == ("point", (1, 1, 1), 7, [1, 2, 3])
    (spot,) = asset([{"type": "spot", "spot": {"innerConeAngle": 0.1}}], scale=[2, 2, 2]).lights()
    assert spot.cone == (0.1, math.pi / 4) and spot.range == math.inf
    np.testing.assert_allclose(spot.direction, [0, 0, -1])


@pytest.mark.parametrize("lights", [[], [{"type": "area"}]])
def test_lights_that_are_unsound_are_refused(lights: list[dict[str, object]]) -> None:
    with pytest.raises(InputError, match=r"there is no light 0|allowed are directional, point, spot"):
        asset(lights).lights()


def test_cameras_look_along_their_nodes() -> None:
    perspective = {"type": "perspective", "perspective": {"yfov": math.radians(30), "aspectRatio": 2, "znear": 0.1}}
    flat = {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 2, "zfar": 9, "znear": 0}}
    file = Written(cameras=[perspective, flat])
    file.add("nodes", {"camera": 0, "translation": [0, 5, 0], "rotation": DOWN, "name": "top"})
    file.add("nodes", {"camera": 1})
    top, side = Asset.read(file.as_glb(), nothing_beside).cameras()
    assert (top.name, top.is_perspective, top.aspect) == ("top", True, 2)
    assert top.fov_y == pytest.approx(30)
    np.testing.assert_allclose(top.position, [0, 5, 0])
    np.testing.assert_allclose(top.forward, [0, -1, 0], atol=1e-15)
    np.testing.assert_allclose(top.up, [0, 0, -1], atol=1e-15)
    assert (side.is_perspective, side.half_height, side.aspect) == (False, 2, 1.5)


def test_a_camera_of_no_kind_is_refused() -> None:
    file = Written(cameras=[{"type": "panoramic"}], nodes=[{"camera": 0}])
    with pytest.raises(InputError, match="allowed are perspective, orthographic"):
        Asset.read(file.as_glb(), nothing_beside).cameras()
