"""The comparison with Mitsuba: what is judged, against counts by hand, and what Mitsuba is given, where it is."""

from __future__ import annotations

import dataclasses
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mitsuba_comparison import table
from mitsuba_parts.emission_only import emission_only
from mitsuba_parts.judge import Judgement, judgement
from mitsuba_parts.mirror_paths import MirrorPaths, MitsubaPictures
from mitsuba_parts.pixel_rays import SMALL_LIFT
from picture_edges import near_edge

import ldtrefl
from ldtrefl.files.picture_reading import stored_picture
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene
from ldtrefl.scene.mesh import Part
from ldtrefl.scene.surface_material import SurfaceMaterial
from tests.part_materials import textured

ROOT = Path(__file__).parent.parent.parent
TOOL = ROOT / "tools" / "mitsuba_comparison.py"
BRICKS = str(ROOT / "scenes" / "textures" / "bricks.png")

CLOSE = 1e-3
"""Radiance by which pixels that see no edge may differ: float32 moves a picture of bricks by a hundredth of a texel."""


def of_everything() -> Scene:
    """What differs between renderers most easily: an unusual ``up``, stretched and facetted mirrors, textures, parts of
    a mesh, and a sheet seen from behind."""
    quad = shapes.make("plane")
    halves = (
        Part(0, SurfaceMaterial(base_color=(1.0, 0.5, 0.2))),
        Part(1, textured(stored_picture(BRICKS), (0.3, 1.0, 0.6))),
    )
    parted = ldtrefl.Mesh(quad.vertices, quad.faces, quad.normals, quad.uvs, halves)
    bricks, mirror = Material(albedo=(0.9, 0.8, 1.0), texture=BRICKS), (0.9, 0.7, 0.5)
    return Scene(
        camera=Camera(eye=(0.3, 2.0, -6.0), look_at=(0.2, 0, 0), up=(0.1, 1, 0), width=192, height=128, fov_y=38),
        environment=Environment(sky=(0.2, 0.5, 1.0), ground=(0.6, 0.2, 0.1)),
        lights=(Light(kind="directional", direction=(0, -1, 0), radiance=(3, 3, 3)),),
        objects=(
            Object(shape="sphere", scale=(1.0, 0.6, 0.8), translate=(-1, 0, 0), material=Material(mirror=mirror)),
            Object(
                shape="sphere",
                params={"segments": [12, 6]},
                smooth=False,
                translate=(1.3, 0, 0),
                material=Material(mirror=mirror, fresnel=True, emission=(0.1, 0, 0.2)),
            ),
            Object(shape="plane", scale=4.0, rotate=(1, 0, 0, 90), translate=(0, -1.1, 0), material=bricks),
            Object(mesh=parted, scale=0.5, rotate=(0, 1, 0, 30), translate=(0.1, 0.6, -1.5)),
        ),
    )


def test_pixels_are_counted_once() -> None:
    """A row of twelve: no mirror, an edge that shows what is beside it, below a facet, then those judged, of which two
    are off and one is not finite. From where Mitsuba lets rays start all are brighter, and all of ours are off."""
    surfaces = np.full((1, 12, 2), 7, np.uint32)
    surfaces[0, 0, 0] = 0
    mirrors = np.array([[0, 1, 1, 1, 2, 2, 1, 1, 1, 1, 1, 1]], np.uint32)
    below = np.zeros((1, 12), bool)
    below[0, 4:6] = True
    radiance, beyond = np.full((1, 12, 3), 0.25, np.float32), np.full((1, 12, 3), 0.25, np.float32)
    picture = np.full((1, 12, 3), 0.51, np.float32)
    radiance[0, 2] = 0.37
    picture[0, 1:3] = 0.62
    picture[0, (0, 4), 2] = 0.6
    picture[0, (7, 8), 1] = 0.47
    picture[0, 9] = np.nan
    paths = MirrorPaths(surfaces, radiance, beyond, mirrors, below)
    made = judgement("row", picture, paths, dataclasses.replace(paths, beyond=beyond + 0.04), radiance + 1.0)
    assert made == Judgement("row", 11, 2, 2, 1, 1, 5, 3, 8, 3, 8, 1.0) and not made.passed


@pytest.mark.parametrize(
    "unlike, judged, off, passes", [(2, 1000, 2, True), (3, 1000, 2, False), (2, 1000, 3, False), (0, 0, 0, False)]
)
def test_a_scene_passes_with_two_pixels_in_a_thousand(unlike: int, judged: int, off: int, passes: bool) -> None:
    counts = Judgement("row", 1000, 0, 0, 0, 0, 900, unlike, judged, off, 900, 0.0)
    assert counts.passed is passes


def test_the_table_has_a_cell_for_every_column() -> None:
    lines = table(
        [Judgement("row", 11, 2, 2, 1, 1, 5, 3, 8, 3, 3, 1.0), Judgement("none", *[0] * 10, 0.0)]
    ).splitlines()
    assert len({line.count("|") for line in lines}) == 1
    assert "37.5000" in lines[2] and "**beyond**" in lines[2]


