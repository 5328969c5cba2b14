"""``ldtrefl methods``: every method."""

from collections.abc import Callable

from ldtrefl.methods import all_methods
from tests.cli.conftest import Done


def test_it_lists_every_method_and_option(run: Callable[..., Done]) -> None:
    lines = run("methods").output.splitlines()
    for name, method in all_methods().items():
        assert f"{name}  {method.describe()}" in lines
        for option, (default, words) in method.options().items():
            assert words and f"    {option} = {default!r}  {words}" in lines
