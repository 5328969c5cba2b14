"""The papers' tables: what they are measured with, and a part of them on small pictures."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
from paper_parts.ours import alhazen, in_texels
from paper_parts.roger import searched
from paper_parts.scenes import approach, eight_eyes, paper_scene, room_of
from paper_parts.table import Table, markdown
from paper_parts.tessellated import holes

from ldtrefl.frame.result import Frame
from ldtrefl.scene.description import Camera
from tests.methods.virtual.reflection_on_ball import is_hidden, reflection_points, unit

ROOT = Path(__file__).parent.parent.parent


def test_alhazens_quartic_finds_what_bisection_finds() -> None:
    rng = np.random.default_rng(3)
    eye = np.array([0.4, -3.0, 1.1])
    points = unit(rng.normal(size=(2000, 3))) * rng.uniform(1.01, 6.0, (2000, 1))
    found, is_shown = alhazen(np.broadcast_to(eye, points.shape), points)
    hidden = is_hidden(eye, points)
    np.testing.assert_array_equal(is_shown, ~hidden)
    np.testing.assert_allclose(found[is_shown], reflection_points(eye, points)[is_shown], atol=1e-9)


def test_texels_are_the_cameras() -> None:
    """A point at the upper right corner of a picture of 100 x 100, 45 degrees to each side."""
    camera = Camera(eye=(0.0, -2.0, 0.0), look_at=(0.0, 0.0, 0.0), fov_y=90.0, width=100, height=100)
    np.testing.assert_allclose(in_texels(camera, np.array([[2.0, 0.0, 2.0]])), [[50.0, -50.0]])


def test_all_points_that_a_ball_shows_are_found() -> None:
    rng = np.random.default_rng(5)
    points = unit(rng.normal(size=(1000, 3))) * rng.uniform(1.05, 6.0, (1000, 1))
    degrees, iterations, share = searched(points)
    assert share > 0.999 and len(degrees) == len(iterations) == (~is_hidden(np.array([5.0, 0.0, 0.0]), points)).sum()
    assert iterations.min() >= 1 and degrees.max() <= 90.0


def test_a_hole_shows_what_is_behind_between_what_is_before() -> None:
    def frame(objects: list[int], distances: list[float]) -> Frame:
        hits = SimpleNamespace(object=np.array([objects]), distance=np.array([distances]))
        return cast(Frame, SimpleNamespace(hits=hits))

    near = [1.0] * 5
    truth = frame([2, 2, 2, 2, 3], near)
    assert holes(truth, truth) == 0
    assert holes(frame([2, -1, 2, 2, 3], [1.0, np.inf, 1.0, 1.0, 1.0]), truth) == 1
    assert holes(frame([2, 3, 2, 2, 3], [1.0, 5.0, 1.0, 1.0, 1.0]), truth) == 1
    assert holes(frame([2, 3, 2, 2, 3], [1.0, 0.5, 1.0, 1.0, 1.0]), truth) == 0  # something before it
    assert holes(frame([2, 2, 2, -1, 3], [1.0, 1.0, 1.0, np.inf, 1.0]), truth) == 0  # at the border


def test_scenes_are_as_the_papers_say() -> None:
    kitchen = paper_scene("paper/kitchen", quick=False)
    count = sum(len(each.geometry.vertices) for each in kitchen.objects if not each.is_reflector)
    assert abs(count - 14_979) < 200 and sum(each.is_reflector for each in kitchen.objects) == 1
    assert sum(each.is_reflector for each in eight_eyes(quick=True).objects) == 8
    assert abs(len(room_of(10_000, quick=True).objects[1].geometry.faces) - 10_000) < 500
    first, *_, last = approach(kitchen.camera, (2.0, 1.0), 5)
    np.testing.assert_allclose(last.eye, kitchen.camera.eye)
    far, near = (np.subtract(each.eye, kitchen.camera.look_at) for each in (first, last))
    np.testing.assert_allclose(far, 2.0 * near)


def test_a_table_has_a_cell_for_every_column() -> None:
    table = Table("T", "a GPU", "words", ["a", "b", "c", "d"], [["x", 12345, 0.5, None], ["y", 1, 1234.5, 20.25]])
    lines = markdown(table).splitlines()
    assert lines[-2:] == ["| x | 12,345 | 0.5000 | - |", "| y | 1 | 1,234 | 20.2 |"]
    assert "Theirs: a GPU." in lines


def test_a_part_is_written_whole(tmp_path: Path) -> None:
    tool = [sys.executable, "tools/paper_tables.py", "--quick", "--only", "szabo", "-o", str(tmp_path)]
    subprocess.run(tool, cwd=ROOT, check=True, capture_output=True)
    tables = json.loads((tmp_path / "paper_tables.json").read_text())
    page = (tmp_path / "paper_tables.md").read_text()
    assert [table["title"] in page for table in tables] == [True, True]
    by_threshold = {row[0]: row for row in tables[0]["rows"]}
    assert by_threshold["1"][2] < by_threshold["0.001"][2]  # SSIM
    assert by_threshold["1"][3] < by_threshold["0.001"][3] < by_threshold["0"][3]  # vertices
    assert {len(row) for row in tables[1]["rows"]} == {len(tables[1]["columns"])}
