"""TOML from a source that need not be trusted, read within limits that a scene never comes near.

Python's ``tomllib`` recurses at every bracket, stores every prefix of a dotted key, and converts whole numbers of any
length: a hundred kilobytes can take gigabytes, minutes, or all of the stack. So one pass over the text looks for what
is beyond the limits first. It skips strings and comments as the reader does. Within the limits a text takes a second
and some 40 MiB a megabyte.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from ldtrefl.base.errors import InputError
from ldtrefl.files.regular_files import read_regular

MAX_BYTES = 8 << 20
"""The largest scene file: 100,000 places with all their digits take three quarters of it."""
MAX_BRACKETS = 32
"""Brackets and braces open at once."""
MAX_DOTS = 16
"""Dots in a key or a table's name."""
MAX_WORD = 100
"""Characters of a number or a bare key: float64 needs 24."""

_NUMBER = r"[+-]?[0-9]{1,30}+(?:\.[0-9]{1,30}+)?(?:e[+-]?[0-9]{1,3}+)?"
_TOKEN = re.compile(
    r"""
      (?P<numbers> \[ NUMBER (?: ,\ ?NUMBER )++ \] )       # a list of numbers, as most of a long text is
    | \#[^\n]*+                                            # a comment
    | \"\"\" (?: [^"\\] | \\. | "(?!"") )*+ \"\"\" "{0,2}+  # strings of several lines may end in up to five quotes
    | ''' (?: [^'] | '(?!'') )*+ ''' '{0,2}+
    | " (?: [^"\\\n] | \\. )*+ "
    | ' [^'\n]*+ '
    | (?P<open> [\[{] )
    | (?P<close> [\]}] )
    | (?P<dot> \. )
    | (?P<end> [\n=,] )
    | (?P<word> [0-9A-Za-z_+:-]{LENGTH,} )
    | (?P<unclosed> ["'] )
    """.replace("NUMBER", _NUMBER).replace("LENGTH", str(MAX_WORD + 1)),
    re.VERBOSE | re.DOTALL,
)


def parse_toml(text: str) -> dict[str, Any]:
    """The tables that ``text`` holds.

    Raises:
        InputError: it is not TOML, or beyond the limits above; the message says in which line.
    """
    _check_limits(text)
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError, OverflowError) as error:
        raise InputError(f"not TOML ({error})") from error


def _check_limits(text: str) -> None:
    """Raise InputError for the first thing that is beyond the limits."""
    depth = dots = 0
    for token in _TOKEN.finditer(text):
        kind = token.lastgroup
        if kind in ("open", "numbers"):
            depth, dots = depth + (kind == "open"), 0
            if depth + (kind == "numbers") > MAX_BRACKETS:
                raise _beyond(text, token, f"more than {MAX_BRACKETS} brackets within one another")
        elif kind == "close":
            depth, dots = depth - 1, 0
        elif kind == "dot":
            dots += 1
            if dots > MAX_DOTS:
                raise _beyond(text, token, f"more than {MAX_DOTS} dots in one key")
        elif kind == "end":
            dots = 0
        elif kind == "word":
            raise _beyond(text, token, f"a number or a bare key of more than {MAX_WORD} characters")
        elif kind == "unclosed":  # the reader stops here, or before
            return


def _beyond(text: str, token: re.Match[str], what: str) -> InputError:
    return InputError(f"line {text.count(chr(10), 0, token.start()) + 1}: {what}, which is not allowed")


def read_toml(path: Path) -> dict[str, Any]:
    """The tables in a file.

    Raises:
        InputError: naming the file; it cannot be read, is not a regular file, is too large, or not TOML.
    """
    data = read_regular(path, MAX_BYTES, "the scene file")
    try:
        return parse_toml(data.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not TOML ({error})") from error
    except InputError as error:
        raise error.within(str(path)) from None
