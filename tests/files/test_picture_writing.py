"""Pictures written as PNG and EXR: the bits in the file, other programs that read it, places that cannot be written."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ldtrefl import InputError, load_image, save_image
from ldtrefl.files.srgb import srgb_from_linear


def noise(h: int = 20, w: int = 30) -> np.ndarray:
    return np.random.default_rng(0).random((h, w, 3)).astype(np.float32)


def test_exr_keeps_every_bit_and_png_eight(tmp_path: Path) -> None:
    image = 5 * noise()
    save_image(tmp_path / "a.exr", image)
    np.testing.assert_array_equal(load_image(tmp_path / "a.exr"), image)
    save_image(tmp_path / "a.png", noise())
    np.testing.assert_allclose(
        srgb_from_linear(load_image(tmp_path / "a.png")), srgb_from_linear(noise()), atol=0.5 / 255 + 1e-5
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.exr", "a.png"]


def test_other_programs_read_our_png(tmp_path: Path) -> None:
    save_image(tmp_path / "a.png", noise())
    stored = np.asarray(Image.open(tmp_path / "a.png"), float) / 255
    np.testing.assert_allclose(stored, srgb_from_linear(noise()), atol=0.5 / 255 + 1e-6)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.jpg", r"a\.jpg: a picture's name ends in \.png or \.exr"),
        ("a", r"a: a picture's name ends in \.png or \.exr"),
        ("folder.png", r"folder\.png: is a folder"),
        ("none/a.png", r"a\.png: the folder .*none does not exist"),
    ],
)
def test_places_that_cannot_be_written(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(InputError, match=message):
        save_image(tmp_path / name, noise())
