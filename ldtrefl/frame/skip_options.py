"""The option ``skip``: which work a frame leaves out where the scene does not need it.

Everything that can be left out is left out by default. The switches are there to measure what each is worth; none of
them changes a bit of the image.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Annotated, Any

from pydantic import AfterValidator

from ldtrefl.base.errors import InputError, unknown_name


@dataclass(frozen=True)
class SkipOptions:
    """Which kinds of work are left out."""

    reflection: bool = True
    """If the camera sees no reflector, nothing is culled, peeled or traced."""
    regions: bool = True
    """An object that no ray of a run can meet is left out of the search for the whole run."""
    maps: bool = True
    """An object that no ray can meet is not peeled."""
    bounds: bool = True
    """An object is not searched for a ray that misses its bounding sphere, or enters it behind the nearest hit so far.
    The objects whose spheres are entered first are searched first."""
    attributes: bool = True
    """Normals are not made for objects that only glow or show their facets, nor texture coordinates for objects without
    textures."""
    frames: bool = True
    """The G-buffer, the reflection regions and the reflections of the last frame are used again where nothing has
    changed."""


def skip_names() -> list[str]:
    """The names that the option ``skip`` may list."""
    return [entry.name for entry in fields(SkipOptions)]


def skip_options_of(value: str | Iterable[str]) -> SkipOptions:
    """The switches that a value of the option ``skip`` stands for.

    Args:
        value: ``"all"``, ``"none"``, or names: a list of them, or one string with commas between them.

    Raises:
        InputError: an unknown name.
    """
    if value in ("all", "none"):
        return SkipOptions(**dict.fromkeys(skip_names(), value == "all"))
    listed = [name.strip() for name in value.split(",")] if isinstance(value, str) else list(value)
    for name in listed:
        if name not in skip_names():
            raise unknown_name("skip", str(name), ["all", "none", *skip_names()])
    return SkipOptions(**{name: name in listed for name in skip_names()})


def _checked(value: Any) -> Any:
    if not isinstance(value, str) and not (isinstance(value, list | tuple) and all(isinstance(n, str) for n in value)):
        raise InputError(f"expected all, none, or names ({', '.join(skip_names())}), got {value!r}")
    skip_options_of(value)
    return value


SkipChoice = Annotated[Any, AfterValidator(_checked)]
"""The type of the option ``skip``."""
