"""How much memory a scene may take: estimated and asked for before anything is allocated.

Small files can ask for much: a picture of one colour, a shape of many segments, an archive. So whoever is about to
allocate what a file asks for first *takes* that many bytes from the account in use. An account is opened for a scene,
so that what its files need adds up; outside one, every request stands alone.
"""

from __future__ import annotations

import contextlib
import contextvars
from collections.abc import Iterator
from dataclasses import dataclass

from ldtrefl.errors import InputError

DEFAULT_LIMIT = 4 << 30
"""Bytes: enough for meshes of ten million triangles, and less than most machines have."""


@dataclass
class _Limit:
    value: int = DEFAULT_LIMIT


@dataclass
class _Account:
    taken: int = 0


_limit = _Limit()
_account: contextvars.ContextVar[_Account | None] = contextvars.ContextVar("ldtrefl_account", default=None)


def set_memory_limit(limit: int | None = None) -> None:
    """Let a scene take this many bytes from now on; ``None`` means the default, 4 GiB.

    Raises:
        InputError: not a whole number of at least 1.
    """
    if limit is None:
        limit = DEFAULT_LIMIT
    if isinstance(limit, bool) or not hasattr(limit, "__index__") or limit.__index__() < 1:
        raise InputError(f"the memory limit must be a whole number of bytes, at least 1, got {limit!r}")
    _limit.value = limit.__index__()


def memory_limit() -> int:
    """Bytes that a scene may take."""
    return _limit.value


@contextlib.contextmanager
def account() -> Iterator[None]:
    """Add up what is taken inside this block; inside another account, that one goes on."""
    if _account.get() is not None:
        yield
        return
    token = _account.set(_Account())
    try:
        yield
    finally:
        _account.reset(token)


def take(needed: float, what: str, smaller: str = "") -> None:
    """Ask for memory before it is allocated.

    Args:
        needed: bytes, an estimate.
        what: what needs it, such as "a picture of 16384 x 16384 pixels".
        smaller: which key makes it smaller, such as "params.segments"; the message names it.

    Raises:
        InputError: with what was taken before, it is more than is allowed.
    """
    current = _account.get() or _Account()
    if current.taken + needed > _limit.value:
        before = f" beside {in_words(current.taken)} for the rest of the scene" if current.taken else ""
        ways = f"{smaller} or --memory" if smaller else "--memory"
        raise InputError(
            f"{what} needs {in_words(needed)}{before}, allowed are {in_words(_limit.value)} ({ways} changes that)"
        )
    current.taken += int(needed)


def in_words(count: float) -> str:
    """A number of bytes for people: "1.5 GiB"."""
    for unit, size in (("GiB", 1 << 30), ("MiB", 1 << 20), ("KiB", 1 << 10)):
        if count >= size:
            return f"{count / size:.1f} {unit}"
    return f"{int(count)} bytes"
