"""What a scene may not need, and the switches for leaving it out: all on, but to measure what each is worth.

None changes a bit of the image.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Annotated, Any

from pydantic import AfterValidator

from ldtrefl.base.errors import InputError, unknown_name


@dataclass(frozen=True)
class Skips:
    """Which skips are on."""

    reflection: bool = True
    """No reflector in view: nothing is culled, peeled or traced."""
    regions: bool = True
    """Objects that no ray of a run can meet: the run's rays are not handed them."""
    maps: bool = True
    """Objects that no ray is handed: never peeled."""
    bounds: bool = True
    """Objects whose bounding sphere a ray misses, or enters behind what it has met: not searched; nearest first."""
    attributes: bool = True
    """Normals of objects that only glow or show their facets, texture coordinates without textures: not made."""
    frames: bool = True
    """What has not changed since the last frame: G-buffer, regions and reflections are kept."""


def names() -> list[str]:
    """The names of all skips."""
    return [entry.name for entry in fields(Skips)]


def chosen(value: str | Iterable[str]) -> Skips:
    """``"all"``, ``"none"``, or names, in a list or with commas between them -> what is on.

    Raises:
        InputError: an unknown name.
    """
    if value in ("all", "none"):
        return Skips(**dict.fromkeys(names(), value == "all"))
    listed = [name.strip() for name in value.split(",")] if isinstance(value, str) else list(value)
    for name in listed:
        if name not in names():
            raise unknown_name("skip", str(name), ["all", "none", *names()])
    return Skips(**{name: name in listed for name in names()})


def _checked(value: Any) -> Any:
    if not isinstance(value, str) and not (isinstance(value, list | tuple) and all(isinstance(n, str) for n in value)):
        raise InputError(f"expected all, none, or names ({', '.join(names())}), got {value!r}")
    chosen(value)
    return value


Choice = Annotated[Any, AfterValidator(_checked)]
"""The type of the option ``skip``."""