def test_surfaces_radiate_and_mirror_and_do_nothing_else() -> None:
    """What an emission-only scene shows, by hand: albedo and emission under any light, and reflectance at any angle."""
    camera = Camera(eye=(0, -1, 1), look_at=(0, 0, 0), width=5, height=5, fov_y=20)
    light = Light(kind="directional", direction=(0, 0, -1), radiance=(1, 1, 1))
    glass = Material(albedo=(0.1, 0.2, 0.3), emission=(0.2, 0, 0), mirror=(0.5, 0.5, 0.5), fresnel=True)
    given = Scene(
        camera=camera,
        environment=Environment(sky=(0.6, 0.6, 0.6), ground=(0.6, 0.6, 0.6)),
        lighting=Lighting(shadows=True),
        lights=(light,),
        objects=(Object(shape="plane", scale=9.0, material=glass), Object(shape="box", translate=(0, 0, 3))),
    )
    image = ldtrefl.render(emission_only(given), "bvh").image
    np.testing.assert_allclose(image, np.broadcast_to([0.6, 0.5, 0.6], image.shape), rtol=1e-6)


@pytest.mark.usefixtures("with_mitsuba")
def test_mitsuba_sees_the_same_scene() -> None:
    """Every pixel that sees no edge and no ray below a facet, those beside the mirrors too."""
    scene = emission_only(of_everything())
    pictures = MitsubaPictures(scene)
    paths = pictures.followed(1, SMALL_LIFT)
    ours = ldtrefl.render(scene, "bvh", max_bounces=1)
    clear = ~near_edge(paths.surfaces) & ~paths.leaves_below
    assert len(np.unique(paths.surfaces[..., 0])) == len(scene.objects) + 2  # a mesh of two parts, and the environment
    assert clear.mean() > 0.8
    np.testing.assert_array_equal(ours.reflector_mask[clear], paths.mirrors[clear] > 0)
    difference = np.abs(ours.image - paths.radiance - paths.beyond).max(axis=-1)
    assert difference[clear].max() <= CLOSE, f"{(difference[clear] > CLOSE).sum()} pixels differ"
    spawned = pictures.followed(1, None)
    np.testing.assert_allclose(pictures.by_path_integrator(1), spawned.radiance, atol=1e-6)


@pytest.mark.usefixtures("with_mitsuba")
def test_mirrors_beyond_the_limit_show_the_environment() -> None:
    """Between parallel mirrors that glow, the sum of the bounces, and then the environment alone."""
    glowing = Material(albedo=(0, 0, 0), emission=(0.2, 0.2, 0.2), mirror=(0.5, 0.5, 0.5))
    scene = Scene(
        camera=Camera(eye=(0, 0, 0), look_at=(0.1, 0, -1), width=4, height=4, fov_y=10),
        environment=Environment(sky=(0.8, 0.8, 0.8), ground=(0.8, 0.8, 0.8)),
        objects=tuple(Object(shape="plane", scale=50.0, translate=(0, 0, z), material=glowing) for z in (-1, 1)),
    )
    paths = MitsubaPictures(scene).followed(3, SMALL_LIFT)
    np.testing.assert_allclose(paths.radiance, 0.2 * (1 + 0.5 + 0.25 + 0.125), rtol=1e-5)
    np.testing.assert_allclose(paths.beyond, 0.5**4 * 0.8, rtol=1e-5)
    assert (paths.mirrors == 4).all()


@pytest.mark.usefixtures("with_mitsuba")
@pytest.mark.parametrize("degrees, below", [(44, False), (46, True)])
def test_rays_below_their_triangle_are_found(degrees: float, below: bool) -> None:
    """Seen from straight above, a normal turned by more than 45 degrees mirrors downwards; turned the other way round,
    as on a mesh wound inwards, it is the same."""
    plane, angle = shapes.make("plane"), np.radians(degrees)
    for sign in (1.0, -1.0):
        normals = np.tile(sign * np.array([np.sin(angle), 0.0, np.cos(angle)]), (len(plane.vertices), 1))
        mirror = Object(mesh=plane.with_normals(normals), material=Material(mirror=(1, 1, 1)))
        camera = Camera(eye=(0, 0, 3), look_at=(0, 0, 0), up=(0, 1, 0), width=3, height=3, fov_y=0.1)
        paths = MitsubaPictures(Scene(camera=camera, objects=(mirror,))).followed(1, SMALL_LIFT)
        assert (paths.leaves_below == below).all()


@pytest.mark.usefixtures("with_mitsuba")
def test_the_tool_writes_its_table(tmp_path: Path) -> None:
    command = [sys.executable, str(TOOL), "--quick", "--only", "two_balls", "-o", str(tmp_path)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    (row,) = json.loads((tmp_path / "mitsuba.json").read_text())
    assert row["scene"] == "two_balls" and row["judged"] > 3000 and row["off"] == 0
    assert "| two_balls | " in (tmp_path / "mitsuba.md").read_text()


def test_without_mitsuba_the_tool_says_so_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "mitsuba.py").write_text("raise ImportError('none here')")
    paths = os.pathsep.join([str(tmp_path), str(ROOT), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, str(TOOL), "--only", "wall"]
    done = subprocess.run(command, check=False, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": paths})
    assert done.returncode == 1
    assert done.stderr.startswith("mitsuba_comparison.py: Mitsuba cannot be used here (ImportError: none here); pip ")
    assert done.stderr.count("\n") == 1
