"""The comparison of materials with Mitsuba: its figures by hand; what Mitsuba is given and all scenes, where it is."""

from __future__ import annotations

import dataclasses
import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mitsuba_materials import FILES, QUICK_WIDTH, SCENES, Likeness, Row, compared, likeness, made, table
from mitsuba_parts.lit_pictures import LitPictures
from mitsuba_parts.material_scenes import BLACK, UNSHADOWED, balls, principled
from mitsuba_parts.mitsuba_scene import mitsuba
from mitsuba_parts.two_plugins import COSINES, Layers, Surface, bsdf_of, reflected_once

import ldtrefl
from ldtrefl.scene.description import Camera, Light, Material, Object, Scene
from ldtrefl.world.reflectance_table import COLUMNS, ROWS, reflectance_table

ROOT = Path(__file__).parent.parent.parent
TOOL = ROOT / "tools" / "mitsuba_materials.py"


def test_likeness_is_counted_by_hand() -> None:
    """A picture that is brighter by a tenth, and one with a pixel of no object."""
    theirs, sees = np.full((16, 16, 3), 0.5, np.float32), np.ones((16, 16), bool)
    found = likeness(1.1 * theirs, theirs, sees)
    assert found.difference == pytest.approx(0.1, rel=1e-5) and 0.98 < found.ssim < 1.0 and not found.passed
    same = likeness(theirs, theirs, sees)
    assert same == Likeness(1.0, 0.0) and same.passed


def test_the_table_has_a_cell_for_every_column() -> None:
    rows = [Row("a", "b", "c", Likeness(0.5, 0.5), Likeness(*values)) for values in ((0.99, 0.01), (0.9, 0.01))]
    lines = table(rows).splitlines()
    assert len({line.count("|") for line in lines}) == 1
    assert "0.9900 | 1.00" in lines[2] and "**beyond**" not in lines[2] and "**beyond**" in lines[3]


@pytest.mark.usefixtures("with_mitsuba")
def test_lights_are_as_bright_as_ours() -> None:
    """A white sheet in the light of a direction, at an angle, and of a point above it."""
    scene = Scene(
        camera=Camera(eye=(0, 0, 3), look_at=(0, 0, 0), up=(0, 1, 0), width=3, height=3, fov_y=0.1),
        lighting=UNSHADOWED,
        lights=(
            Light(kind="directional", direction=(0.8, 0, -0.6), radiance=(0.5, 1.0, 2.0)),
            Light(kind="point", position=(0, 0, 2), intensity=(4.0, 2.0, 1.0)),
        ),
        objects=(Object(shape="plane", material=Material(albedo=(0.5, 0.5, 0.5))),),
    )
    half = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}
    theirs, sees = LitPictures(scene, lambda *_: Surface(half), is_layered=False).render(1)
    right = 0.5 * (0.6 * np.array([0.5, 1.0, 2.0]) + np.array([1.0, 0.5, 0.25]))
    assert sees.all()
    for image in (theirs, ldtrefl.render(scene, "bvh").image):
        np.testing.assert_allclose(image, np.broadcast_to(right, image.shape), rtol=1e-4)


@pytest.mark.usefixtures("with_mitsuba")
@pytest.mark.parametrize("row", [4, 8, 12, 16])
def test_microfacets_reflect_as_much_as_our_table_says(row: int) -> None:
    """Of light from everywhere, once."""
    ours = reflectance_table().reshape(ROWS, COLUMNS, 3)[row, :, :2].sum(axis=1)
    theirs = reflected_once(row / (ROWS - 1))
    found = np.interp(np.linspace(0, 1, COSINES), (np.arange(COLUMNS) / (COLUMNS - 1)) ** 2, ours)
    np.testing.assert_allclose(found[8:], theirs[8:], atol=3e-3)


