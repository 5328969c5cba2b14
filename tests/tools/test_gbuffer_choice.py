"""The tool that compares the z-buffer with camera rays: its quick run, and that both see the same."""

import re

import gbuffer_choice
import numpy as np
import pytest

from ldtrefl.device import launch
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.tracing.bvh import Raycaster
from ldtrefl.world.device_scene import DeviceScene


def test_a_quick_run_prints_five_times(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.argv", ["gbuffer_choice.py", "--quick"])
    gbuffer_choice.main()
    _, line = capsys.readouterr().out.splitlines()
    names = ("z-buffer", "BVH build", "BVH rays", "tree build", "search")
    times = re.fullmatch(" +10 k triangles: " + ", ".join(rf"{name} +([\d.]+)" for name in names), line)
    assert times is not None and all(float(time) > 0.0 for time in times.groups()), line


def test_both_see_the_same_pixels() -> None:
    camera = Camera(eye=(0, -5, 1.2), look_at=(0, 0, 0), fov_y=35, width=60, height=40)
    scene = DeviceScene(Scene(camera=camera, objects=(Object(shape="box"),)), launch.resolve_device(None))
    hits = Raycaster.of(scene.objects[0].geometry).trace(*gbuffer_choice.rays_on_device(camera))
    np.testing.assert_array_equal(hits.triangle.numpy() >= 0, draw_gbuffer(scene, camera).triangles.ravel() >= 0)
