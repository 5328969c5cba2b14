"""Dataclasses that check their values: the types of their fields, and what they raise.

A class is a frozen pydantic dataclass with ``refusing_in_one_line`` above it. Wrong values and unknown names then raise
``InputError`` in Python too, in one line that names the class and the key. The types of fields take NumPy's scalars and
arrays for plain numbers and lists, and a single number for a grey colour.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, PlainValidator, TypeAdapter, ValidationError

from ldtrefl.base.errors import InputError, first_fault

CONFIG = ConfigDict(extra="forbid", arbitrary_types_allowed=True, populate_by_name=True)
"""How every class is checked."""

LARGEST = 1e15
"""Largest coordinate: its square and the products of two stay far inside float32's range once scaled."""

SMALLEST = 1.0 / LARGEST
"""Smallest size, for the same reason."""

BRIGHTEST = 1e9
"""Largest radiance and albedo: the products of any two, and sums of many lights, stay finite in float32."""


def plain(value: object) -> object:
    """NumPy's numbers and arrays as Python's; anything else as it is."""
    return value.tolist() if isinstance(value, (np.generic, np.ndarray)) else value


def _in_range(value: float) -> float:
    """A size that float32 can hold the square of."""
    if not SMALLEST <= value <= LARGEST:
        raise ValueError(f"should be from {SMALLEST:g} to {LARGEST:g}, got {value:g}")
    return value


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _nonzero(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    """A vector that has a direction."""
    if max(map(abs, vector)) < SMALLEST:  # the square of what is shorter is no number to divide by
        raise ValueError(f"must not be the zero vector, nor shorter than {SMALLEST:g}")
    return vector


# Pydantic takes NumPy's numbers for a float. What it does not ask Python for costs a tenth.
Real = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Number = Annotated[Real, Field(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[Real, AfterValidator(_in_range)]
Whole = Annotated[int, BeforeValidator(plain), Field(strict=True)]
Flag = Annotated[bool, BeforeValidator(plain), Field(strict=True)]
Text = Annotated[str, Field(strict=True, min_length=1)]
Vector = Annotated[tuple[Number, Number, Number], BeforeValidator(plain)]
_Row = tuple[Number, Number, Number, Number]
Rows = Annotated[tuple[_Row, _Row, _Row], BeforeValidator(plain)]
Direction = Annotated[Vector, AfterValidator(_nonzero)]

_Radiance = Annotated[Real, Field(ge=0.0, le=BRIGHTEST)]
_Intensity = Annotated[Real, Field(ge=0.0, le=LARGEST)]
Fraction = Annotated[Real, Field(ge=0.0, le=1.0)]


def _grey(channel: Any) -> BeforeValidator:
    """Lets one number stand for three equal channels; what is wrong with it is then said without naming a channel."""
    adapter: TypeAdapter[Any] = TypeAdapter(channel)

    def three_of(value: object) -> object:
        if type(value) is tuple:
            return value
        value = plain(value)
        return (adapter.validate_python(value),) * 3 if _is_number(value) else value

    return BeforeValidator(three_of)


def _one_or_three(value: object) -> float | tuple[float, float, float]:
    """A size, or one for each axis."""
    if type(value) is float and SMALLEST <= value <= LARGEST:
        return value
    value = plain(value)
    return (_ONE_SIZE if _is_number(value) else _THREE_SIZES).validate_python(value)


Color = Annotated[tuple[_Radiance, _Radiance, _Radiance], _grey(_Radiance)]
Intensity = Annotated[tuple[_Intensity, _Intensity, _Intensity], _grey(_Intensity)]
Reflectance = Annotated[tuple[Fraction, Fraction, Fraction], _grey(Fraction)]
Scale = Annotated[float | tuple[float, float, float], PlainValidator(_one_or_three)]  # a union names both faults
_ONE_SIZE: TypeAdapter[Any] = TypeAdapter(Positive)
_THREE_SIZES: TypeAdapter[Any] = TypeAdapter(tuple[Positive, Positive, Positive])

Class = TypeVar("Class", bound=type)


def refusing_in_one_line(cls: Class) -> Class:
    """Make a pydantic dataclass raise ``InputError`` when it is built in Python with wrong values or names.

    Objects that ``load_scene`` builds from a file's tables are not built here: those errors name the place in the file.
    """
    inner = vars(cls)["__init__"]
    names = [entry.name for entry in dataclasses.fields(cls)]
    aliases = {field.alias: name for name, field in vars(cls)["__pydantic_fields__"].items() if field.alias}

    @functools.wraps(inner)
    def __init__(self: Any, *arguments: Any, **values: Any) -> None:
        if arguments:
            example = f"{cls.__name__}({names[0]}=...)"
            raise TypeError(f"{cls.__name__} takes its values by name, such as {example}; names: {', '.join(names)}")
        try:
            inner(self, **values)
        except ValidationError as error:
            raise first_fault(error, {"": names}, aliases).within(cls.__name__) from None
        except InputError as error:
            raise error.within(cls.__name__) from None

    type.__setattr__(cls, "__init__", __init__)
    return cls
