"""The answer of a reflection method: the radiance that reaches each reflector pixel by way of the mirror."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import warp as wp

from ldtrefl.frame.bounce_hits import FirstHits
from ldtrefl.frame.bounces import FollowedRays
from ldtrefl.world.device_mesh import DeviceMesh


@dataclass(frozen=True, eq=False)
class ReflectedLight:
    """A method's answer."""

    radiance: wp.array
    """(m,) vec3: of each of the G-buffer's ``reflector_pixels``, before the reflector's own reflectance."""
    hits: FirstHits | None = None
    """Where the first rays ended, for methods that have rays."""
    followed: FollowedRays | None = None
    """Those rays, if the next frame may use them again."""
    resolutions: Mapping[DeviceMesh, int] = field(default_factory=dict)
    """By mesh, the resolution of the maps that the rays were searched for in. It must be the same to use them again."""
    searched_by_camera: frozenset[DeviceMesh] = frozenset()
    """The meshes that were searched triangle by triangle because the camera's rays were; the same holds of them."""
