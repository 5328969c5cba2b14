"""What tests of readers share: the usual memory limit before each."""

import pytest

from ldtrefl.base import budget


@pytest.fixture(autouse=True)
def usual_limit() -> None:
    budget.set_memory_limit()
