"""Functions that return the same object to equal calls for as long as somebody holds it.

A mesh of ten million triangles takes hundreds of megabytes. An ordinary cache would keep it for a later call after the
scene is gone, and no memory budget would count it. So results are held weakly here: those who use them keep them.
"""

from __future__ import annotations

import functools
import threading
import weakref
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Made = TypeVar("Made")


def shared_while_used(make: Callable[..., Made]) -> Callable[..., Made]:
    """Make equal calls of ``make`` return one object for as long as anybody holds it, whichever threads call.

    Arguments are positional and hashable, results can be referred to weakly.
    """
    return _shared(make, lambda result: True)


def shared_while_current(is_current: Callable[[Made], bool]) -> Callable[[Callable[..., Made]], Callable[..., Made]]:
    """The same of what can go out of date.

    Args:
        is_current: whether a result still is what ``make`` would make; if not, it is made anew.
    """
    return functools.partial(_shared, is_current=is_current)


def _shared(make: Callable[..., Made], is_current: Callable[[Made], bool]) -> Callable[..., Made]:
    made: weakref.WeakValueDictionary[Hashable, Any] = weakref.WeakValueDictionary()
    lock = threading.RLock()

    @functools.wraps(make)
    def shared(*arguments: Hashable) -> Made:
        with lock:
            result = made.get(arguments)
            if result is None or not is_current(result):
                result = made[arguments] = make(*arguments)
            return result

    return shared
