"""Sun and sky as a preset gives them."""

import numpy as np
import pytest

from ldtrefl.scene.presets.base import direction, mean_radiance, picture_directions
from ldtrefl.scene.presets.colorimetry import luminance
from ldtrefl.scene.presets.preetham import zenith_luminance
from ldtrefl.scene.presets.sky import BRIGHTEST, MOST_AROUND, ROWS, sky
from ldtrefl.scene.presets.sunlight import SUN_RADIUS, sun_xyz

GROUND = (0.3, 0.3, 0.3)


@pytest.mark.parametrize(("elevation", "azimuth"), [(42.0, -50.0), (8.0, 170.0), (70.0, 30.0)])
def test_it_is_brightest_where_the_sun_is(elevation: float, azimuth: float) -> None:
    made = sky(elevation, azimuth, 2.2, GROUND)
    row, column = np.unravel_index(made.picture.pixels.sum(axis=-1)[: ROWS // 2 - 12].argmax(), (ROWS, 2 * ROWS))
    towards = picture_directions(ROWS)[row, column]
    assert towards @ direction(azimuth, elevation) > np.cos(np.radians(1.0))
    assert made.disc is not None
    for found in (made.disc.towards, made.lights[0].towards):
        np.testing.assert_allclose(found, direction(azimuth, elevation), atol=1e-12)


@pytest.mark.parametrize("turbidity", [1.7, 2.2, 6.0, 10.0])
@pytest.mark.parametrize("elevation", [0.0, 3.0, 20.0, 60.0, 90.0])
def test_it_is_well_exposed(elevation: float, turbidity: float) -> None:
    """White that faces the sun has luminance 1, unless the sky alone would be too bright."""
    made = sky(elevation, 0.0, turbidity, GROUND)
    around, sun = luminance(np.array(made.ambient)), luminance(np.array(made.lights[0].radiance))
    assert np.isfinite(made.picture.pixels).all() and made.picture.pixels.min() >= 0.0
    assert around + sun == pytest.approx(1.0, abs=1e-3) if around < 0.999 * MOST_AROUND else around + sun < 1.001
    assert around < 1.001 * MOST_AROUND
    if elevation == 60.0 and turbidity == 2.2:
        assert around + sun == pytest.approx(1.0, abs=1e-6)


def test_ambient_light_is_the_mean_of_what_is_around() -> None:
    made = sky(42.0, 0.0, 2.2, GROUND)
    np.testing.assert_allclose(made.ambient, mean_radiance(made.picture.pixels), rtol=1e-5)


def test_sun_and_sky_have_one_unit() -> None:
    """A luminance of the sky in kcd / m^2 and the sun's illuminance in klux, at the zenith; both times the scale."""
    made = sky(60.0, 0.0, 2.2, GROUND)
    zenith = luminance(made.picture.pixels[0].mean(axis=0).astype(float))
    sun = luminance(np.array(made.lights[0].radiance))
    assert zenith / sun == pytest.approx(
        np.pi * zenith_luminance(np.radians(30.0), 2.2) / sun_xyz(60.0, 2.2)[1], rel=0.03
    )


def test_the_disc_is_the_suns() -> None:
    """Its hue is that of the light; its radiance is the light's over the solid angle, or as much as is shown."""
    for elevation, is_dim in ((42.0, False), (0.0, True)):
        made = sky(elevation, 0.0, 2.2 if elevation else 6.0, GROUND)
        assert made.disc is not None
        own = np.array(made.lights[0].radiance) / np.sin(SUN_RADIUS) ** 2
        np.testing.assert_allclose(np.array(made.disc.radiance) * own[0], made.disc.radiance[0] * own, rtol=1e-9)
        assert made.disc.radiance[0] == pytest.approx(own[0] if is_dim else BRIGHTEST)
        assert made.disc.radius == pytest.approx(np.radians(0.2666))


def test_the_ground_is_lit_by_both() -> None:
    """Straight down it is a matt plane: twice the albedo gives twice its radiance, and no haze is before it."""
    dark, light = (sky(42.0, 0.0, 2.2, (albedo,) * 3) for albedo in (0.2, 0.4))
    down = [made.picture.pixels[-1, 0] / np.array(made.lights[0].radiance) for made in (dark, light)]
    np.testing.assert_allclose(down[1] / down[0], 2.0, rtol=0.1)
    sun = np.sin(np.radians(42.0)) * np.array(light.lights[0].radiance)
    height = picture_directions(ROWS)[: ROWS // 2, :1, 2:]
    area = np.pi / ROWS * np.sqrt(1.0 - height**2) * 2.0 * np.pi / (2 * ROWS)
    from_sky = (light.picture.pixels[: ROWS // 2] * height * area).sum(axis=(0, 1)) / np.pi
    np.testing.assert_allclose(light.picture.pixels[-1, 0], 0.4 * (sun + from_sky), rtol=0.1)
