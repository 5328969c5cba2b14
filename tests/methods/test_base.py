"""What every reflection method has: options with defaults and words, checked in one line, and one line on itself."""

import pytest

from ldtrefl.base.errors import InputError
from ldtrefl.methods import all_methods, find_method
from ldtrefl.methods.base import CommonConfig, RaylessMethod, RayMethod


@pytest.mark.parametrize("name", all_methods())
def test_every_method_describes_itself_and_its_options(name: str) -> None:
    method = find_method(name)
    assert method.name == name and method.describe().endswith(".") and issubclass(method.Config, CommonConfig)
    assert issubclass(method, RaylessMethod) != issubclass(method, RayMethod)
    assert "skip" in method.options()
    for option, (default, words) in method.options().items():
        assert words, f"{option} has no words"
        assert getattr(method.configured({}), option) == default


@pytest.mark.parametrize("name", all_methods())
def test_wrong_options_are_refused_in_one_line(name: str) -> None:
    with pytest.raises(InputError, match=rf"unknown option of method {name} 'skp'; did you mean 'skip'\?"):
        find_method(name).configured({"skp": "all"})
    with pytest.raises(InputError, match=rf"^method {name}: .*unknown skip 'map'"):
        find_method(name).configured({"skip": "map"})
