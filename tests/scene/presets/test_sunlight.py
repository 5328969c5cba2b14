"""Sunlight against what is known of it."""

import itertools

import numpy as np
import pytest

from ldtrefl.scene.presets.sunlight import NANOMETRES, air_mass, sun_xyz, transmittance


def test_air_mass() -> None:
    """1 at the zenith, 2 at 30 degrees, and near the horizon what tables of Kasten's formula have."""
    assert air_mass(90.0) == pytest.approx(1.0, abs=1e-3)
    assert air_mass(30.0) == pytest.approx(1.993, abs=1e-3)
    assert air_mass(10.0) == pytest.approx(5.60, abs=0.02)
    assert air_mass(0.0) == pytest.approx(36.5, abs=0.1)


def test_without_haze_and_ozone_rayleigh_is_left() -> None:
    """At 440 nm ozone absorbs nothing, and turbidity 0.99523 has no aerosols: optical depth 0.008735 / 0.44^4.08."""
    share = transmittance(np.array([440.0]), 90.0, 0.04586 / 0.04608)[0]
    assert np.log(share) == pytest.approx(-0.008735 * 28.49138 * air_mass(90.0), rel=1e-5)


def test_haze_dims_by_angstroms_formula() -> None:
    """At a micrometre the optical depth is the turbidity coefficient itself."""
    clear, hazy = (transmittance(np.array([1000.0]), 90.0, turbidity)[0] for turbidity in (2.0, 5.0))
    assert np.log(clear / hazy) == pytest.approx(3.0 * 0.04608 * air_mass(90.0), rel=1e-9)


def test_a_clear_high_sun_gives_a_hundred_klux() -> None:
    """Of 128 klux above the air."""
    assert 90.0 < sun_xyz(60.0, 2.0)[1] < 105.0


def test_it_gets_dimmer_and_redder_towards_the_horizon() -> None:
    for turbidity in (2.0, 4.0):
        sums = [sun_xyz(elevation, turbidity) for elevation in (80.0, 40.0, 20.0, 10.0, 5.0, 1.0, 0.0)]
        assert all(high[1] > low[1] > 0.0 for high, low in itertools.pairwise(sums))
        reds = [xyz[0] / xyz.sum() for xyz in sums]
        assert reds == sorted(reds)
    assert (transmittance(NANOMETRES, 45.0, 2.0) < 1.0).all()
