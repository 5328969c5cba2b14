"""Fixtures of launches: no threads made yet, and a Warp that is not known."""

import pytest

from ldtrefl.device import launch, thread_self_test, warp_abi


@pytest.fixture
def no_teams(monkeypatch: pytest.MonkeyPatch) -> None:
    """No team of threads has been made yet."""
    monkeypatch.setattr(launch._state, "teams", {})


@pytest.fixture
def not_self_tested(monkeypatch: pytest.MonkeyPatch) -> None:
    """The self-test of native threads has not run yet."""
    monkeypatch.setattr(thread_self_test, "_result", thread_self_test._Result())


@pytest.fixture
def unknown_warp(monkeypatch: pytest.MonkeyPatch, no_teams: None, not_self_tested: None) -> None:
    """A version of Warp whose layout is unknown."""
    monkeypatch.setattr(warp_abi, "unknown_layout", lambda command, folders: "[made up]")
