"""The methods that the page shows, and what their own files say: when to choose which, and what each fails at."""

from __future__ import annotations

import re
import sys
import typing
from collections.abc import Iterable
from dataclasses import dataclass

from ldtrefl.base.errors import unknown_name
from ldtrefl.methods import all_methods
from ldtrefl.methods.base import Method

TRUTH = "bvh"

SHOWN_APART = {"ldt": "search", "envmap": "projection", "tessellation": "crack_free"}
"""Method -> its option of which each value makes another method of the page."""


@dataclass(frozen=True)
class Entry:
    """A method as the page shows it."""

    method: type[Method]
    option: str = ""
    """The option that is not as it is by default; empty if all are."""
    value: object = None

    @property
    def label(self) -> str:
        """As the command line has it: the method, and the option if there is one."""
        written = str(self.value).lower() if isinstance(self.value, bool) else self.value
        return f"{self.method.name} {self.option}={written}" if self.option else self.method.name

    @property
    def options(self) -> dict[str, object]:
        """Of the renderer."""
        return {self.option: self.value} if self.option else {}

    @property
    def knows_one_reflection(self) -> bool:
        """Whether light is reflected once at most."""
        return "max_bounces" not in self.method.options()

    @property
    def purpose(self) -> str:
        """When to choose it: the first line of its class."""
        return self.method.describe()

    @property
    def failings(self) -> tuple[str, str]:
        """What it fails at by design, as its file says; and what is said there of all values of the option."""
        value = self.value
        if value is None and self.method.name in SHOWN_APART:
            value = _default(self.method, SHOWN_APART[self.method.name])
        return failings_in(sys.modules[self.method.__module__].__doc__ or "", value)


def entries(names: Iterable[str] = ()) -> list[Entry]:
    """The methods of these names, or all: the truth first, then by name.

    Raises:
        InputError: a name that no method has.
    """
    names = list(names)
    for name in names:
        if name not in all_methods():
            raise unknown_name("method", name, all_methods())
    wanted = [method for name, method in all_methods().items() if name in (names or all_methods()) and name != TRUTH]
    found = [Entry(all_methods()[TRUTH])]
    for method in wanted:
        option = SHOWN_APART.get(method.name, "")
        found.append(Entry(method))
        found += [
            Entry(method, option, value) for value in _values(method, option) if value != _default(method, option)
        ]
    return found


def _values(method: type[Method], option: str) -> tuple[object, ...]:
    """All that an option may be; none if the method has no such option."""
    field = method.Config.__pydantic_fields__.get(option)  # type: ignore[attr-defined]
    if field is None:
        return ()
    return (False, True) if field.annotation is bool else typing.get_args(field.annotation)


def _default(method: type[Method], option: str) -> object:
    return method.options().get(option, (None, ""))[0]


def failings_in(words: str, value: object = None) -> tuple[str, str]:
    """What a method's file says of how it fails: from the line on that begins with "Fails".

    Where each value of an option fails in its own way, in a list, it is the item that begins with this value; and
    besides, as the second text, the paragraph after the list.
    """
    item = re.search(rf"^- ``{re.escape(str(value))}``:.*?(?=^- |\n\n|\Z)", words, re.MULTILINE | re.DOTALL)
    if item and "Fails:" in item[0]:
        after = re.search(r"\n\n(?!- )(.+?)(?=\n\n|\Z)", words[item.end() - 1 :], re.DOTALL)
        return item[0].removeprefix("- ").strip(), after[1].strip() if after else ""
    rest = re.search(r"^Fails\b.*", words, re.MULTILINE | re.DOTALL)
    return (rest[0].strip() if rest else ""), ""