@pytest.mark.usefixtures("with_mitsuba")
@pytest.mark.parametrize("metallic", [0, 1])
def test_what_is_put_together_gives_back_all_light(metallic: int) -> None:
    """A white furnace: Mitsuba's microfacets and base with their factors, added up over the hemisphere."""
    mi, dr = mitsuba(), importlib.import_module("drjit")
    white = {"type": "rgb", "value": [1.0, 1.0, 1.0]}
    if metallic:
        plugin = {"type": "principled", "base_color": white, "metallic": 1.0, "roughness": 0.6}
        layers = Layers(0.6, (1.0, 1.0, 1.0), plugin)
    else:
        plugin = {"type": "principled", "base_color": BLACK, "roughness": 0.6, "eta": 1.5}
        layers = Layers(0.6, (0.04, 0.04, 0.04), plugin, {"type": "diffuse", "reflectance": white})
    bsdf = bsdf_of(Surface(plugin, layers=layers), is_layered=True)
    height, turn = (grid.ravel() for grid in np.meshgrid((np.arange(400) + 0.5) / 400, (np.arange(400) + 0.5) / 400))
    out = np.sqrt(1.0 - height**2)
    wo = mi.Vector3f(out * np.cos(2 * np.pi * turn), out * np.sin(2 * np.pi * turn), height)
    for cosine in (0.2, 0.6, 1.0):
        met = dr.zeros(mi.SurfaceInteraction3f, len(height))
        met.wi = mi.Vector3f(float(np.sqrt(1.0 - cosine**2)), 0.0, cosine)
        total = 2 * np.pi * np.array(bsdf.eval(mi.BSDFContext(), met, wo)).mean(axis=1)
        np.testing.assert_allclose(total, 1.0, atol=5e-3)


@pytest.mark.usefixtures("with_mitsuba")
@pytest.mark.parametrize("name", [*SCENES, *FILES])
def test_scenes_are_as_by_mitsuba(name: str) -> None:
    case = made(name, QUICK_WIDTH)
    if case is None:
        pytest.skip(f"{name} is not in LDTREFL_MESH_PATH")
    row = compared(name, case)
    assert row.of_layers.passed, f"{name}: {row}"


@pytest.mark.usefixtures("with_mitsuba")
def test_metals_differ_by_no_model() -> None:
    """Both have Schlick's reflectance. Were ours masked by separable Smith, they would differ by a hundredth."""
    assert compared("metals", SCENES["metals"](QUICK_WIDTH)).of_layers.difference < 2e-3


@pytest.mark.usefixtures("with_mitsuba")
@pytest.mark.parametrize(
    "changes", [{"roughness": 0.5}, {"albedo": (0.9, 0.6, 0.2)}, {"metallic": 0.9}], ids=["rougher", "darker", "dull"]
)
def test_other_materials_are_told_apart(changes: dict[str, object]) -> None:
    right = Material(albedo=(1.0, 0.7, 0.3), metallic=1.0, roughness=0.45)
    case = dataclasses.replace(SCENES["metals"](QUICK_WIDTH), scene=balls([[right]], 96))
    assert compared("ball", case).of_layers.passed
    wrong = balls([[dataclasses.replace(right, **changes)]], 96)  # type: ignore[arg-type]
    given = dataclasses.replace(case, scene=wrong, surface_of=lambda _, part: principled(case.scene.objects[0], part))
    assert not compared("ball", given).of_layers.passed


@pytest.mark.usefixtures("with_mitsuba")
def test_the_tool_writes_its_table(tmp_path: Path) -> None:
    command = [sys.executable, str(TOOL), "--quick", "--only", "highlights", "-o", str(tmp_path)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    (row,) = json.loads((tmp_path / "mitsuba_materials.json").read_text())
    assert row["scene"] == "highlights" and row["of_layers"]["ssim"] > 0.98
    assert "| highlights | " in (tmp_path / "mitsuba_materials.md").read_text()


def test_without_mitsuba_the_tool_says_so_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "mitsuba.py").write_text("raise ImportError('none here')")
    paths = os.pathsep.join([str(tmp_path), str(ROOT), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, str(TOOL), "--only", "metals"]
    done = subprocess.run(command, check=False, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": paths})
    assert done.returncode == 1
    assert done.stderr.startswith("mitsuba_materials.py: Mitsuba cannot be used here (ImportError: none here); pip ")
    assert done.stderr.count("\n") == 1
