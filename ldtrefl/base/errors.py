"""The error that a user's wrong input raises: one line that says where, what is wrong, and what is allowed."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError


UNKNOWN_KEY = ("extra_forbidden", "unexpected_keyword_argument")
"""Pydantic's names for the error that a table has no such key."""


class InputError(ValueError):
    """The user's input is wrong. The message is one line; the command line prints it and exits with status 2."""

    def __init__(self, message: str) -> None:
        super().__init__(printable(" ".join(str(message).split())))

    def within(self, place: str) -> InputError:
        """The same error with a place, the file or key that holds it, in front of its message."""
        return InputError(f"{place}: {self}")


class NotForThisScene(InputError):
    """A reflection method is not made for such a scene. The message names what it cannot take, and what to use."""

    def within(self, place: str) -> InputError:
        """The same error with a place in front of its message."""
        return NotForThisScene(f"{place}: {self}")


def printable(text: str) -> str:
    """``text`` with characters that a terminal would obey, or could not show, as escapes. Names may come from files."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def unknown_name(kind: str, name: str, allowed: Iterable[str]) -> InputError:
    """An ``InputError`` for a name that is not one of ``allowed``: it suggests the nearest.

    Args:
        kind: what the name is of, such as "method".
        name: what the user wrote.
        allowed: all that may be written.
    """
    names = sorted(allowed)
    near = difflib.get_close_matches(name, names, n=1)
    hint = f"; did you mean '{near[0]}'?" if near else ""
    return InputError(f"unknown {kind} '{name}'{hint} (allowed: {', '.join(names)})")


def first_fault(
    error: ValidationError, allowed_keys: dict[str, list[str]], names: dict[str, str] | None = None
) -> InputError:
    """The first error that pydantic found, as one line with its full key.

    Args:
        error: what pydantic raised.
        allowed_keys: the key of a table, without indices ("object.material"; "" at the top) -> the keys that it may
            hold.
        names: a key at the top of the file -> its name in Python, where that is another.
    """
    faults = error.errors(include_url=False, include_context=True)
    # A misspelt key often shows as a missing one too: the unknown key is the one to name.
    fault = next((fault for fault in faults if fault["type"] in UNKNOWN_KEY), faults[0])
    location = [part for part in fault["loc"] if not str(part).startswith("function-")]
    if names and location:
        location[0] = names.get(str(location[0]), location[0])
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    if fault["type"] in UNKNOWN_KEY:
        table = ".".join(str(part) for part in location[:-1] if isinstance(part, str))
        where = _key(location[:-1])
        unknown = unknown_name("key", str(location[-1]), allowed_keys.get(table, []))
        return unknown.within(where) if where else unknown
    given = ""
    if fault["type"] not in ("missing", "missing_argument", "value_error"):
        given = f", got {_shortened(fault['input'])}"
    message = fault["msg"].removeprefix("Value error, ").removeprefix("Input ").replace("a valid tuple", "a list")
    text = f"{message}{given}{more}"
    key = _key(location)
    return InputError(f"{key}: {text}" if key else text)


def _key(location: Iterable[int | str]) -> str:
    """A place in tables and lists as people write it: "object[2].material.albedo"."""
    key = ""
    for part in location:
        key += f"[{part}]" if isinstance(part, int) else f".{part}" if key else part
    return key


def _shortened(value: object, limit: int = 60) -> str:
    """A value as Python writes it, of at most ``limit`` characters."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # a whole number of thousands of digits, lists in lists in lists
        return f"a {type(value).__name__} too large to be shown"
    return text if len(text) <= limit else text[: limit - 3] + "..."
