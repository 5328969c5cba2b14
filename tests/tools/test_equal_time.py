"""Pictures in equal time: the table by hand, and a small scene by both where Mitsuba is."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from equal_time import MitsubaSampled, Row, table
from mitsuba_parts.emission_only import emission_only

import ldtrefl

SCENE = Path(__file__).parent.parent.parent / "scenes" / "two_balls.toml"


def test_the_table_has_a_cell_for_every_column() -> None:
    rows = [Row("a", 10.0, 1.25, error, 12.0, 1, 0.02) for error in (0.009, 0.011)]
    lines = table(rows).splitlines()
    assert len({line.count("|") for line in lines}) == 1
    assert "0.45" in lines[2] and "**beyond**" not in lines[2]
    assert "0.55" in lines[3] and "**beyond**" in lines[3]


@pytest.mark.usefixtures("with_mitsuba")
def test_both_have_the_same_picture_of_many_samples() -> None:
    """The same filter, camera and brightness: with half a pixel's shift or another filter the edges would differ."""
    scene = emission_only(ldtrefl.load_scene(SCENE))
    scene = scene.with_camera(dataclasses.replace(scene.camera, width=96, height=64))
    ours = ldtrefl.render(scene, "bvh", samples=256, adaptive=False).image
    theirs = MitsubaSampled(scene).truth(scene.camera, 512)
    assert np.abs(ours - theirs).mean() < 2e-3
    shifted = np.roll(ours, 1, axis=1)
    assert np.abs(shifted - theirs).mean() > 1e-2
