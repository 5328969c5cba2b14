"""Whole frames of the benchmark: its scenes, other checkouts' frames, and tables; never a time."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from benchmark_parts.checkout_frames import CheckoutFrames
from benchmark_parts.frame_scenes import FRAME_SCENES, LARGEST, STEP, frame_scene, moving
from benchmark_parts.frame_tables import frames_before_tables, rival_frames_tables, start_table
from benchmark_parts.our_frames import OurFrames, median_stages
from benchmark_parts.result import FrameRow, FrameTime
from benchmark_parts.rival_frames import LARGER_KNOTS, ON_SMALL_KNOT, QUICK_SCENES, SMALL_KNOT
from benchmark_parts.starting import starts

import ldtrefl

ROOT = Path(__file__).parent.parent.parent
TOOL = ROOT / "tools" / "benchmark.py"
SIZE = 48, 32


@pytest.mark.parametrize(
    "name, objects, mirrors, triangles, bounces",
    [
        (SMALL_KNOT, 2, 1, 96_000, 4),
        ("ball, knot 500 k", 2, 1, 500_000, 4),
        ("50 objects", 50, 1, 49 * 3600, 4),
        ("room, 9 mirrors", 12, 9, 96_000, 5),
        ("no mirror, knot 96 k", 2, 0, 96_000, 4),
    ],
)
def test_scenes_are_what_their_names_say(name: str, objects: int, mirrors: int, triangles: int, bounces: int) -> None:
    """``triangles`` are those of the knot or of the rings."""
    scene = frame_scene(name)
    assert (scene.camera.width, scene.camera.height) == (768, 512)
    assert (len(scene.objects), sum(entry.is_reflector for entry in scene.objects)) == (objects, mirrors)
    matt = [entry for entry in scene.objects if entry.shape in ("torus", "torus_knot") and not entry.is_reflector]
    assert sum(len(entry.geometry.faces) for entry in matt) == triangles
    assert scene.reflection.max_bounces == bounces


def test_scenes_that_are_named_are_there() -> None:
    assert {SMALL_KNOT, LARGEST, *LARGER_KNOTS, *QUICK_SCENES} <= set(FRAME_SCENES)


def test_the_camera_moves_a_little_before_every_frame() -> None:
    camera = frame_scene(SMALL_KNOT).camera
    eyes = [camera.eye, *(moved.eye for moved in islice(moving(camera), 20))]
    steps = np.linalg.norm(np.diff(eyes, axis=0), axis=1)
    np.testing.assert_allclose(steps, STEP * np.linalg.norm(camera.eye), rtol=1e-6)


def test_our_frames_are_those_of_the_moving_camera() -> None:
    scene = frame_scene("teapot", SIZE)
    frames = OurFrames(scene, "ldt", 1)
    np.testing.assert_array_equal(frames.picture, ldtrefl.render(scene, "ldt").image)
    for camera in islice(moving(scene.camera), 2):
        frames.frame()
        np.testing.assert_allclose(frames.picture, ldtrefl.render(scene.with_camera(camera), "ldt").image, atol=1e-6)
    assert {"gbuffer", "shade", "march"} <= set(frames.stages)


def test_stages_are_medians_in_milliseconds() -> None:
    frames = [{"gbuffer": 0.002}, {"gbuffer": 0.001, "peel": 0.009}, {"gbuffer": 0.004}]
    assert median_stages(frames) == {"gbuffer": pytest.approx(2.0), "peel": 0.0}


def test_another_checkout_makes_frames_by_its_own_package(tmp_path: Path) -> None:
    """A folder whose package is ours by a link makes frames; one that has none would have this package make them."""
    (tmp_path / "with").mkdir()
    (tmp_path / "without").mkdir()
    (tmp_path / "with" / "ldtrefl").symlink_to(ROOT / "ldtrefl")
    with CheckoutFrames(tmp_path / "with", "teapot", SIZE, "bvh", 1) as frames:
        assert frames.frame() > 0.0 and frames.first > 0.0
        assert "gbuffer" in frames.stages
    with pytest.raises(ldtrefl.InputError, match="is no checkout of the package"):
        CheckoutFrames(tmp_path / "without", "teapot", SIZE, "bvh", 1)


def test_a_checkout_whose_process_ends_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "ldtrefl").mkdir()
    (tmp_path / "ldtrefl" / "__init__.py").write_text("raise SystemExit(3)")
    with pytest.raises(ldtrefl.InputError, match="makes no frames: its process has ended"):
        CheckoutFrames(tmp_path, "teapot", SIZE, "ldt", 1)
    with pytest.raises(ldtrefl.InputError, match="does not render"):
        starts({"now": tmp_path}, 1, quick=True)


def frame_time(median: float, **stages: float) -> FrameTime:
    return {"milliseconds": {"median": median, "min": 1.0, "max": 99.0}, "first": 500.0, "stages": stages}


def row(**medians: float) -> FrameRow:
    """A row with ``march`` a tenth of each frame; underscores in names stand for spaces."""
    makers = {label.replace("_", " "): frame_time(median, march=median / 10) for label, median in medians.items()}
    return {
        "scene": "a scene",
        "triangles": 12,
        "size": (8, 4),
        "bounces": 4,
        "threads": 2,
        "makers": makers,
        "unlike": 0.5,
    }


def cells(lines: list[str], first: str) -> dict[str, str]:
    """The cells of the first row that begins with ``first``, by column."""
    at = next(i for i, line in enumerate(lines) if line.startswith(f"| {first} |"))
    head = max(i for i in range(at) if lines[i].startswith("|---")) - 1
    split = [[cell.strip() for cell in line.strip("|").split("|")] for line in (lines[head], lines[at])]
    return dict(zip(*split, strict=True))


def test_the_table_beside_mitsuba_has_the_ratios_that_it_names() -> None:
    beside = row(ldt=20.0, bvh=40.0, Mitsuba_llvm=80.0)
    beside["makers"][ON_SMALL_KNOT] = frame_time(16.0)
    lines = rival_frames_tables({"rival_frames": [beside, row(ldt=20.0, bvh=40.0)]})
    found = cells(lines, "a scene")
    assert found["ldt"] == "20.0 (1.0 to 99.0)" and found["Mitsuba llvm"] == "80.0 (1.0 to 99.0)"
    assert (found["ldt / bvh"], found["ldt / llvm"], found["unlike, %"]) == ("0.50", "0.25", "0.5000")
    assert found[f"ldt / {ON_SMALL_KNOT}"] == "1.25"
    assert "| a scene | ldt | 2.0 | 500 |" in lines
    assert "Pixels: 8 x 4." in lines


def test_the_table_beside_another_checkout_has_ratios_of_medians() -> None:
    beside = row(ldt=20.0, ldt_before=50.0, bvh=30.0, bvh_before=40.0)
    found = cells(frames_before_tables({"frames_before": [beside]}), "a scene")
    assert (found["ldt / before"], found["bvh / before"], found["ldt / bvh"]) == ("0.40", "0.75", "0.67")
    assert (found["march / before"], found["shade / before"]) == ("0.40", "-")


def test_starts_of_two_checkouts_are_compared() -> None:
    times = {"now": {"median": 3.0, "min": 1.0, "max": 9.0}, "before": {"median": 4.0, "min": 1.0, "max": 9.0}}
    found = cells(start_table({"start": [{"what": "warm", "checkouts": times}]}), "warm")
    assert found["now / before"] == "0.75"
    alone = start_table({"start": [{"what": "warm", "checkouts": {"now": times["now"]}}]})
    assert cells(alone, "warm") == {"": "warm", "now": "3.0 (1.0 to 9.0)"}


def test_the_tool_compares_checkouts_scene_by_scene(tmp_path: Path) -> None:
    command = [sys.executable, str(TOOL), "--quick", "--before", str(ROOT), "--rounds", "1", "-o", str(tmp_path)]
    command += ["--only", "rival-frames", "--scenes", "no mirror, knot 96 k"]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300, env=dict(os.environ))
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "benchmark.json").read_text())
    (found,) = result["frames_before"]
    assert set(found["makers"]) == {"ldt", "ldt before", "bvh", "bvh before"}
    assert "ldt / before" in (tmp_path / "benchmark.md").read_text()


def test_parts_that_are_not_measured_beside_a_checkout_are_refused() -> None:
    command = [sys.executable, str(TOOL), "--before", str(ROOT), "--only", "rays"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 2
    assert "unknown part 'rays', allowed are rival-frames; start" in done.stderr
