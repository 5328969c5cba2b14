"""``peel``: a layered depth texture of a mesh."""

from __future__ import annotations

from numpy.typing import ArrayLike

from ldtrefl.device import launch
from ldtrefl.ldt.options import (
    DEFAULT_QUALITY,
    DEFAULT_RESOLUTION,
    DEFAULT_SEARCH,
    Quality,
    checked_quality,
    checked_resolution,
)
from ldtrefl.ldt.texel_frame import texel_frame
from ldtrefl.ldt.texture import LayeredDepthTexture
from ldtrefl.scene.mesh import Mesh
from ldtrefl.world.device_mesh import DeviceMesh


def peel(
    vertices: ArrayLike,
    faces: ArrayLike,
    resolution: int = DEFAULT_RESOLUTION,
    device: str | None = None,
    *,
    quality: Quality = DEFAULT_QUALITY,
    search: str = DEFAULT_SEARCH,
) -> LayeredDepthTexture:
    """Peel a triangle mesh into a layered depth texture.

    Args:
        vertices: (n, 3) numbers, object space.
        faces: (m, 3) vertex numbers.
        resolution: texels along the longest side of the bounding box, 16 to 4096.
        device: 'cpu' (default) or a CUDA device.
        quality: of the exact search: ``"exact"`` tests every triangle; ``"balanced"`` does so unless they are much
            finer than texels; ``"fast"`` tests texels.
        search: what the maps are made ready for now; another search makes what it needs when it is first used.

    Raises:
        InputError: an empty mesh, an index out of range, a vertex that is not finite, a value not allowed.
    """
    geometry = DeviceMesh(Mesh(vertices, faces), launch.resolve_device(device))
    return peel_mesh(geometry, resolution, quality=quality, search=search)


def peel_mesh(
    geometry: DeviceMesh,
    resolution: int = DEFAULT_RESOLUTION,
    *,
    quality: Quality = DEFAULT_QUALITY,
    search: str = DEFAULT_SEARCH,
    trusted: bool = False,
) -> LayeredDepthTexture:
    """:func:`peel` for a mesh that is on a device already; ``trusted`` if the resolution is finer than what is seen."""
    frame = texel_frame(geometry.mesh, checked_resolution(resolution))
    texture = LayeredDepthTexture(geometry, frame, checked_quality(quality), trusted)
    texture.view(search)
    return texture
