"""What a file holds of radiance, and which options go with which files."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.files.picture_format import PictureFormat
from ldtrefl.files.srgb import linear_from_srgb, srgb_from_linear


def noise(channels: int = 3) -> np.ndarray:
    return np.random.default_rng(0).random((20, 30, channels)).astype(np.float32)


@pytest.mark.parametrize(("bits", "kind"), [(8, np.uint8), (16, np.uint16)])
def test_values_are_rounded_to_the_nearest(bits: int, kind: type) -> None:
    made = PictureFormat(bits=bits).encoded(noise())
    assert made.dtype == kind
    np.testing.assert_array_equal(made, np.round(srgb_from_linear(noise()) * (2.0**bits - 1)).astype(kind))


@pytest.mark.parametrize(
    ("options", "dithers"),
    [
        ({}, False),
        ({"tone_mapping": "agx"}, True),
        ({"tone_mapping": "agx", "bits": 16}, False),
        ({"tone_mapping": "aces", "dither": False}, False),
        ({"dither": True}, True),
        ({"exposure": 1.0}, False),
    ],
)
def test_what_is_looked_at_is_dithered(options: dict[str, object], dithers: bool) -> None:
    """On a patch of one grey that lies between two bytes."""
    grey = np.full((8, 8, 3), 0.1234, np.float32)
    assert (len(np.unique(PictureFormat(**options).encoded(grey))) == 2) == dithers


def test_colours_are_divided_by_alpha() -> None:
    """The colour of a pixel does not depend on how much of it is covered; nothing is left of one that is not."""
    color, alpha = noise(), np.linspace(0.0, 1.0, 30, dtype=np.float32)
    covered = np.concatenate([color * alpha[:, None], np.broadcast_to(alpha[None, :, None], (20, 30, 1))], axis=2)
    made = PictureFormat(bits=16).encoded(covered)
    np.testing.assert_allclose(linear_from_srgb(made[:, 1:, :3] / 65535), color[:, 1:], atol=1e-4)
    np.testing.assert_allclose(made[..., 3] / 65535, np.broadcast_to(alpha, (20, 30)), atol=1e-5)
    assert (made[:, 0] == 0).all()


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("a.png", {"bits": 12}, r"a\.png: bits: should be 8 or 16, got 12"),
        ("a.png", {"exposure": np.nan}, r"a\.png: exposure: should be a finite number, got nan"),
        ("a.png", {"exposure": 33.0}, r"a\.png: exposure: should be less than or equal to 32, got 33"),
        ("a.png", {"tone_mapping": "filmic"}, r"a\.png: tone_mapping: should be 'none', 'agx' or 'aces', got 'filmic'"),
        ("a.jpg", {"quality": 0}, r"a\.jpg: quality: should be greater than or equal to 1, got 0"),
        ("a.png", {"quality": 90}, r"a\.png: quality goes with JPEG and WebP"),
        ("a.JPG", {"bits": 16}, r"a\.JPG: bits goes with PNG"),
        ("a.webp", {"dither": True}, r"a\.webp: dither goes with PNG"),
        ("a.exr", {"exposure": 1.0}, r"a\.exr: exposure goes with PNG, JPEG and WebP; an EXR holds the radiance"),
        ("a.exr", {"tone_mapping": "agx"}, r"a\.exr: tone_mapping goes with PNG, JPEG and WebP"),
    ],
)
def test_what_is_not_allowed_is_one_line(name: str, options: dict[str, object], message: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=message):
        PictureFormat.checked(Path(name), **options)
