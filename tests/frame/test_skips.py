"""Which skips are on: by the names that users give."""

import pytest

from ldtrefl.base.errors import InputError
from ldtrefl.frame.skips import Skips, chosen, names


def test_all_none_and_lists() -> None:
    assert chosen("all") == Skips() and not any(vars(chosen("none")).values())
    assert chosen("maps, bounds") == chosen(["bounds", "maps"])
    assert [name for name, is_on in vars(chosen("maps,bounds")).items() if is_on] == ["maps", "bounds"]
    assert chosen(names()) == Skips()


def test_an_unknown_name_is_refused_with_the_nearest() -> None:
    with pytest.raises(InputError, match="unknown skip 'bound'; did you mean 'bounds'"):
        chosen("maps,bound")
