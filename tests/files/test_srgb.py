"""The sRGB encoding: known values, there and back, and every byte."""

import numpy as np

from ldtrefl.files.srgb import linear_from_srgb, linear_of_bytes, srgb_from_linear


def test_srgb_round_trip_and_known_values() -> None:
    values = np.linspace(0, 1, 1000, dtype=np.float32)
    np.testing.assert_allclose(linear_from_srgb(srgb_from_linear(values)), values, atol=1e-5)
    np.testing.assert_allclose(
        srgb_from_linear(np.array([0.0, 0.0031308, 0.5, 1.0, 7.0])), [0, 0.04045, 0.7354, 1, 1], atol=1e-4
    )


def test_bytes_decode_as_their_values() -> None:
    table = linear_of_bytes()
    assert table.dtype == np.float32 and not table.flags.writeable
    np.testing.assert_allclose(table, linear_from_srgb(np.arange(256) / 255), rtol=1e-6)
    np.testing.assert_array_equal(np.round(255 * srgb_from_linear(table)), np.arange(256))
