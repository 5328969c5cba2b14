"""Notices are logged once, as they are."""

import logging

import pytest

from ldtrefl.base.notices import warn_once


def test_a_line_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    warn_once.cache_clear()
    with caplog.at_level(logging.WARNING, "ldtrefl"):
        for line in ("100% of one", "another", "100% of one"):
            warn_once(line)
    assert [(record.name, record.levelname, record.getMessage()) for record in caplog.records] == [
        ("ldtrefl", "WARNING", "100% of one"),
        ("ldtrefl", "WARNING", "another"),
    ]
