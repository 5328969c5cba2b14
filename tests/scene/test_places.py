"""Objects in many places: each is the table's, moved and scaled; all have one mesh."""

import logging
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.places import split_places, standing_in
from tests.conftest import SMALL_SCENE

THING = '"thing"'


def load(folder: Path, places: str, more: str = "") -> ldtrefl.Scene:
    """The small scene, whose thing stands in ``places``; ``more`` is text at the end of the file."""
    path = folder / "scene.toml"
    path.write_text(SMALL_SCENE.replace(THING, f"{THING}\nplaces = {places}") + more)
    return ldtrefl.load_scene(path)


def test_each_place_is_an_object_of_its_own_with_the_same_mesh(tmp_path: Path) -> None:
    """The thing's own translate is (1.5, -1.5, 0)."""
    scene = load(tmp_path, "[[0, 0, 1], [1.0, 2, 3, 4]]", 'scale = 0.5\n[[object]]\nname = "last"\nshape = "box"\n')
    names = [entry.name for entry in scene.objects]
    assert names == ["", "thing.0", "thing.1", "last"] and scene.number_of("thing.1") == 2
    one, two = scene.objects[1:3]
    assert (one.translate, one.scale) == ((1.5, -1.5, 1.0), 0.5)
    assert (two.translate, two.scale) == ((2.5, 0.5, 3.0), 2.0)
    assert one.geometry is two.geometry and one.material is two.material
    assert len(scene.layout.meshes) == 3 and {type(entry) for entry in scene.objects} == {ldtrefl.Object}
    np.testing.assert_array_equal(two.world_from_object(), [[2, 0, 0, 2.5], [0, 2, 0, 0.5], [0, 0, 2, 3], [0, 0, 0, 1]])


def test_the_picture_is_that_of_the_same_objects_written_out(tmp_path: Path) -> None:
    thing = SMALL_SCENE[SMALL_SCENE.rindex("[[object]]") :]
    written = SMALL_SCENE.replace(thing, "")
    for position in ("[1.5, -1.5, 0.5]", "[-1.0, -1.5, 0.0]"):
        written += thing.replace("[1.5, -1.5, 0.0]", position) + "scale = [0.5, 1.0, 0.25]\n"
    (tmp_path / "written.toml").write_text(written)
    placed = load(tmp_path, "[[0, 0, 0.5, 0.5], [-2.5, 0, 0, 0.5]]", "scale = [1.0, 2.0, 0.5]\n")
    expected = ldtrefl.render(ldtrefl.load_scene(tmp_path / "written.toml"))
    np.testing.assert_array_equal(ldtrefl.render(placed).image, expected.image)
    assert expected.hits is not None and set(np.unique(expected.hits.object)) == {-1, 1, 2}


def test_places_of_an_object_that_stood_somewhere_before_are_their_own() -> None:
    entry = ldtrefl.Object(shape="box", translate=(1, 0, 0))
    assert entry.world_from_object()[0, 3] == 1.0
    (copy,) = standing_in(entry, np.array([[5.0, 0.0, 0.0, 2.0]]))
    np.testing.assert_array_equal(copy.world_from_object(), [[2, 0, 0, 6], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]])
    assert copy.geometry is entry.geometry


def test_objects_without_a_name_have_none_in_their_places() -> None:
    entry = ldtrefl.Object(shape="box")
    assert [copy.name for copy in standing_in(entry, np.ones((2, 4)))] == ["", ""]


def test_too_much_light_is_said_once_for_all_places(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    load(tmp_path, "[[0, 0, 0], [1, 0, 0], [2, 0, 0]]", "[object.material]\nalbedo = 0.9\nmirror = 0.7\n")
    said = [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]
    assert len(said) == 1 and "object 'thing': " in said[0]


@pytest.mark.parametrize(
    ("places", "message"),
    [
        ("[]", r"object\[1\]\.places: should be a list of one place or more, got \[\]$"),
        ("5", r"object\[1\]\.places: should be a valid list, got 5$"),
        ("[1, 2, 3]", r"object\[1\]\.places\[0\]: should be \[x, y, z\] or \[x, y, z, scale\] \(and 2 more\)$"),
        ("[[0, 0]]", r"object\[1\]\.places\[0\]: should be \[x, y, z\] or \[x, y, z, scale\]$"),
        ("[[0, 0, 0], [0, 0, 0, 1, 1]]", r"object\[1\]\.places\[1\]: should be \[x, y, z\] or \[x, y, z, scale\]$"),
        ("[[0, nan, 0]]", r"object\[1\]\.places\[0\]\[1\]: should be a finite number, got nan$"),
        ("[[0, 0, 0, inf]]", r"object\[1\]\.places\[0\]\[3\]: should be a finite number, got inf$"),
        ("[[0, 0, 0, 0]]", r"object\[1\]\.places\[0\]\[3\]: should be from 1e-15 to 1e\+15, got 0$"),
        ("[[0, 0, 0, -1.5]]", r"object\[1\]\.places\[0\]\[3\]: should be from 1e-15 to 1e\+15, got -1\.5$"),
        ("[[0, 0, 1e16]]", r"object\[1\]\.places\[0\]\[2\]: should be less than or equal to 10+, got 1e\+16$"),
        ("[['a', 0, 0]]", r"object\[1\]\.places\[0\]\[0\]: should be a valid number, got 'a'$"),
        ("[[0, 0, 0], [1e15, 0, 0]]", r"object\[1\]: places\[1\]: Object: translate\[0\]: should be less than"),
        ("[[0, 0, 0, 1e-15]]\nscale = 0.1", r"object\[1\]: places\[0\]: Object: scale: should be from .* got 1e-16$"),
        ("[[0, 0, 0, 1e15]]\nscale = [1, 2, 1]", r"object\[1\]: places\[0\]: Object: scale\[1\]: .*, got 2e\+15$"),
        (
            "[[0, 0, 0], [0, 0, 0, 1e-9]]\nfit = 1e-9",
            r"object\[1\]: places\[1\]: fit 1e-09, scale 1e-09 and the",
        ),
        (
            "[[0, 0, 0]]\nplaes = 1",
            r"object\[1\]: unknown key 'plaes'; did you mean 'places?'\? \(.*, places,",
        ),
    ],
)
def test_wrong_places(tmp_path: Path, places: str, message: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=message) as caught:
        load(tmp_path, places)
    assert str(caught.value).startswith(str(tmp_path / "scene.toml")) and "\n" not in str(caught.value)


def test_a_wrong_size_behind_many_places_is_named_by_its_table(tmp_path: Path) -> None:
    more = '[[object]]\nshape = "box"\nfit = 1e-9\nscale = 1e-9\n'
    with pytest.raises(ldtrefl.InputError, match=r"scene\.toml: object\[2\]: fit 1e-09"):
        load(tmp_path, "[[0, 0, 0], [1, 0, 0], [2, 0, 0]]", more)


@pytest.mark.usefixtures("small_limit")
def test_more_objects_than_the_memory_has_room_for_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ldtrefl.InputError, match=r"scene\.toml: object: a list of 2001 needs 15\.6 MiB, allowed"):
        load(tmp_path, "[" + "[0, 0, 0]," * 2000 + "]")


def test_tables_that_are_none_are_left_to_the_other_checks() -> None:
    for tables in ({}, {"object": 1}, {"object": [1, {"name": "a"}]}):
        assert split_places(tables) == (tables, {})
