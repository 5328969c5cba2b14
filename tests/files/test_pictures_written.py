"""Pictures in files, and metrics."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ldtrefl import InputError, load_image, save_image
from ldtrefl.compare import metrics
from ldtrefl.files.pictures import difference_image, linear_from_srgb, srgb_from_linear


def noise(h: int = 20, w: int = 30) -> np.ndarray:
    return np.random.default_rng(0).random((h, w, 3)).astype(np.float32)


def test_srgb_round_trip_and_known_values() -> None:
    values = np.linspace(0, 1, 1000, dtype=np.float32)
    np.testing.assert_allclose(linear_from_srgb(srgb_from_linear(values)), values, atol=1e-5)
    np.testing.assert_allclose(
        srgb_from_linear(np.array([0.0, 0.0031308, 0.5, 1.0, 7.0])), [0, 0.04045, 0.7354, 1, 1], atol=1e-4
    )


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


@pytest.mark.parametrize("mode", ["L", "P", "RGBA", "1", "LA"])
def test_every_kind_of_png_is_read_as_rgb(tmp_path: Path, mode: str) -> None:
    Image.fromarray(np.full((4, 6, 3), 255, np.uint8)).convert(mode).save(tmp_path / "a.png")
    np.testing.assert_allclose(load_image(tmp_path / "a.png"), np.ones((4, 6, 3)), atol=1e-6)


def test_pictures_that_cannot_be_read(tmp_path: Path) -> None:
    save_image(tmp_path / "a.png", noise(64, 64))
    whole = (tmp_path / "a.png").read_bytes()
    for length, fault in (
        (0, "not a picture"),
        (10, "not a picture"),
        (40, "not a picture"),
        (len(whole) // 2, "cut off"),
    ):
        (tmp_path / "cut.png").write_bytes(whole[:length])
        with pytest.raises(InputError, match=rf"cut\.png: .*{fault}"):
            load_image(tmp_path / "cut.png")
    with pytest.raises(InputError, match="no such picture"):
        load_image(tmp_path / "none.png")


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


def test_difference_is_grey_where_equal_red_where_brighter_blue_where_darker() -> None:
    half = np.full((1, 1, 3), 0.5, np.float32)
    grey, red, blue = (srgb_from_linear(difference_image(x, half))[0, 0] for x in (half, 1.2 * half, 0.8 * half))
    np.testing.assert_allclose(grey, 0.5, atol=1e-5)
    assert red[0] > 0.5 > red[2] and blue[2] > 0.5 > blue[0]


def test_metrics_of_equal_images_and_of_a_known_error() -> None:
    image, mask = noise(), np.zeros((20, 30), bool)
    mask[5:15, 5:20] = True
    assert metrics.ssim(image, image, mask) == pytest.approx(1.0)
    assert metrics.psnr(image, image, mask) == float("inf")
    assert metrics.flip(image, image, mask) == 0.0
    assert metrics.relmse(image, image, mask) == 0.0
    darker = linear_from_srgb(np.full((20, 30, 3), 0.4, np.float32))
    lighter = linear_from_srgb(np.full((20, 30, 3), 0.5, np.float32))
    assert metrics.psnr(darker, lighter, mask) == pytest.approx(20.0, abs=0.01)
    assert 0 < metrics.flip(darker, lighter, mask) < 1
    outside = np.where(mask[..., None], image, 0).astype(np.float32)
    assert metrics.psnr(outside, image, mask) == float("inf")


def test_metrics_of_tiny_images_and_empty_masks() -> None:
    image = noise(2, 3)
    assert metrics.ssim(image, image, np.ones((2, 3), bool)) == pytest.approx(1.0)
    for metric in (metrics.ssim, metrics.psnr, metrics.flip, metrics.relmse):
        assert np.isnan(metric(image, image, np.zeros((2, 3), bool)))
