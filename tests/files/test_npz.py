"""Archives of arrays: what is expected is read, and anything else is refused before it is unpacked."""

from pathlib import Path

import numpy as np
import pytest

from ldtrefl import InputError
from ldtrefl.base import budget
from ldtrefl.files.npz import read_arrays

EXPECTED = {"points": (np.float32, (None, 3)), "format": (np.int64, ())}
POINTS = np.arange(12, dtype=np.float32).reshape(4, 3)


def test_expected_arrays_are_read_and_no_others(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", points=POINTS, format=np.int64(1), more=np.array([object()]))
    found = read_arrays(tmp_path / "a.npz", EXPECTED)
    assert list(found) == ["points", "format"] and found["format"] == 1
    np.testing.assert_array_equal(found["points"], POINTS)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"points": POINTS}, "format"),
        ({"points": POINTS.astype(np.float64), "format": np.int64(1)}, r"points is float64 of shape \(4, 3\)"),
        ({"points": POINTS.T, "format": np.int64(1)}, r"points is float32 of shape \(3, 4\)"),
        ({"points": POINTS, "format": np.array([object()])}, "format is object"),
    ],
)
def test_other_arrays_are_refused(tmp_path: Path, arrays: dict[str, np.ndarray], message: str) -> None:
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(InputError, match=message):
        read_arrays(tmp_path / "a.npz", EXPECTED)


def test_memory_is_asked_for_first(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "a.npz", points=np.zeros((1 << 20, 3), np.float32), format=np.int64(1))
    budget.set_memory_limit(8 << 20)
    with pytest.raises(InputError, match=r"needs 12\.0 MiB, allowed are 8\.0 MiB"):
        read_arrays(tmp_path / "a.npz", EXPECTED)


def test_what_is_no_archive_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(b"not an archive")
    for name in ("a.npz", "none.npz", "."):
        with pytest.raises(InputError):
            read_arrays(tmp_path / name, EXPECTED)
