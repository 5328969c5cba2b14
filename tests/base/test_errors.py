"""Errors of wrong input: one line that names the place, safe to print, with the nearest name that is allowed."""

import re

import pytest
from pydantic import TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from ldtrefl.base.checked import CONFIG
from ldtrefl.base.errors import InputError, first_fault, printable, unknown_name


@dataclass(config=CONFIG)
class Shade:
    """A table in a table."""

    albedo: float = 0.0


@dataclass(config=CONFIG)
class Things:
    """Tables, and numbers, by name."""

    shades: tuple[Shade, ...] = ()
    numbers: tuple[float, float] = (0.0, 0.0)


ALLOWED = {"": ["shades", "numbers"], "shades": ["albedo"]}


def fault_of(table: dict) -> str:
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(Things).validate_python(table)
    return str(first_fault(caught.value, ALLOWED, {"numbers": "pair"}))


def test_a_message_is_one_line_that_can_be_printed() -> None:
    error = InputError("a\nb\t\x1b[31m  c\u202e")
    assert str(error) == r"a b \x1b[31m c\u202e" and isinstance(error, ValueError)
    assert str(error.within("scene.toml")) == r"scene.toml: a b \x1b[31m c\u202e"
    assert printable("Größe 3 µm") == "Größe 3 µm"


def test_unknown_names_suggest_the_nearest() -> None:
    assert str(unknown_name("method", "ltd", ["ldt", "bvh"])) == (
        "unknown method 'ltd'; did you mean 'ldt'? (allowed: bvh, ldt)"
    )
    assert str(unknown_name("method", "xyz", ["ldt", "bvh"])) == "unknown method 'xyz' (allowed: bvh, ldt)"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"shades": [{}, {"albedo": "dark"}]}, r"shades\[1\]\.albedo: .*number.*, got 'dark'$"),
        ({"shades": [{"albdeo": 1}]}, r"^shades\[0\]: unknown key 'albdeo'; did you mean 'albedo'\?"),
        ({"shads": []}, r"^unknown key 'shads'; did you mean 'shades'\? \(allowed: numbers, shades\)$"),
        ({"numbers": [1, "x"]}, r"^pair\[1\]: "),
        ({"numbers": ["x", "y"]}, r"^pair\[0\]: .* \(and 1 more\)$"),
        ({"numbers": "x" * 1000}, r"^pair: .*got 'x{50,60}\.\.\.$"),
    ],
)
def test_the_first_fault_names_its_key(table: dict, message: str) -> None:

    assert re.search(message, fault_of(table)), fault_of(table)
