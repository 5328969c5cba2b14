"""Exposure and tone mapping: monotone, known values, and `none` is the sRGB encoding alone."""

from typing import get_args

import numpy as np
import pytest

from ldtrefl.files.srgb import linear_from_srgb, srgb_from_linear
from ldtrefl.files.tone_mapping import ToneMapping, shown

TONE_MAPPINGS: tuple[ToneMapping, ...] = get_args(ToneMapping)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
ROUNDING = 1e-6


def colors() -> np.ndarray:
    """(1, n, 3) of every hue, pale and pure, as bright as middle grey at most."""
    given = np.random.default_rng(1).random((1, 3000, 3)) ** 4
    return (0.18 * given / given.max(axis=2, keepdims=True)).astype(np.float32)


def greys(values: object) -> np.ndarray:
    return np.tile(np.asarray(values, np.float32)[None, :, None], (1, 1, 3))


def test_none_is_the_encoding_alone() -> None:
    image = 2.0 * np.random.default_rng(0).random((5, 7, 3)).astype(np.float32)
    np.testing.assert_array_equal(shown(image), srgb_from_linear(image))
    np.testing.assert_array_equal(shown(image, 1.5), srgb_from_linear(image * np.float32(2.0**1.5)))


@pytest.mark.parametrize("tone_mapping", TONE_MAPPINGS)
def test_no_luminance_falls_with_exposure(tone_mapping: ToneMapping) -> None:
    before = np.zeros(3000)
    for exposure in np.arange(-12.0, 16.0, 0.25):
        luminance = linear_from_srgb(shown(colors(), float(exposure), tone_mapping))[0] @ LUMINANCE
        assert (luminance >= before - ROUNDING).all(), exposure
        before = luminance
    assert before.min() > 0.05


@pytest.mark.parametrize("tone_mapping", TONE_MAPPINGS)
def test_greys_stay_grey_and_rise(tone_mapping: ToneMapping) -> None:
    display = shown(greys(np.geomspace(0.01, 0.9, 2000)), 0.0, tone_mapping)[0]
    assert (np.diff(display, axis=0) > 0).all() and np.ptp(display, axis=1).max() < ROUNDING


@pytest.mark.parametrize("tone_mapping", TONE_MAPPINGS)
def test_a_stop_is_twice_the_radiance(tone_mapping: ToneMapping) -> None:
    np.testing.assert_array_equal(shown(colors(), 3.0, tone_mapping), shown(8.0 * colors(), 0.0, tone_mapping))


@pytest.mark.parametrize("tone_mapping", TONE_MAPPINGS)
def test_black_is_black_and_what_is_brighter_than_all_is_white(tone_mapping: ToneMapping) -> None:
    display = shown(greys([0.0, 1e5, 1e30, np.inf]), 32.0, tone_mapping)[0]
    np.testing.assert_allclose(display, np.array([[0.0] * 3, *[[1.0] * 3] * 3]), atol=ROUNDING)
    assert display.min() >= 0.0 and display.max() <= 1.0 and display.dtype == np.float32


def test_middle_grey_of_aces_is_as_the_standard_has_it() -> None:
    """The RRT and the ODT's curve send 0.18 to 4.8 cd/m2 of 48, of which 0.02 are black; then comes the power for dim
    surroundings."""
    display = linear_from_srgb(shown(greys([0.18]), 0.0, "aces"))
    np.testing.assert_allclose(display, ((4.8 - 0.02) / (48.0 - 0.02)) ** 0.9811, rtol=1e-3)


def test_middle_grey_of_agx_stays() -> None:
    np.testing.assert_allclose(linear_from_srgb(shown(greys([0.18]), 0.0, "agx")), 0.18, rtol=1e-5)
