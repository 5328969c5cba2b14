"""Lights: what goes with each kind, and how a rectangle stands."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.lights import KEYS, Light, Lighting, Occlusion

GIVEN = {
    "direction": (0, 0, -1),
    "radiance": 1.0,
    "position": (0, 0, 3),
    "intensity": 2.0,
    "radius": 0.5,
    "width": 1.0,
    "height": 2.0,
}


@pytest.mark.parametrize("kind", KEYS)
def test_each_kind_has_its_own_keys(kind: str) -> None:
    needed, allowed = KEYS[kind]
    given = {key: GIVEN[key] for key in needed}
    assert Light(kind=kind, **given).kind == kind
    for missing in needed:
        fewer = {key: value for key, value in given.items() if key != missing}
        with pytest.raises(ldtrefl.InputError, match=f"a {kind} light needs '{missing}'"):
            Light(kind=kind, **fewer)
    others = {"outer_angle": 30.0, "inner_angle": 5.0, "samples": 4, "visible": False, "up": (0, 1, 0), **GIVEN}
    for key, value in others.items():
        if key not in needed and key not in allowed:
            with pytest.raises(ldtrefl.InputError, match=f"a {kind} light has no '{key}'"):
                Light(kind=kind, **given, **{key: value})
    for key in allowed:
        assert Light(kind=kind, **given, **{key: others[key]}) is not None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"inner_angle": 50.0}, "inner_angle 50 should be at most outer_angle, 45"),
        ({"outer_angle": 91.0}, "outer_angle: should be less than or equal to 90"),
        ({"samples": 0}, "samples: should be greater than or equal to 1"),
        ({"radius": -1.0}, "radius: should be from 1e-15"),
    ],
)
def test_wrong_values_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=message):
        Light(kind="spot", position=(0, 0, 3), direction=(0, 0, -1), intensity=1.0, **changes)


@pytest.mark.parametrize("direction", [(0, 0, -1), (0, 0, 1), (1, 2, -3), (-1, 0, 0), (0.001, 0, -1)])
@pytest.mark.parametrize("up", [None, (0, 0, 1), (1, 2, -3), (0, -1, 0)])
def test_a_rectangle_stands_upright(direction: tuple[float, ...], up: tuple[float, ...] | None) -> None:
    given = {"position": (0, 0, 3), "width": 1.0, "height": 2.0, "radiance": 1.0}
    axes = Light(kind="rectangle", direction=direction, up=up, **given).axes
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[2] @ direction == pytest.approx(np.linalg.norm(direction))
    wanted = np.array((0, 0, 1) if up is None else up, float)
    if np.linalg.norm(np.cross(wanted, direction)) > 0.1 * np.linalg.norm(direction):
        assert axes[1] @ wanted > 0.0 and axes[0] @ wanted == pytest.approx(0.0, abs=1e-12)


def test_what_asks_rays() -> None:
    assert not Lighting().is_traced
    assert Lighting(shadows=True).is_traced and Lighting(occlusion=Occlusion(distance=1.0)).is_traced
    with pytest.raises(ldtrefl.InputError, match=r"Lighting: occlusion.distance: should be from 1e-15"):
        Lighting(occlusion={"distance": 0.0})


def test_a_scene_file_may_have_all_of_it(tmp_path) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "lit.toml"
    text = """
        camera = { eye = [0, -5, 0], look_at = [0, 0, 0] }
        lighting = { occlusion = { distance = 0.5, samples = 4 } }
        light = [
            { kind = "sphere", position = [0, 0, 3], radius = 0.5, radiance = 2 },
            { kind = "rectangle", position = [0, 0, 3], direction = [0, 0, -1], width = 1, height = 2, radiance = 3 },
            { kind = "spot", position = [0, 0, 3], direction = [0, 0, -1], intensity = 3, outer_angle = 20 },
        ]
    """
    path.write_text(text)
    scene = ldtrefl.load_scene(path)
    assert [light.kind for light in scene.lights] == ["sphere", "rectangle", "spot"]
    assert scene.lighting.occlusion == Occlusion(distance=0.5, samples=4)
    path.write_text(text.replace("distance", "distanse"))
    with pytest.raises(ldtrefl.InputError, match=r"unknown key 'distanse'; did you mean 'distance'"):
        ldtrefl.load_scene(path)
    path.write_text(text.replace("radius", "radios"))
    with pytest.raises(ldtrefl.InputError, match=r"unknown key 'radios'; did you mean 'radius'"):
        ldtrefl.load_scene(path)
