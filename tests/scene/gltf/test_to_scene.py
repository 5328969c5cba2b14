"""A glTF file as parts of a scene: upright, node by node, with lights and cameras in our units."""

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.to_scene import UPRIGHT, scene_parts
from tests.scene.gltf.writer import QUAD, Written

DOWN = [-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
"""The rotation that turns -z to -y."""


@pytest.mark.parametrize("up", UPRIGHT)
def test_files_stand_upright(tmp_path: Path, up: str) -> None:
    file = Written()
    file.quad()
    file.tree["nodes"][0] |= {"translation": [0, 5, 0], "name": "sheet"}
    (entry,) = scene_parts(file.save(tmp_path), up=up).objects
    turn = np.array(UPRIGHT[up], float)
    assert np.linalg.det(turn) == 1 and entry.name == "sheet"
    axis = np.zeros(3)
    axis["xyz".index(up[-1])] = -1 if up[0] == "-" else 1
    np.testing.assert_array_equal(turn @ [0, 1, 0], axis)
    place = entry.world_from_object()
    expected = (QUAD + [0, 5, 0]) @ turn.T  # noqa: RUF005
    np.testing.assert_allclose(entry.geometry.vertices @ place[:3, :3].T + place[:3, 3], expected, atol=1e-12)


def test_nodes_are_objects_and_share_meshes(tmp_path: Path) -> None:
    file = Written(nodes=[{"children": [1, 2], "scale": [2, 2, 2]}])
    number = file.quad()
    file.tree["nodes"][1] |= {"name": "leaf", "rotation": DOWN}
    file.add("nodes", {"mesh": number, "name": "leaf", "scale": [-1, 1, 1]})
    first, second = scene_parts(file.save(tmp_path)).objects
    assert (first.name, second.name) == ("leaf", "leaf.1") and first.geometry is second.geometry
    assert first.scale == pytest.approx(2) and first.matrix is None
    assert second.matrix is not None  # it mirrors


def test_nodes_without_a_size_are_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    file = Written()
    file.quad()
    file.tree["nodes"][0] |= {"scale": [0, 0, 0], "name": "hidden"}
    assert scene_parts(file.save(tmp_path)).objects == ()
    assert "not shown: node 'hidden'" in caplog.text


def test_a_flattened_node_is_shown_flat(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A ball without depth is a disc of its radius, whatever normals the file has for it, and faces whoever looks."""
    ball = trimesh.creation.icosphere(3)
    file = Written(materials=[{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1], "metallicFactor": 0}}])
    place, side = (file.accessor(of.astype(np.float32)) for of in (ball.vertices, ball.vertex_normals))
    faces = file.accessor(ball.faces.astype(np.uint16).reshape(-1))
    file.mesh({"POSITION": place, "NORMAL": side}, indices=faces, material=0)
    file.tree["nodes"][0] |= {"scale": [2, 2, 0], "translation": [1, 0, 0], "name": "disc"}
    file.add("nodes", {"mesh": 0, "scale": [2, 2, 0], "translation": [50, 0, 0]})
    entry, other = scene_parts(file.save(tmp_path)).objects
    assert entry.geometry is other.geometry and caplog.text == ""
    light = ldtrefl.Light(kind="directional", direction=(0, 1, 0), radiance=(0.5, 0.5, 0.5))
    dark = ldtrefl.Environment(sky=(0, 0, 0), ground=(0, 0, 0))
    pixels = (np.arange(64) + 0.5 - 32) * 2 * 9 * math.tan(math.radians(15)) / 64
    radius = np.hypot(pixels, pixels[:, None])
    for eye, shade in ((-9.0, 0.5), (9.0, 0.0)):
        camera = ldtrefl.Camera(eye=(1, eye, 0), look_at=(1, 0, 0), width=64, height=64, fov_y=30)
        scene = ldtrefl.Scene(
            camera=camera, objects=(entry,), lights=(light,), lighting=ldtrefl.Lighting(ambient=0.2), environment=dark
        )
        for method in ("bvh", "ldt"):
            image = ldtrefl.render(scene, method, samples=1).image
            assert image[radius < 1.9].shape[0] > 1000
            np.testing.assert_allclose(image[radius < 1.9][:, 0], 0.2 + shade, rtol=0.06)
            np.testing.assert_array_equal(image[radius > 2.05], 0)


def test_what_is_flattened_to_a_line_is_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    file = Written()
    file.quad()
    file.tree["nodes"][0] |= {"scale": [0, 3, 1], "name": "edge", "rotation": [0.1, 0.2, 0.3, 0.9]}
    assert scene_parts(file.save(tmp_path)).objects == ()
    assert "not shown: node 'edge'" in caplog.text


def test_lights_are_in_radiance(tmp_path: Path) -> None:
    """A white surface sends back 1 / pi of the light that falls on it."""
    lights = [
        {"type": "directional", "intensity": 3 * math.pi, "color": [1, 0.5, 0]},
        {"type": "point", "intensity": 2 * math.pi},
        {"type": "spot", "intensity": math.pi, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 2.0}},
    ]
    file = Written(extensions={"KHR_lights_punctual": {"lights": lights}})
    for number in range(3):
        file.add("nodes", {"extensions": {"KHR_lights_punctual": {"light": number}}, "translation": [0, 1, 2]})
    file.tree["nodes"][0]["rotation"] = DOWN
    sun, bulb, lamp = scene_parts(file.save(tmp_path)).lights
    assert sun.radiance == pytest.approx((3, 1.5, 0)) and bulb.intensity == pytest.approx((2, 2, 2))
    np.testing.assert_allclose(sun.direction, [0, 0, -1], atol=1e-15)
    np.testing.assert_allclose(bulb.position, [0, -2, 1])
    assert lamp.kind == "spot" and lamp.intensity == pytest.approx((1, 1, 1))
    np.testing.assert_allclose(lamp.direction, [0, 1, 0], atol=1e-15)  # -z in the file
    assert lamp.inner_angle == pytest.approx(math.degrees(0.1)) and lamp.outer_angle == 90.0


def test_cameras_keep_their_lens_and_shape(tmp_path: Path) -> None:
    lens = {"yfov": math.radians(30), "aspectRatio": 2.0, "znear": 0.1}
    file = Written(cameras=[{"type": "perspective", "perspective": lens}])
    file.add("nodes", {"camera": 0, "translation": [0, 5, 0], "rotation": DOWN, "name": "top"})
    parts = scene_parts(file.save(tmp_path))
    (camera,) = parts.cameras
    assert parts.names == ("top",) and camera.fov_y == pytest.approx(30)
    assert camera.width / camera.height == pytest.approx(2, abs=0.01)
    assert camera.width * camera.height == pytest.approx(768 * 512, rel=0.01)
    np.testing.assert_allclose(camera.eye, [0, 0, 5], atol=1e-12)
    np.testing.assert_allclose(np.subtract(camera.look_at, camera.eye)[:2], 0, atol=1e-12)
    np.testing.assert_allclose(camera.up, [0, 1, 0], atol=1e-12)


def test_a_camera_of_no_sensible_shape_gets_one(tmp_path: Path) -> None:
    for aspect in (1e-300, 1e300):
        lens = {"yfov": 1.0, "aspectRatio": aspect}
        file = Written(cameras=[{"type": "perspective", "perspective": lens}], nodes=[{"camera": 0}])
        (camera,) = scene_parts(file.save(tmp_path)).cameras
        assert max(camera.width / camera.height, camera.height / camera.width) == pytest.approx(64, rel=0.02)


@pytest.mark.parametrize("data", [b"", b"glTF", b"{}", b'{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}]}'])
def test_faults_name_the_file(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "a.gltf").write_bytes(data)
    with pytest.raises(InputError, match=r"a\.gltf: "):
        scene_parts(tmp_path / "a.gltf")


def test_a_scene_of_its_objects_renders(tmp_path: Path) -> None:
    file = Written(materials=[{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}])
    file.quad(material=0)
    parts = scene_parts(file.save(tmp_path))
    camera = ldtrefl.Camera(eye=(1, -5, 0.5), look_at=(1, 0, 0.5), width=8, height=8, fov_y=5)
    image = ldtrefl.render(ldtrefl.Scene(camera=camera, objects=parts.objects), "bvh").image
    assert image[4, 4, 0] > 0.1 and image[4, 4, 1:].max() < 1e-3  # red metal
