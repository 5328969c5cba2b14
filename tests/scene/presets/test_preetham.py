"""Preetham's sky against what the paper's formulas give by hand."""

import numpy as np
import pytest

from ldtrefl.scene.presets.preetham import daylight_y, perez, sky_xyz, zenith_chromaticity, zenith_luminance


def at(elevation: float, azimuth: float = 0.0) -> np.ndarray:
    above, around = np.radians([elevation, azimuth])
    return np.array([np.cos(above) * np.cos(around), np.cos(above) * np.sin(around), np.sin(above)])


def test_luminance_of_the_zenith() -> None:
    """With the sun at the horizon the tangent is 0; for turbidity 4 and the sun at the zenith its angle is 0.4111 pi;
    for turbidity 2 and the sun at 30 degrees from it, 77 pi / 270."""
    assert zenith_luminance(np.pi / 2, 2.0) == pytest.approx(2.4192 - 0.431, abs=1e-12)
    assert zenith_luminance(np.pi / 2, 4.0) == pytest.approx(1.5572, abs=1e-12)
    assert zenith_luminance(0.0, 4.0) == pytest.approx(11.2102 * 3.48741444 + 1.5572, rel=1e-6)
    assert zenith_luminance(np.pi / 6, 2.0) == pytest.approx(3.1196 * 1.24969253 + 1.9882, rel=1e-6)


def test_chromaticity_of_the_zenith() -> None:
    """With the sun there, sums of the last column; with the sun one radian away, of whole rows."""
    assert zenith_chromaticity(0.0, 3.0) == pytest.approx((3 * 0.00394 + 0.25886, 3 * 0.00516 + 0.26688))
    assert zenith_chromaticity(1.0, 2.0) == pytest.approx((0.23767, 0.24114), abs=1e-12)


def test_a_clear_zenith_is_blue() -> None:
    """For turbidity 2 and the sun half-way down, the chromaticity of a colour temperature far above 10,000 K."""
    x, y = zenith_chromaticity(np.pi / 4, 2.0)
    assert 0.23 < x < 0.26 and 0.23 < y < 0.27


@pytest.mark.parametrize("name", ["Y", "x", "y"])
def test_perez(name: str) -> None:
    """At the zenith with the sun there, ``(1 + A e^B) (1 + C + E)``; far from both, the terms that are left."""
    a, b, c, d, e = {
        "Y": (-0.9269, -0.6387, 5.2570, -2.2153, 0.1693),
        "x": (-0.3171, -0.1987, 0.2113, -1.0912, 0.0353),
        "y": (-0.3109, -0.2758, 0.1865, -1.7860, 0.0202),
    }[name]
    there, at_horizon = perez(name, 3.0, np.array([1.0, 0.0]), np.array([0.0, np.pi / 2]))
    assert there == pytest.approx((1 + a * np.exp(b)) * (1 + c + e), rel=1e-12)
    assert at_horizon == pytest.approx(1 + c * np.exp(d * np.pi / 2), rel=1e-12)


def test_the_zenith_is_what_the_paper_says_it_is() -> None:
    sun = at(40.0, 70.0)
    xyz = sky_xyz(at(90.0)[None], sun, 2.5)[0]
    x, y = zenith_chromaticity(np.radians(50.0), 2.5)
    assert y > daylight_y(np.array(x)), "it is left as it is"
    np.testing.assert_allclose(xyz[:2] / xyz.sum(), [x, y], rtol=1e-9)
    assert xyz[1] == pytest.approx(zenith_luminance(np.radians(50.0), 2.5), rel=1e-9)


def test_it_is_brightest_at_the_sun_and_alike_on_both_sides_of_it() -> None:
    sun = at(40.0, 70.0)
    towards, left, right, opposite = sky_xyz(
        np.stack([at(40.0, 70.0), at(40.0, 100.0), at(40.0, 40.0), at(40.0, 250.0)]), sun, 2.5
    )
    np.testing.assert_allclose(left, right, rtol=1e-9)
    assert towards[1] > left[1] > opposite[1] > 0.0


def test_daylight() -> None:
    """CIE 15, chromaticities of the illuminants D50, D55, D65 and D75."""
    x, y = np.array([(0.3457, 0.3585), (0.3324, 0.3474), (0.3127, 0.3290), (0.2990, 0.3149)]).T
    np.testing.assert_allclose(daylight_y(x), y, atol=3e-4)


@pytest.mark.parametrize("turbidity", [2.0, 2.2, 3.0, 6.0])
@pytest.mark.parametrize("elevation", [8.0, 42.0, 80.0])
def test_no_sky_is_purple(elevation: float, turbidity: float) -> None:
    """No chromaticity is on the purple side of daylight's, and luminance is the model's own."""
    azimuths, heights = np.meshgrid(np.arange(0.0, 360.0, 30.0), np.array([0.5, 2.0, 5.0, 10.0, 30.0, 60.0, 90.0]))
    ways = np.stack([at(*pair) for pair in zip(heights.ravel(), azimuths.ravel(), strict=True)])
    xyz = sky_xyz(ways, at(elevation), turbidity)
    x, y = (xyz[:, :2] / xyz.sum(axis=1, keepdims=True)).T
    assert (y >= daylight_y(x) - 1e-12).all()
    sun = np.arccos(np.clip(ways @ at(elevation), -1.0, 1.0))
    there = perez("Y", turbidity, np.ones(()), np.radians(np.full((), 90.0 - elevation)))
    expected = (
        zenith_luminance(np.radians(90.0 - elevation), turbidity) / there * perez("Y", turbidity, ways[:, 2], sun)
    )
    np.testing.assert_allclose(xyz[:, 1], expected, rtol=1e-9)
