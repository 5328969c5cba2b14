"""Notices to the user about what is allowed but may not be what was meant: one line, said once."""

from __future__ import annotations

import functools
import logging

_log = logging.getLogger("ldtrefl")


@functools.lru_cache(maxsize=1024)
def warn_once(line: str) -> None:
    """Log a warning, unless the same line was logged before: what it is about may be made many times."""
    _log.warning("%s", line)
