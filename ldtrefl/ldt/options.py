"""The options of a layered depth texture: their types, their defaults, and what is allowed.

The types are used by pydantic: the method ``ldt`` and the command line check their options by the same definitions.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeVar

from pydantic import BeforeValidator, Field, PlainValidator, TypeAdapter, ValidationError

from ldtrefl.base.checked import plain
from ldtrefl.base.errors import first_fault

FEWEST_TEXELS, MOST_TEXELS = 16, 4096
"""Along an object's longest side."""
DEFAULT_RESOLUTION = 256
"""Texels along an object's longest side."""

Quality = Literal["fast", "balanced", "exact"]
"""Of the exact search: ``exact`` tests every triangle; ``balanced`` does so unless they are much finer than texels;
``fast`` tests texels."""
DEFAULT_QUALITY: Quality = "balanced"

DEFAULT_SEARCH = "exact"

TEXEL: Literal["texel"] = "texel"
"""The default of ``linear_steps``: one sample for each texel that the ray passes, and no fewer than ``resolution``."""
MOST_LINEAR_STEPS, MOST_BINARY_STEPS = 100_000, 64
BINARY_STEPS = 8
"""Default of ``binary_steps``: a texel's step is halved to less than a hundredth."""


def _linear_steps(value: object) -> object:
    value = plain(value)
    if value != TEXEL and (type(value) is not int or not 1 <= value <= MOST_LINEAR_STEPS):
        raise ValueError(f"should be '{TEXEL}' or a whole number from 1 to {MOST_LINEAR_STEPS}, got {value!r:.60}")
    return value


Resolution = Annotated[int, BeforeValidator(plain), Field(strict=True, ge=FEWEST_TEXELS, le=MOST_TEXELS)]
"""Texels along an object's longest side."""
LinearSteps = Annotated[int | Literal["texel"], PlainValidator(_linear_steps)]
"""Samples of the linear search on a ray's way through the box: so many, or one for each texel."""
BinarySteps = Annotated[int, BeforeValidator(plain), Field(strict=True, ge=0, le=MOST_BINARY_STEPS)]
"""Bisections of the step that crosses a surface."""

_RESOLUTION: TypeAdapter[int] = TypeAdapter(Resolution)
_QUALITY: TypeAdapter[Quality] = TypeAdapter(Quality)
_LINEAR_STEPS: TypeAdapter[int | Literal["texel"]] = TypeAdapter(LinearSteps)
_BINARY_STEPS: TypeAdapter[int] = TypeAdapter(BinarySteps)

Value = TypeVar("Value")


def checked_resolution(value: object) -> int:
    """A number of texels along the longest side.

    Raises:
        InputError: it is no whole number from 16 to 4096.
    """
    return _checked("resolution", _RESOLUTION, value)


def checked_quality(value: object) -> Quality:
    """A quality.

    Raises:
        InputError: there is none of this name.
    """
    return _checked("quality", _QUALITY, value)


def checked_linear_steps(value: object) -> int | Literal["texel"]:
    """A number of samples, or ``"texel"``.

    Raises:
        InputError: it is neither that nor a whole number from 1 to 100,000.
    """
    return _checked("linear_steps", _LINEAR_STEPS, value)


def checked_binary_steps(value: object) -> int:
    """A number of bisections.

    Raises:
        InputError: it is no whole number from 0 to 64.
    """
    return _checked("binary_steps", _BINARY_STEPS, value)


def _checked(name: str, adapter: TypeAdapter[Value], value: object) -> Value:
    """``value`` as the adapter gives it; what is not allowed is refused by its option's name."""
    try:
        return adapter.validate_python(value)
    except ValidationError as error:
        raise first_fault(error, {}).within(name) from None
