"""Pictures beside mesh files: read once, and a line for each that is missing."""

import io

import numpy as np
from PIL import Image

from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.readers.pictures import (
    Pictures,
    file_beside,
    is_grey,
    is_opaque,
    roughness_and_metallic,
    with_alpha_of,
)


def test_a_picture_is_read_once_and_missed_once() -> None:
    asked = []
    stream = io.BytesIO()
    Image.new("RGB", (2, 2), (1, 2, 3)).save(stream, "PNG")

    def beside(name: str) -> bytes:
        asked.append(name)
        return {"a.png": stream.getvalue()}[name]

    pictures = Pictures(beside)
    assert pictures.get("a.png") is pictures.get("a.png") and asked == ["a.png"]
    assert pictures.get("b.png") is None is pictures.get("b.png")
    assert pictures.not_shown == ["the picture 'b.png' (it is not beside the file)"]


def test_names_of_other_systems() -> None:
    found = {"a b.png": b"1", "maps/c.png": b"2"}
    for name in ('"a b.png"', "C:\\x\\a b.png", "/home/x/a b.png", " a b.png "):
        assert file_beside(lambda name: found[name], name) == b"1"
    assert file_beside(lambda name: found[name], "maps\\c.png") == b"2"
    assert file_beside(lambda name: found[name], "..\\d.png") is None


def test_channels_are_put_together() -> None:
    grey = StoredPicture(np.array([[[5] * 3, [6] * 3]], np.uint8))
    colored = StoredPicture(np.array([[[1, 2, 3], [4, 5, 6]]], np.uint8), np.array([[9, 255]], np.uint8))
    assert is_grey(grey) and not is_grey(colored) and is_opaque(grey) and not is_opaque(colored)
    np.testing.assert_array_equal(with_alpha_of(colored, grey).alpha, [[5, 6]])
    np.testing.assert_array_equal(with_alpha_of(None, colored).alpha, [[9, 255]])
    assert (with_alpha_of(None, colored).pixels == 255).all()
    np.testing.assert_array_equal(roughness_and_metallic(grey, None).pixels, [[[255, 5, 255], [255, 6, 255]]])
    np.testing.assert_array_equal(roughness_and_metallic(None, colored).pixels, [[[255, 255, 2], [255, 255, 5]]])
    deep = StoredPicture(np.array([[[0.0] * 3, [1.0] * 3]], np.float32))
    np.testing.assert_array_equal(roughness_and_metallic(deep, grey).pixels, [[[255, 0, 5], [255, 255, 6]]])
