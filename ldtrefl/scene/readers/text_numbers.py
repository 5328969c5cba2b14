"""Numbers in lines of text, a block of lines at a time.

The lines of one kind are picked out of a block together, and NumPy reads their numbers at once. Only where that fails
are words looked at one by one, to say which line is wrong.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ldtrefl.base.errors import InputError

BLANK = ord(" ")
SLASH = ord("/")
NEWLINE = ord("\n")
SLASHES = bytes.maketrans(b"/", b" ")

LONGEST_QUOTE = 40
"""Letters of a wrong line that are shown."""


def numbers(text: bytes, kind: type, count: int) -> np.ndarray | None:
    """(count,) numbers that stand in a text between blanks; None if there are not that many, or other words."""
    try:
        found = np.fromstring(text, kind, sep=" ") if count else np.zeros(0, kind)  # type: ignore
    except (ValueError, DeprecationWarning):
        return None
    return found if len(found) == count else None


@dataclass(eq=False)
class Lines:
    """A block of lines, each ended by a newline, whose words stand between blanks."""

    text: bytes
    first: int
    """The number of the first line in its file, from 1."""
    array: np.ndarray
    """(bytes,) uint8."""
    starts: np.ndarray
    """(lines,) int64: where each begins."""
    ends: np.ndarray
    """(lines,) int64: where the newline of each stands."""

    @staticmethod
    def of(text: bytes, first: int) -> Lines:
        """A block of text that ends with a newline."""
        array = np.frombuffer(text, np.uint8)
        ends = np.flatnonzero(array == NEWLINE)
        return Lines(text, first, array, np.concatenate([[0], ends[:-1] + 1]), ends)

    def letters(self, place: int) -> np.ndarray:
        """(lines,) uint8: the letter at a place of each line; of shorter ones their newline."""
        return self.array[np.minimum(self.starts + place, self.ends)]

    def line(self, k: int) -> bytes:
        """A line by its place in the block, without its newline."""
        return self.text[self.starts[k] : self.ends[k]]

    def rows(self, chosen: np.ndarray, skipped: int, *, least: int) -> tuple[np.ndarray, np.ndarray]:
        """Numbers in lines.

        Args:
            chosen: (lines,) bool.
            skipped: letters at the beginning of each line, its keyword.
            least: how many numbers a line must have.

        Returns:
            (values,) float64, line by line, and (chosen lines,) how many each has.

        Raises:
            InputError: a line has fewer, or a word that is no number.
        """
        picked, ends = self._picked(chosen, skipped)
        is_word, words = _words(picked, ends)
        del is_word
        values = numbers(picked.tobytes(), np.float64, int(words.sum()))
        if values is None or (len(words) and words.min() < least):
            wanted = f"at least {least} numbers" if least else "numbers"
            raise self._first_wrong(chosen, wanted, lambda line: _are_numbers(line[skipped:].split(), least))
        return values, words

    def corners(self, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Corners of faces in lines such as ``f 1/2/3 4//6 7 8/9``.

        Returns:
            (corners, 3) int64, the numbers of vertex, texture coordinates and normal, 0 where there is none; and
            (chosen lines,) how many corners each has.

        Raises:
            InputError: a word is none of these.
        """
        picked, ends = self._picked(chosen, 1)
        is_word, sizes = _words(picked, ends)
        count = int(sizes.sum())
        text, parts = picked.tobytes(), np.ones(count, np.int64)
        if b"/" in text:
            text = text.replace(b"//", b"/0/").replace(b"/ ", b"/0 ").replace(b"/\n", b"/0\n")
            if len(text) != len(picked):
                picked = np.frombuffer(text, np.uint8)
                is_word, _ = _words(picked, np.flatnonzero(picked == NEWLINE))
            is_slash = picked == SLASH
            slashes = np.cumsum(is_slash, dtype=np.int32)
            parts += np.diff((slashes - is_slash)[np.flatnonzero(is_word)], append=slashes[-1])
            text = text.translate(SLASHES)
        values = numbers(text, np.int64, int(parts.sum()))
        if values is None or (count and parts.max() > 3):
            wanted = "corners such as 1, 1/2, 1//3 or 1/2/3"
            raise self._first_wrong(chosen, wanted, lambda line: all(map(_is_corner, line[1:].split())))
        table = np.zeros((count, 3), np.int64)
        if count and (parts == parts[0]).all():
            table[:, : parts[0]] = values.reshape(count, -1)
        elif count:
            rows = np.repeat(np.arange(count), parts)
            table[rows, np.arange(len(values)) - (np.cumsum(parts) - parts)[rows]] = values
        return table, sizes

    def _picked(self, chosen: np.ndarray, skipped: int) -> tuple[np.ndarray, np.ndarray]:
        """(the bytes of lines, their keywords blank; where the newline of each stands in them)."""
        lengths = self.ends - self.starts + 1
        picked = self.array[np.repeat(chosen, lengths)]
        ends = np.cumsum(lengths[chosen]) - 1
        begins = ends - lengths[chosen] + 1
        for k in range(skipped):
            picked[begins + k] = BLANK
        return picked, ends

    def _first_wrong(self, chosen: np.ndarray, wanted: str, is_right: Callable[[bytes], bool]) -> InputError:
        """The error that says which of these lines is wrong."""
        for k in np.flatnonzero(chosen).tolist():
            line = self.line(k)
            if not is_right(line):
                quote = line[:LONGEST_QUOTE].decode("latin-1") + ("..." if len(line) > LONGEST_QUOTE else "")
                return InputError(f"line {self.first + k}: should have {wanted}, got '{quote}'")
        return InputError(f"a line should have {wanted}")


def _words(text: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """((bytes,) whether a word begins there, (lines,) how many words each line has), of lines that end there."""
    is_letter = text > BLANK
    is_word = is_letter.copy()
    is_word[1:] &= ~is_letter[:-1]
    before = np.cumsum(is_word, dtype=np.int32)[ends]
    return is_word, np.diff(before, prepend=np.int32(0)).astype(np.int64)


def _are_numbers(words: list[bytes], least: int) -> bool:
    return len(words) >= least and all(numbers(word, np.float64, 1) is not None for word in words)


def _is_corner(word: bytes) -> bool:
    parts = word.split(b"/")
    return len(parts) <= 3 and parts[0] != b"" and all(not p or numbers(p, np.int64, 1) is not None for p in parts)
