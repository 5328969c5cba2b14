"""The option ``skip``: which switches are on, by the names that users give."""

import pytest

from ldtrefl.base.errors import InputError
from ldtrefl.frame.skip_options import SkipOptions, skip_names, skip_options_of


def test_all_none_and_lists() -> None:
    assert skip_options_of("all") == SkipOptions() and not any(vars(skip_options_of("none")).values())
    assert skip_options_of("maps, bounds") == skip_options_of(["bounds", "maps"])
    assert [name for name, is_on in vars(skip_options_of("maps,bounds")).items() if is_on] == ["maps", "bounds"]
    assert skip_options_of(skip_names()) == SkipOptions()


def test_an_unknown_name_is_refused_with_the_nearest() -> None:
    with pytest.raises(InputError, match="unknown skip 'bound'; did you mean 'bounds'"):
        skip_options_of("maps,bound")
