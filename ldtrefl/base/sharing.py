"""Results that are shared while somebody holds them, and held by nobody else.

A mesh of ten million triangles takes hundreds of megabytes. A cache that keeps it alive for a later call keeps it after
the scene is gone, outside every budget. So what is made once for equal calls is held weakly: all who use it hold it.
"""

from __future__ import annotations

import functools
import threading
import weakref
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Made = TypeVar("Made")


def shared_while_used(make: Callable[..., Made]) -> Callable[..., Made]:
    """Make equal calls of ``make`` return one object for as long as it is used, whichever threads call. Arguments must
    be hashable."""
    made: weakref.WeakValueDictionary[Hashable, Any] = weakref.WeakValueDictionary()
    lock = threading.RLock()

    @functools.wraps(make)
    def shared(*arguments: Hashable) -> Made:
        with lock:
            result = made.get(arguments)
            if result is None:
                result = made[arguments] = make(*arguments)
            return result

    return shared
