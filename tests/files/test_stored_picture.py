"""Stored pictures: read-only pixels, and a key that is theirs."""

import numpy as np

from ldtrefl.files.content_key import content_key
from ldtrefl.files.stored_picture import StoredPicture


def test_a_picture_is_known_by_its_pixels() -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (4, 6, 3), dtype=np.uint8)
    changed = pixels.copy()
    changed[3, 5, 2] ^= 1
    first, second = StoredPicture(pixels), StoredPicture(pixels.copy())
    assert first.key == second.key == content_key(pixels, None) != StoredPicture(changed).key
    assert first.key != StoredPicture(pixels.reshape(6, 4, 3)).key
    assert first.key != StoredPicture(pixels, np.zeros((4, 6), np.uint8)).key
    assert first.key != StoredPicture(pixels.astype(np.float32)).key
    assert not pixels.flags.writeable and pixels is first.pixels
