"""Colours of spectra, against the CIE's own numbers."""

import numpy as np
import pytest

from ldtrefl.scene.presets.colorimetry import (
    D55_XYZ,
    RGB_FROM_XYZ,
    daylight_rgb_from_xyz,
    luminance,
    matching_functions,
)


def test_matching_functions() -> None:
    """The CIE 1931 table at three wavelengths, within the fit's error of two hundredths."""
    table = [[0.3362, 0.0380, 1.7721], [0.4334, 0.9950, 0.0087], [1.0622, 0.6310, 0.0008]]
    np.testing.assert_allclose(matching_functions(np.array([450.0, 550.0, 600.0])), table, atol=0.03)


def test_an_even_spectrum_has_equal_sums() -> None:
    sums = matching_functions(np.arange(360.0, 831.0, 1.0)).sum(axis=0)
    np.testing.assert_allclose(sums, 106.86, rtol=0.01)


def test_daylight_is_white() -> None:
    white = daylight_rgb_from_xyz() @ D55_XYZ
    np.testing.assert_allclose(white, 1.0, atol=1e-3)
    assert (RGB_FROM_XYZ @ D55_XYZ)[2] < 0.85  # which it is not in sRGB itself


def test_luminance() -> None:
    assert luminance(np.array([1.0, 0.0, 0.0])) == pytest.approx(0.2126, abs=1e-4)
    assert luminance(np.array([0.0, 1.0, 0.0])) == pytest.approx(0.7152, abs=1e-4)
