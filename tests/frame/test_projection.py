"""Chunks of the objects that are drawn: every vertex or triangle of each object once."""

import numpy as np

from ldtrefl.device import launch
from ldtrefl.device.bins import CHUNK
from ldtrefl.frame.projection import chunks_of


def test_chunks_cover_every_object_once() -> None:
    chunk = int(CHUNK)
    chunks = chunks_of(np.array([1, chunk, 0, 2 * chunk + 1]), launch.resolve_device(None))
    assert chunks.numpy().tolist() == [[0, 0], [1, 0], [3, 0], [3, chunk], [3, 2 * chunk]]
    assert chunks_of(np.zeros(0, np.int64), launch.resolve_device(None)).shape == (0,)
