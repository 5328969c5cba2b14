"""Keys by content: the same for the same content, another for anything else."""

import numpy as np

from ldtrefl.files.content_key import content_key


def test_type_shape_and_every_value_count() -> None:
    a = np.arange(6.0)
    others = [a.reshape(2, 3), a.astype(np.float32), a.view(np.int64), a + 1e-12, a[::-1], a[:5]]
    assert len({content_key(entry) for entry in (a, *others)}) == 7
    assert content_key(a.copy()) == content_key(a) == content_key(np.repeat(a, 2)[::2])


def test_several_contents_are_told_apart() -> None:
    a = np.arange(3)
    contents = [(), (a,), (a, a), (a, None), (None, a), ("a",), ("a", "b"), ("b", "a"), ("ab",), ("", "ab"), ("none ",)]
    assert len({content_key(*entry) for entry in contents}) == len(contents)
