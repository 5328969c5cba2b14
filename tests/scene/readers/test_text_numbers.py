"""Numbers in lines of text: as Python reads them, each line with as many as it has."""

import numpy as np
import pytest

from ldtrefl import InputError
from ldtrefl.scene.readers.text_numbers import Lines, numbers


def test_numbers_are_those_of_python() -> None:
    words = ["0.1", "-1e-300", "+7", ".5", "5.", "123456789012345678", "1E5", "nan", "-inf"]
    found = numbers(" ".join(words).encode(), np.float64, len(words))
    np.testing.assert_array_equal(found, [float(word) for word in words])
    for text, count in ((b"1 2", 3), (b"1 x", 2), (b"1 2 3", 2), (b"1,2", 1)):
        assert numbers(text, np.float64, count) is None


def test_rows_of_chosen_lines() -> None:
    lines = Lines.of(b"v 1 2\nx\n\nv  3 4 5 \nv 6\n", 10)
    chosen = lines.letters(0) == ord("v")
    values, words = lines.rows(chosen, 1, least=1)
    assert values.tolist() == [1, 2, 3, 4, 5, 6] and words.tolist() == [2, 3, 1]
    assert lines.letters(5).tolist() == [ord("\n")] * 3 + [ord("4"), ord("\n")]
    with pytest.raises(InputError, match="line 14: should have at least 2 numbers, got 'v 6'"):
        lines.rows(chosen, 1, least=2)


def test_corners_of_every_form_together() -> None:
    lines = Lines.of(b"f 1 2/3 4//5 6/7/8\nf -1/-2/-3 9/ 10//\n", 1)
    corners, sizes = lines.corners(np.array([True, True]))
    assert corners.tolist() == [[1, 0, 0], [2, 3, 0], [4, 0, 5], [6, 7, 8], [-1, -2, -3], [9, 0, 0], [10, 0, 0]]
    assert sizes.tolist() == [4, 3]
    for line in (b"f 1/2/3/4 1 1\n", b"f /1 2 3\n", b"f 1 2 x\n", b"f 1.5 2 3\n", b"f 1///2 3 4\n"):
        with pytest.raises(InputError, match="line 5: should have corners such as"):
            Lines.of(b"\n" + line, 4).corners(np.array([False, True]))
