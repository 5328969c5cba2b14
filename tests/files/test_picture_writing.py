"""Pictures written to files: the bits in the file, other programs that read it, places that cannot be written."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from ldtrefl import InputError, load_image, save_image
from ldtrefl.files.srgb import srgb_from_linear
from ldtrefl.files.tone_mapping import shown


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


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.jpeg", "a.WebP"])
def test_what_a_file_shows_is_developed(tmp_path: Path, name: str) -> None:
    """A smooth picture, which compression leaves as it is but for a few bytes."""
    x, y = np.meshgrid(np.linspace(0, 2, 48), np.linspace(0, 1, 32))
    image = np.stack([x, y, x * y], axis=2).astype(np.float32)
    save_image(tmp_path / name, image, exposure=-1.0, tone_mapping="agx")
    with Image.open(tmp_path / name) as picture:
        assert picture.size == (48, 32) and picture.mode == "RGB"
        stored = np.asarray(picture, float) / 255
    difference = np.abs(stored - shown(image, -1.0, "agx"))
    assert difference.max() < 0.1 and difference.mean() < 0.006


def test_quality_is_what_it_says(tmp_path: Path) -> None:
    sizes = []
    for quality in (20, 60, 95):
        save_image(tmp_path / "a.jpg", noise(), quality=quality)
        sizes.append((tmp_path / "a.jpg").stat().st_size)
    assert sizes == sorted(sizes) and sizes[0] < 0.7 * sizes[-1]
    save_image(tmp_path / "a.webp", noise(), quality=100)
    save_image(tmp_path / "a.png", noise())
    with Image.open(tmp_path / "a.webp") as lossless, Image.open(tmp_path / "a.png") as png:
        np.testing.assert_array_equal(np.asarray(lossless), np.asarray(png))


def test_sixteen_bits_are_kept(tmp_path: Path) -> None:
    save_image(tmp_path / "a.png", noise(), bits=16)
    reader = oiio.ImageInput.open(str(tmp_path / "a.png"))
    assert reader.spec().format == oiio.UINT16
    stored = np.asarray(reader.read_image(oiio.UINT16))
    reader.close()
    np.testing.assert_array_equal(stored, np.round(srgb_from_linear(noise()) * 65535).astype(np.uint16))
    np.testing.assert_allclose(load_image(tmp_path / "a.png"), noise(), atol=2e-5)


def covered() -> np.ndarray:
    """Grey noise in the left half of the picture, half covered in the middle, nothing to the right."""
    alpha = np.zeros((20, 30, 1), np.float32)
    alpha[:, :15], alpha[:, 15] = 1.0, 0.5
    return np.concatenate([noise() * alpha, alpha], axis=2)


@pytest.mark.parametrize("name", ["a.png", "a.webp"])
def test_transparent_pictures_keep_the_colours_of_what_is_half_covered(tmp_path: Path, name: str) -> None:
    save_image(tmp_path / name, covered(), **({"quality": 100} if name == "a.webp" else {}))
    with Image.open(tmp_path / name) as picture:
        assert picture.mode == "RGBA"
        stored = np.asarray(picture)
    np.testing.assert_array_equal(np.unique(stored[..., 3]), [0, 128, 255])
    np.testing.assert_allclose(stored[:, :16, :3] / 255, srgb_from_linear(noise())[:, :16], atol=0.5 / 255 + 1e-5)


def test_a_transparent_exr_is_multiplied_by_alpha(tmp_path: Path) -> None:
    save_image(tmp_path / "a.exr", covered())
    reader = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    assert reader.spec().channelnames == ("R", "G", "B", "A") and reader.spec().alpha_channel == 3
    np.testing.assert_array_equal(np.asarray(reader.read_image(oiio.FLOAT)), covered())
    reader.close()


@pytest.mark.parametrize(
    ("name", "image", "message"),
    [
        ("a.jpg", covered(), r"a\.jpg: a JPEG cannot be transparent, PNG, WebP and EXR can"),
        ("a.webp", np.zeros((1, 16384, 3)), r"a\.webp: has 16384 pixels along a side, at most 16383 fit"),
        ("a.png", np.zeros((4, 4)), r"a\.png: an image is \(height, width, 3 or 4\), got \(4, 4\)"),
        ("a.png", np.zeros((4, 4, 2)), r"a\.png: an image is \(height, width, 3 or 4\), got \(4, 4, 2\)"),
        ("a.png", np.zeros((0, 4, 3)), r"a\.png: an image is \(height, width, 3 or 4\), got \(0, 4, 3\)"),
    ],
)
def test_images_that_do_not_fit_the_file(tmp_path: Path, name: str, image: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        save_image(tmp_path / name, image)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.gif", r"a\.gif: a picture's name ends in \.png, \.exr, \.jpg, \.jpeg or \.webp"),
        ("a", r"a: a picture's name ends in \.png, \.exr, \.jpg, \.jpeg or \.webp"),
        ("folder.png", r"folder\.png: is a folder"),
        ("none/a.png", r"a\.png: the folder .*none does not exist"),
    ],
)
def test_places_that_cannot_be_written(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(InputError, match=message):
        save_image(tmp_path / name, noise())
