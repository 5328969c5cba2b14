"""What the scene says of an object's surface, over what its mesh file says."""

from __future__ import annotations

import functools
from typing import Annotated

from pydantic import Field, ValidatorFunctionWrapHandler, WrapValidator
from pydantic.dataclasses import dataclass

from ldtrefl.base.checked import CONFIG, Color, Flag, Fraction, Real, Reflectance, Text, refusing_in_one_line
from ldtrefl.files.picture_reading import stored_picture
from ldtrefl.files.stored_picture import StoredPicture

ROUNDING = 1e-6
"""How far above 1 albedo and mirror may add up without a warning: decimals such as 0.9 and 0.1 are rounded."""


class _NotGiven(tuple[float, float, float]):
    """A colour of a material for which none was given. ``dataclasses.replace`` hands it on to the copy, whose colour
    then was not given either; its albedo follows the copy's ``mirror``."""


def is_given(color: tuple[float, float, float]) -> bool:
    """Whether a colour of a material was given, rather than its default."""
    return not isinstance(color, _NotGiven)


def _check_if_given(value: object, check: ValidatorFunctionWrapHandler) -> object:
    return value if isinstance(value, _NotGiven) else check(value)


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Material:
    """``emission + albedo * texture * light + mirror * reflected radiance``."""

    albedo: Annotated[Color, WrapValidator(_check_if_given)] = _NotGiven((0.8, 0.8, 0.8))
    """0.8 if it is not given; 0 where ``mirror`` is, because a mirror that also scatters light gives back too much.
    Times the colours of the mesh file; of one that has any, 1 if it is not given."""
    texture: Text | None = None
    """A picture, times albedo; needs UVs. Without one, the mesh file's own textures count."""
    emission: Annotated[Color, WrapValidator(_check_if_given)] = _NotGiven((0.0, 0.0, 0.0))
    """Radiance. Without one, the mesh file's own counts."""
    mirror: Reflectance = (0.0, 0.0, 0.0)
    """Specular reflectance; any channel above 0 makes the object a reflector."""
    fresnel: Flag = False
    """Schlick's approximation, with ``mirror`` as the reflectance at normal incidence."""
    metallic: Fraction | None = None
    """As in glTF: 1 for a metal, which reflects with ``albedo`` at normal incidence, 0 for what is not. With one of
    these three given, glTF's model holds; the others, if the mesh file does not say them, are 0, 0 and 1.5."""
    roughness: Fraction | None = None
    """As in glTF: 0 for a mirror, 1 for matt; beside ``mirror``, that of the mirror."""
    ior: Annotated[Real, Field(ge=1.0)] | None = None
    """Index of refraction: says how much reflects at normal incidence of what is no metal."""
    double_sided: Flag | None = None
    """Whether it is seen from behind, too. If it is not given, the mesh file says so, unless ``mirror`` takes the place
    of its material; things without a material are seen from both sides."""

    def __post_init__(self) -> None:
        if isinstance(self.albedo, _NotGiven):
            object.__setattr__(self, "albedo", _NotGiven((0.0 if any(self.mirror) else 0.8,) * 3))

    @property
    def has_model(self) -> bool:
        """Whether it says more than ``albedo``, ``emission`` and a sharp ``mirror``."""
        return self.metallic is not None or self.roughness is not None or self.ior is not None

    @functools.cached_property
    def key(self) -> tuple[object, ...]:
        """What is given: materials with the same key look the same on the same mesh."""
        albedo = self.albedo if is_given(self.albedo) else None
        emission = self.emission if is_given(self.emission) else None
        texture = None if self.picture is None else self.picture.key
        model = self.metallic, self.roughness, self.ior
        return albedo, texture, emission, self.mirror, self.fresnel, *model, self.double_sided

    @functools.cached_property
    def picture(self) -> StoredPicture | None:
        """The picture that ``texture`` names, read when it is first asked for; None without one."""
        return None if self.texture is None else stored_picture(self.texture)

    @property
    def excess(self) -> tuple[float, str] | None:
        """The largest sum of albedo and mirror in a channel, and the channel, where it is above 1; else None."""
        (a, b, c), (d, e, f) = self.albedo, self.mirror
        largest = max(a + d, b + e, c + f)
        if largest <= 1.0 + ROUNDING:
            return None
        return largest, ("red", "green", "blue")[(a + d, b + e, c + f).index(largest)]
