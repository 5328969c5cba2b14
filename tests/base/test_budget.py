"""The memory budget: sizes as people write them, limits and where they come from, and what an account adds up."""

import numpy as np
import pytest

from ldtrefl import InputError
from ldtrefl.base import budget


@pytest.fixture(autouse=True)
def default_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test starts with the default limit."""
    monkeypatch.delenv(budget.VARIABLE, raising=False)


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("8G", 8 << 30),
        ("512M", 512 << 20),
        ("1.5 GiB", 3 << 29),
        ("7kb", 7 << 10),
        ("1000000", 10**6),
        (" 2t ", 2 << 40),
    ],
)
def test_sizes_as_people_write_them(text: str, count: int) -> None:
    assert budget.size_of(text, "--memory") == count


@pytest.mark.parametrize("text", ["", "0", "-1G", "8X", "G", "nan", "1e9", "9" * 400, "1" * 4400, "\uff18G", "0.1"])
def test_what_is_no_size(text: str) -> None:
    with pytest.raises(InputError, match="--memory: expected a size such as 8G"):
        budget.size_of(text, "--memory")


@pytest.mark.parametrize(
    ("count", "words"), [(0, "0 bytes"), (1023, "1023 bytes"), (1 << 10, "1.0 KiB"), (3 << 29, "1.5 GiB")]
)
def test_sizes_as_people_read_them(count: int, words: str) -> None:
    assert budget.in_words(count) == words


def test_the_environment_sets_the_limit_and_the_caller_wins(monkeypatch: pytest.MonkeyPatch) -> None:
    assert budget.memory_limit() == budget.DEFAULT_LIMIT
    monkeypatch.setenv(budget.VARIABLE, "1M")
    assert budget.memory_limit() == 1 << 20
    budget.set_memory_limit(5)
    assert budget.memory_limit() == 5
    budget.set_memory_limit(None)
    monkeypatch.setenv(budget.VARIABLE, "plenty")
    with pytest.raises(InputError, match="LDTREFL_MEMORY: expected a size"):
        budget.take(1, "a box")


def test_limits_are_whole_numbers() -> None:
    for limit in (7, np.int64(7), np.uint8(7)):
        budget.set_memory_limit(limit)
        assert budget.memory_limit() == 7
    for wrong in (0, -1, 2.0, "8G", True, np.float64(3.0)):
        with pytest.raises(InputError, match="the memory limit must be a whole number of bytes, at least 1"):
            budget.set_memory_limit(wrong)  # type: ignore[arg-type]
        assert budget.memory_limit() == 7


def test_requests_stand_alone_outside_an_account() -> None:
    budget.set_memory_limit(100)
    for _ in range(3):
        budget.take(100, "a picture")
    with pytest.raises(InputError, match=r"^a picture needs 101 bytes, allowed are 100 bytes \(a smaller one or --mem"):
        budget.take(101, "a picture", "a smaller one")


def test_an_account_adds_up_and_one_inside_it_goes_on() -> None:
    budget.set_memory_limit(100)
    with budget.account() as outer:
        budget.take(60, "a mesh")
        with budget.account() as inner:
            assert inner is outer
            with pytest.raises(InputError, match=r"a shape needs 41 bytes beside 60 bytes for the rest of the scene"):
                budget.take(41, "a shape")
            budget.take(40, "a shape")
        assert outer.taken == 100
    budget.take(100, "another scene's mesh")


def test_what_is_given_back_can_be_taken_again() -> None:
    budget.set_memory_limit(100)
    with budget.account() as account:
        budget.take(60, "a mesh")
        for _ in range(3):
            with budget.given_back():
                budget.take(30, "a ray")
                with pytest.raises(InputError, match="another ray needs 11 bytes beside 90 bytes"):
                    budget.take(11, "another ray")
            assert account.taken == 60
        with pytest.raises(KeyError), budget.given_back():
            budget.take(40, "a ray")
            raise KeyError
        assert account.taken == 60
    with budget.given_back():  # outside an account, too, what is asked for inside adds up
        budget.take(60, "a ray")
        with pytest.raises(InputError, match="beside 60 bytes"):
            budget.take(41, "a ray")
