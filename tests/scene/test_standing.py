"""``place = "floor"``: objects that stand on what is under them."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl import Mesh, Object
from ldtrefl.scene.standing import on_the_floor, split_standing
from tests.conftest import SMALL_SCENE

Z = np.array([0.0, 0.0, 1.0])
THING = Object(name="thing", shape="sphere", params={"segments": [64, 32]}, scale=0.5)
"""A ball of radius 1/2 about the origin."""


def lowest(under: list[Object], thing: Object = THING, up: np.ndarray = Z) -> float:
    """The height at which an object stands."""
    moved = on_the_floor([thing, *under], [0], up)[0]
    matrix = moved.world_from_object()
    return float(((moved.geometry.vertices @ matrix[:3, :3].T + matrix[:3, 3]) @ up / np.linalg.norm(up)).min())


def plane(height: float, **more: object) -> Object:
    return Object(shape="plane", translate=(0.0, 0.0, height), **more)  # type: ignore[arg-type]


def test_it_stands_on_the_highest_of_what_is_under_it() -> None:
    assert lowest([plane(-3.0), plane(-1.0), plane(-2.0)]) == pytest.approx(-1.0, abs=1e-12)


def test_it_is_lifted_out_of_what_it_sinks_into() -> None:
    assert lowest([plane(0.3)]) == pytest.approx(0.3, abs=1e-12)


def test_what_rises_above_it_is_not_under_it() -> None:
    lamp, wall = plane(2.0), plane(0.0, rotate=(0.0, 1.0, 0.0, 90.0), scale=5.0)
    taller = Object(shape="box", scale=(0.5, 0.5, 2.0), translate=(0.8, 0.0, 0.0))
    assert lowest([lamp, wall, taller, plane(-1.0)]) == pytest.approx(-1.0, abs=1e-12)


def test_of_a_room_it_stands_on_the_floor() -> None:
    """Its ceiling is above the top of the ball, its walls go up beside it."""
    room = Object(shape="room", scale=3.0, translate=(-2.7, 0.0, 1.0))
    assert lowest([room]) == pytest.approx(-2.0, abs=1e-12)


def test_what_is_beside_it_is_not_under_it() -> None:
    beside = Object(shape="box", scale=0.2, translate=(0.8, 0.0, -0.5))
    assert lowest([beside, plane(-1.0)]) == pytest.approx(-1.0, abs=1e-12)


def test_with_nothing_under_it_it_stands_at_height_0() -> None:
    assert lowest([]) == pytest.approx(0.0, abs=1e-12)
    assert lowest([Object(shape="box", translate=(9.0, 0.0, -2.0))]) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("corners", "height"),
    [
        # Over all of the box, z = -1.5 + x / 18: at two of the box's corners.
        ([[-9.0, -9, -2], [9, -9, -1], [0, 9, -1.5]], -1.5 + 0.5 / 18.0),
        ([[0.0, 0, -1], [0.1, 0, -2], [0, 0.1, -3]], -1.0),  # inside it: at the triangle's own
        ([[0.0, 0, -2], [1.5, 0, -0.5], [0, 0.1, -2]], -1.5),  # at 0.5, where its edge leaves the box
        ([[0.0, -9, -1], [0, 9, -1], [0, 0, -2]], -1.0),  # on edge, as seen from above
    ],
)
def test_a_slope_counts_where_it_is_highest_in_the_box(corners: list[list[float]], height: float) -> None:
    """The box reaches from -1/2 to 1/2 in x and y."""
    slope = Object(mesh=Mesh(corners, [[0, 1, 2]]))
    assert lowest([slope]) == pytest.approx(height, abs=1e-12)
    flipped = Object(mesh=Mesh(corners, [[0, 2, 1]]))
    assert lowest([flipped]) == pytest.approx(height, abs=1e-12)


def test_it_stands_on_a_ball_under_its_side() -> None:
    """Half a ball's width to the side of another of radius 2, the box's corner at (0.5, 0.5) is over the middle."""
    thing = Object(shape="box", scale=0.5, translate=(0.5, 0.5, 3.0))
    ball = Object(shape="sphere", params={"segments": [64, 32]}, scale=2.0)
    assert lowest([ball], thing) == pytest.approx(2.0, abs=1e-12)


@pytest.mark.parametrize("up", [(0.0, 1.0, 0.0), (0.0, 0.0, -2.0), (1.0, 1.0, 1.0)])
def test_up_may_be_any(up: tuple[float, float, float]) -> None:
    unit = np.array(up) / np.linalg.norm(up)
    ground = Object(shape="sphere", params={"segments": [64, 32]}, scale=1.0, translate=tuple(-3.0 * unit))
    assert lowest([ground], up=np.array(up)) == pytest.approx(-2.0, abs=5e-3)


def test_those_that_stand_do_not_stand_on_each_other_and_the_rest_stays() -> None:
    objects = [THING, Object(shape="box", scale=0.5), plane(-1.0)]
    moved = on_the_floor(objects, [0, 1], Z)
    assert [entry.translate[2] for entry in moved] == pytest.approx([-0.5, -0.5, -1.0])
    assert moved[2] is objects[2] and moved[0].geometry is objects[0].geometry
    assert on_the_floor(objects, [], Z) == objects


def test_a_scene_file_says_it(tmp_path: Path) -> None:
    """The torus of the small scene lies beside the ball, with a minor radius of 0.35, over nothing; then over a plane.
    It is the picture of the same scene with the place written out."""
    path = tmp_path / "scene.toml"
    path.write_text(SMALL_SCENE + 'place = "floor"\n')
    assert ldtrefl.load_scene(path).objects[1].translate == pytest.approx((1.5, -1.5, 0.35), abs=1e-6)
    floor = '[[object]]\nshape = "plane"\nscale = 9.0\ntranslate = [0, 0, -2]\n'
    path.write_text(SMALL_SCENE + 'place = "floor"\n' + floor)
    scene = ldtrefl.load_scene(path)
    assert scene.objects[1].translate == pytest.approx((1.5, -1.5, -1.65), abs=1e-6)
    x, y, z = scene.objects[1].translate
    path.write_text(SMALL_SCENE.replace("[1.5, -1.5, 0.0]", f"[{x}, {y}, {z!r}]") + floor)
    np.testing.assert_array_equal(ldtrefl.render(scene).image, ldtrefl.render(ldtrefl.load_scene(path)).image)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('place = "flor"', r"object\[1\]\.place: should be 'floor', got 'flor'"),
        ("place = 3", r"object\[1\]\.place: should be 'floor', got 3"),
        ('place = "floor"\nplaces = [[0, 0, 0]]', r"object\[1\]: 'place' and 'places' exclude each other"),
        ('plase = "floor"', r"object\[1\]: unknown key 'plase'; did you mean 'place"),
    ],
)
def test_what_is_wrong_with_the_key_is_said(tmp_path: Path, keys: str, message: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SMALL_SCENE + keys + "\n")
    with pytest.raises(ldtrefl.InputError, match=message):
        ldtrefl.load_scene(path)


def test_tables_of_another_form_are_left_to_the_loader() -> None:
    assert split_standing({"object": 3}) == ({"object": 3}, frozenset())
    assert split_standing({"object": [3]}) == ({"object": [3]}, frozenset())
