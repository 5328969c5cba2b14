"""What a scene may say of its environment."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.description import AMBIENT, Camera, Environment, Lighting, Scene
from ldtrefl.scene.presets.sky import sky
from ldtrefl.scene.presets.soft_boxes import studio

CAMERA = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"image": "a.exr", "preset": "sky"}, "'image' and 'preset' exclude each other"),
        ({"preset": "night"}, "preset: .*'studio', 'sky' or 'sunset'"),
        ({"preset": "sky", "ground": 0.1}, "'sky' and 'ground' do not go with 'preset'"),
        ({"rotation": 10.0}, "'rotation' and 'strength' go with 'image' or 'preset'"),
        ({"strength": 2.0}, "'rotation' and 'strength' go with 'image' or 'preset'"),
        ({"preset": "studio", "turbidity": 3.0}, "'turbidity' goes with the presets sky and sunset"),
        ({"sun_azimuth": 0.0}, "'sun_azimuth' goes with the presets sky and sunset"),
        ({"preset": "sky", "sun_elevation": -1.0}, "sun_elevation"),
        ({"preset": "sky", "sun_elevation": 91.0}, "sun_elevation"),
        ({"preset": "sky", "turbidity": 1.0}, "turbidity"),
        ({"preset": "sky", "ground_albedo": 1.5}, "ground_albedo"),
        ({"preset": "sky", "strength": -1.0}, "strength"),
        ({"preset": "sky", "rotation": float("nan")}, "rotation"),
        ({"preset": "sky", "sun_direction": (0, 0, 1)}, "sun_direction"),
    ],
)
def test_what_is_not_allowed_is_refused(values: dict, message: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=message):
        Environment(**values)


def test_a_preset_has_its_picture() -> None:
    made = Environment(preset="sky", sun_elevation=30.0, sun_azimuth=10.0, turbidity=4.0, ground_albedo=0.2)
    assert made.surroundings is sky(30.0, 10.0, 4.0, (0.2, 0.2, 0.2))
    assert made.picture is made.surroundings.picture
    assert Environment(preset="studio").surroundings is studio()
    assert Environment().picture is None and Environment().surroundings is None


def test_sunset_is_a_sky_with_a_low_sun() -> None:
    day, evening = (Environment(preset=preset).surroundings for preset in ("sky", "sunset"))
    assert day is not None and evening is not None
    assert evening.lights[0].towards[2] < 0.2 < 0.6 < day.lights[0].towards[2]
    low = Environment(preset="sky", sun_elevation=8.0, sun_azimuth=-15.0, turbidity=2.8)
    assert low.surroundings is evening


def test_ambient_light_is_the_presets_unless_the_scene_says_otherwise() -> None:
    preset = Environment(preset="studio", strength=0.5)
    np.testing.assert_allclose(Scene(camera=CAMERA, environment=preset).ambient, 0.5 * np.array(studio().ambient))
    said = Scene(camera=CAMERA, environment=preset, lighting=Lighting(ambient=0.3))
    assert said.ambient == (0.3, 0.3, 0.3)
    assert Scene(camera=CAMERA).ambient == AMBIENT
    assert dataclasses.replace(said, lighting=Lighting(shadows=True)).ambient == pytest.approx(
        tuple(0.5 * value for value in studio().ambient)
    )


def test_it_is_read_from_a_file(tmp_path: Path) -> None:
    text = "[camera]\neye = [0.0, -5.0, 0.0]\nlook_at = [0.0, 0.0, 0.0]\n[environment]\n"
    path = tmp_path / "scene.toml"
    path.write_text(text + 'preset = "sunset"\nrotation = 30\nstrength = 0.5\nsun_elevation = 5.0\n')
    assert ldtrefl.load_scene(path).environment == Environment(
        preset="sunset", rotation=30.0, strength=0.5, sun_elevation=5.0
    )
    for wrong, message in (
        ('preset = "sky"\nimage = "a.exr"', r"scene\.toml: environment: 'image' and 'preset' exclude each other"),
        (
            'preset = "sky"\nsunelevation = 3.0',
            r"scene\.toml: environment: unknown key 'sunelevation'; did you mean 'sun_elevation'",
        ),
        ("sun_elevation = 3.0", r"scene\.toml: environment: 'sun_elevation' goes with"),
    ):
        path.write_text(text + wrong + "\n")
        with pytest.raises(ldtrefl.InputError, match=message):
            ldtrefl.load_scene(path)
