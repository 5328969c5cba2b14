"""Chunks of the objects that are drawn: every vertex or triangle of each object once."""

import numpy as np

from ldtrefl.device import launch
from ldtrefl.device.bins import CHUNK
from ldtrefl.frame.projection import chunks_of


def test_chunks_cover_every_object_once() -> None:
    chunk = int(CHUNK)
    numbers, counts = np.array([4, 0, 7, 2]), np.array([1, chunk, 0, 2 * chunk + 1])
    chunks, count = chunks_of(numbers, counts, launch.resolve_device(None))
    assert count == 5
    found = list(zip(*(array.numpy().tolist() for array in (chunks.place, chunks.object, chunks.begin)), strict=True))
    assert found == [(0, 4, 0), (1, 0, 0), (3, 2, 0), (3, 2, chunk), (3, 2, 2 * chunk)]
