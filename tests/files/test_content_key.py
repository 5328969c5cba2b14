"""Keys by content: the same for the same content, another for anything else."""

import numpy as np

from ldtrefl.files.content_key import content_key
from ldtrefl.files.stored_picture import StoredPicture


def test_type_shape_and_every_value_count() -> None:
    a = np.arange(6.0)
    others = [a.reshape(2, 3), a.astype(np.float32), a.view(np.int64), a + 1e-12, a[::-1], a[:5]]
    assert len({content_key(entry) for entry in (a, *others)}) == 7
    assert content_key(a.copy()) == content_key(a) == content_key(np.repeat(a, 2)[::2])


def test_several_contents_are_told_apart() -> None:
    a = np.arange(3)
    contents = [(), (a,), (a, a), (a, None), (None, a), ("a",), ("a", "b"), ("b", "a"), ("ab",), ("", "ab"), ("none ",)]
    assert len({content_key(*entry) for entry in contents}) == len(contents)


def test_a_picture_is_known_by_its_pixels() -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (4, 6, 3), dtype=np.uint8)
    changed = pixels.copy()
    changed[3, 5, 2] ^= 1
    first, second = StoredPicture(pixels), StoredPicture(pixels.copy())
    assert first.key == second.key != StoredPicture(changed).key
    assert first.key != StoredPicture(pixels.reshape(6, 4, 3)).key
    assert not pixels.flags.writeable
