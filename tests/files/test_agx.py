"""AgX against the table that Blender 4 shows pictures by, and closed forms."""

import numpy as np
import pytest

from ldtrefl.files.agx import MIDDLE_GREY, agx

TABLE_SIDE = 57
SRGB_FROM_E_GAMUT = np.array(
    [
        [3.24100323297635872, -1.53739896948878551, -0.49861588199636291],
        [-0.96922425220251640, 1.87592998369517593, 0.04155422634008471],
        [0.05563941985197547, -0.20401120612390993, 1.05714897718753331],
    ]
) @ [
    [0.7053968501, 0.1640413283, 0.08101774865],
    [0.2801307241, 0.8202066415, -0.1003373656],
    [-0.1037815116, -0.07290725703, 1.265746519],
]
"""From FilmLight's E-Gamut, in which the table is read, by way of XYZ: ``config.ocio`` of Blender."""

BLENDERS = {
    (5, 5, 5): (0.0273026, 0.0273025, 0.0273062),
    (12, 12, 12): (0.1023539, 0.1023534, 0.1023622),
    (22, 22, 22): (0.4636334, 0.4636318, 0.4636663),
    (25, 25, 25): (0.6464802, 0.6464788, 0.646508),
    (35, 35, 35): (0.9697018, 0.9697013, 0.9697106),
    (40, 40, 40): (1.0, 1.0, 1.0),
    (17, 13, 12): (0.2694862, 0.0986033, 0.0516064),
    (31, 25, 26): (0.9987593, 0.6729486, 0.6895366),
    (34, 28, 28): (1.0, 0.7957721, 0.7808829),
    (33, 32, 29): (0.964816, 0.9003211, 0.7989854),
    (17, 18, 14): (0.2145698, 0.2653245, 0.0),
    (21, 24, 19): (0.2327503, 0.6203429, 0.0),
    (35, 38, 33): (0.9365848, 1.0, 0.9119625),
    (15, 15, 20): (0.0, 0.146994, 0.380017),
    (17, 16, 21): (0.1652822, 0.1584955, 0.4447836),
    (15, 16, 19): (0.0383111, 0.1849095, 0.3258275),
}
"""Points of ``AgX_Base_sRGB.cube`` and what stands there, encoded by the power 2.4: greys, reds, greens, blues."""


@pytest.mark.parametrize("point", BLENDERS)
def test_it_is_blenders(point: tuple[int, int, int]) -> None:
    """The table's axes are 25 stops of E-Gamut, the darkest 10 below middle grey."""
    stops = 25.0 * np.array(point) / (TABLE_SIDE - 1) - 10.0
    radiance = SRGB_FROM_E_GAMUT @ (0.18 * 2.0**stops)
    display = agx(radiance.astype(np.float32)[:, None])[:, 0].astype(float)
    np.testing.assert_allclose(display ** (1 / 2.4), BLENDERS[point], atol=5e-6)


def test_middle_grey_stays_and_white_is_sixteen_stops_and_a_half_above_black() -> None:
    greys = np.float32(MIDDLE_GREY) * np.array([2.0**-10, 1.0, 2.0**6.5], np.float32)
    display = agx(np.tile(greys, (3, 1)))
    np.testing.assert_allclose(display, np.tile([0.0, MIDDLE_GREY, 1.0], (3, 1)), atol=2e-6)


def test_what_has_no_brightness_is_black_and_no_warning_is_given() -> None:
    with np.errstate(all="raise"):
        assert (agx(np.array([[0.0, -1.0], [0.0, -2.0], [0.0, 0.0]], np.float32)) < 1e-12).all()


def test_bright_colours_go_to_white() -> None:
    red = np.array([1.0, 0.1, 0.05], np.float32)[:, None] * 2.0 ** np.arange(0, 13, 2, dtype=np.float32)
    display = agx(red)
    paleness = display.min(axis=0) / display.max(axis=0)
    assert (np.diff(paleness[:5]) > 0.05).all() and (paleness[5:] == 1.0).all()
