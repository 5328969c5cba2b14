"""Resolutions that no layered depth texture has."""

import numpy as np
import pytest

import ldtrefl


@pytest.mark.parametrize("resolution", [0, -4, 15, 4097, 12.5, "many", True, None])
def test_wrong_resolution(resolution: object) -> None:
    with pytest.raises(ldtrefl.InputError, match=rf"^resolution: should be .*, got {resolution!r}$"):
        ldtrefl.peel(np.eye(3), [[0, 1, 2]], resolution=resolution)
