"""Mip maps against the areas that texels cover, in linear light."""

import numpy as np
import pytest

from ldtrefl.files.srgb import srgb_from_linear
from ldtrefl.world.mip_maps import halved, mip_alpha, mip_maps


def levels_of(texels: np.ndarray, width: int, height: int) -> list[np.ndarray]:
    """The maps as pictures."""
    made, first = [], 0
    while width > 1 or height > 1:
        width, height = max(1, width // 2), max(1, height // 2)
        made.append(texels[first : first + width * height].reshape(height, width, -1))
        first += width * height
    assert first == len(texels)
    return made


def covered(row: np.ndarray, count: int) -> np.ndarray:
    """Means of ``count`` equal parts of a row of texels."""
    sums = np.concatenate([[0.0], np.cumsum(row)])
    return np.diff(np.interp(np.linspace(0, len(row), count + 1), np.arange(len(sums)), sums)) / (len(row) / count)


@pytest.mark.parametrize("count", [2, 3, 7, 8, 13])
def test_a_texel_is_the_mean_of_what_it_covers(count: int) -> None:
    row = np.random.default_rng(count).uniform(size=count).astype(np.float32)
    np.testing.assert_allclose(halved(row, 0), covered(row, count // 2), rtol=1e-5)


@pytest.mark.parametrize("shape", [(8, 8), (5, 12), (1, 9), (300, 7)])
def test_every_map_has_the_pictures_mean(shape: tuple[int, int]) -> None:
    picture = np.random.default_rng(1).uniform(size=(*shape, 3)).astype(np.float32)
    for level in levels_of(mip_maps(picture), shape[1], shape[0]):
        np.testing.assert_allclose(level.mean(axis=(0, 1)), picture.mean(axis=(0, 1)), rtol=1e-5)


def test_a_ramp_stays_a_ramp_that_ends_where_it_ended() -> None:
    ramp = ((np.arange(32, dtype=np.float32) + 0.5) / 32)[None, :, None].repeat(3, axis=2)
    for level in levels_of(mip_maps(ramp), 32, 1):
        np.testing.assert_allclose(level[0, :, 0], (np.arange(level.shape[1]) + 0.5) / level.shape[1], atol=1e-6)


def test_bytes_are_averaged_in_linear_light_and_data_as_they_are() -> None:
    checker = (255 * (np.indices((256 + 2, 512)).sum(axis=0) % 2)).astype(np.uint8)[..., None].repeat(3, axis=2)
    half = round(255 * float(srgb_from_linear(np.float32(0.5))))
    assert half == 188 and (mip_maps(checker) == half).all()
    assert np.isin(mip_maps(checker, is_data=True), (127, 128)).all()
    assert mip_maps(checker[:1, :1]).shape == (0, 3)


def test_the_table_of_bytes_is_the_nearest_byte() -> None:
    every = np.arange(256, dtype=np.uint8)
    fours = every.repeat(2)[None, :, None].repeat(2, axis=0).repeat(3, axis=2)
    assert (mip_maps(fours)[:256, 0] == every).all()


def test_what_is_not_seen_colours_nothing() -> None:
    picture = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [0, 0, 255]]], np.uint8)
    alpha = np.array([[255, 0], [0, 0]], np.uint8)
    assert mip_maps(picture, alpha).tolist() == [[255, 0, 0]] and mip_alpha(alpha).tolist() == [64]
    unseen = mip_maps(picture, np.zeros((2, 2), np.uint8)).tolist()
    assert unseen == [[137, 137, 188]], "of what has no alpha at all, the plain mean"
