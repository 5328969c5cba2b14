"""How much memory a scene may take: estimated and asked for before anything is allocated.

Small files can ask for much: a picture of one colour, a shape of many segments, an archive. So a reader that is about
to allocate what a file asks for first *takes* that many bytes from the account in use. An account is opened for a
scene, so that the needs of all its files add up. Outside an account, every request is counted alone.

The promise for untrusted files (``SECURITY.md`` has the table by kind of file): loading and rendering take no more than
the limit, and half a gigabyte for the program itself. The limit is 4 GiB; the environment variable ``LDTREFL_MEMORY``,
``--memory`` and :func:`set_memory_limit` set another. Estimates are peaks that were measured, of loading and rendering
together.
"""

from __future__ import annotations

import contextlib
import contextvars
import operator
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import SupportsIndex

from ldtrefl.base.errors import InputError

DEFAULT_LIMIT = 4 << 30
"""Bytes: enough for meshes of ten million triangles, and less than most machines have."""

VARIABLE = "LDTREFL_MEMORY"
"""Environment variable that holds another limit."""

UNITS = {"": 1, "K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40}
"""Bytes in a unit, by its first letter."""


@dataclass
class _Limit:
    """The limit that was set by a call."""

    value: int | None = None
    """Bytes; ``None`` for the environment's limit, or else the default."""


@dataclass
class Account:
    """The memory that was asked for, for one scene."""

    taken: int = 0
    """Bytes."""


_limit = _Limit()
_account: contextvars.ContextVar[Account | None] = contextvars.ContextVar("ldtrefl_account", default=None)


def set_memory_limit(limit: SupportsIndex | None = None) -> None:
    """Let a scene take this many bytes from now on; ``None`` means the limit of ``LDTREFL_MEMORY``, or else 4 GiB.

    Raises:
        InputError: ``limit`` is not a whole number of at least 1.
    """
    if limit is None:
        _limit.value = None
        return
    try:
        count = operator.index(limit)
    except TypeError:
        count = 0
    if isinstance(limit, bool) or count < 1:
        raise InputError(f"the memory limit must be a whole number of bytes, at least 1, got {limit!r}")
    _limit.value = count


def memory_limit() -> int:
    """Bytes that a scene may take.

    Raises:
        InputError: no limit was set by a call, and ``LDTREFL_MEMORY`` holds something that is no size.
    """
    if _limit.value is not None:
        return _limit.value
    given = os.environ.get(VARIABLE, "")
    return size_of(given, VARIABLE) if given.strip() else DEFAULT_LIMIT


def size_of(text: str, place: str) -> int:
    """Bytes that "8G", "1.5 GiB", "512M" or "1000000" stand for; units are powers of 1024.

    Args:
        text: what a person wrote.
        place: the option or variable that holds it; the message names it.

    Raises:
        InputError: it is no size of at least one byte.
    """
    number = re.fullmatch(r"\s*(\d{1,18}(?:\.\d{1,9})?)\s*([KMGT]?)(?:i?B)?\s*", text, re.IGNORECASE | re.ASCII)
    count = int(float(number[1]) * UNITS[number[2].upper()]) if number else 0
    if count < 1:
        raise InputError(f"{place}: expected a size such as 8G, 512M or a number of bytes, got '{text[:40]}'")
    return count


@contextlib.contextmanager
def account() -> Iterator[Account]:
    """Add up all memory that is asked for inside this block. Inside another account's block that account is used."""
    current = _account.get()
    if current is not None:
        yield current
        return
    current = Account()
    token = _account.set(current)
    try:
        yield current
    finally:
        _account.reset(token)


@contextlib.contextmanager
def given_back() -> Iterator[None]:
    """Add up the memory that is asked for inside this block, and give it back at the block's end."""
    with account() as current:
        before = current.taken
        try:
            yield
        finally:
            current.taken = before


def take(needed: float, what: str, smaller: str = "") -> None:
    """Ask for memory before it is allocated.

    Args:
        needed: bytes, an estimate.
        what: what needs it, such as "a picture of 16384 x 16384 pixels".
        smaller: which key makes it smaller, such as "params.segments"; the message names it.

    Raises:
        InputError: with what was taken before, it is more than is allowed.
    """
    current, limit = _account.get() or Account(), memory_limit()
    if current.taken + needed > limit:
        before = f" beside {in_words(current.taken)} for the rest of the scene" if current.taken else ""
        ways = f"{smaller} or --memory" if smaller else "--memory"
        raise InputError(
            f"{what} needs {in_words(needed)}{before}, allowed are {in_words(limit)} ({ways} changes that)"
        )
    current.taken += int(needed)


def in_words(count: float) -> str:
    """A number of bytes for people: "1.5 GiB"."""
    for unit, size in (("GiB", 1 << 30), ("MiB", 1 << 20), ("KiB", 1 << 10)):
        if count >= size:
            return f"{count / size:.1f} {unit}"
    return f"{int(count)} bytes"


def is_refusal(error: InputError) -> bool:
    """Whether an error says that something takes more memory than is allowed."""
    return "--memory" in str(error)
