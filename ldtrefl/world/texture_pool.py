"""Textures of a look on a device, each picture once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import warp as wp

from ldtrefl.base.errors import InputError
from ldtrefl.files.srgb import srgb_from_linear
from ldtrefl.scene.surface_material import Texture
from ldtrefl.world.look_records import (
    CLAMP,
    FRACTION_BYTES,
    LINEAR_FLOATS,
    MIRROR,
    REPEAT,
    SRGB_BYTES,
    LookRecord,
    TextureRecord,
)
from ldtrefl.world.mip_maps import mip_alpha, mip_maps

WRAPS = {"repeat": REPEAT, "clamp": CLAMP, "mirror": MIRROR}


class _Texels:
    """Arrays of texels, one after the other, each once."""

    def __init__(self) -> None:
        self.arrays: list[np.ndarray] = []
        self._firsts: dict[tuple[str, bool], int] = {}
        self._total = 0

    def first_of(self, key: tuple[str, bool], make: Callable[[], np.ndarray]) -> int:
        """The number of the first texel of the array with this key, which is made and added if it is new."""
        if key not in self._firsts:
            self.arrays.append(make())
            self._firsts[key] = self._total
            self._total += len(self.arrays[-1])
        return self._firsts[key]


class TexturePool:
    """Collects textures, then uploads them; with their mip maps if it ``filters``."""

    def __init__(self, *, filters: bool = False) -> None:
        self._filters = filters
        self._numbers: dict[str, int] = {}  # of each texture, by its key
        self._records: list[TextureRecord] = []
        self._texels: dict[type, _Texels] = {np.float32: _Texels(), np.uint8: _Texels()}
        self._mips: dict[type, _Texels] = {np.float32: _Texels(), np.uint8: _Texels()}
        self._alpha, self._mip_alpha = _Texels(), _Texels()

    def number_of(self, texture: Texture) -> int:
        """The number of a texture; it is added if it is new."""
        if texture.key not in self._numbers:
            self._numbers[texture.key] = len(self._records)
            self._records.append(self._added(texture))
        return self._numbers[texture.key]

    def _added(self, texture: Texture) -> TextureRecord:
        picture, record = texture.picture, TextureRecord()
        is_bytes, is_data = picture.pixels.dtype == np.uint8, texture.is_data
        kind: type = np.uint8 if is_bytes else np.float32

        def values() -> np.ndarray:
            # Floats are linear: of those that are fractions the decoding is undone.
            return srgb_from_linear(picture.pixels) if is_data and not is_bytes else picture.pixels

        record.height, record.width = picture.pixels.shape[:2]
        key = (picture.key, is_data and not is_bytes)
        record.first = self._texels[kind].first_of(key, lambda: np.ascontiguousarray(values(), kind).reshape(-1, 3))
        record.stored = LINEAR_FLOATS if not is_bytes else FRACTION_BYTES if is_data else SRGB_BYTES
        record.first_alpha = -1
        alpha = picture.alpha
        if alpha is not None:
            key = (picture.key, False)
            record.first_alpha = self._alpha.first_of(key, lambda: np.ascontiguousarray(alpha).reshape(-1))
        if self._filters:
            key = (picture.key, is_data)
            record.first_mip = self._mips[kind].first_of(key, lambda: mip_maps(values(), alpha, is_data=is_data))
        if self._filters and alpha is not None:
            record.first_mip_alpha = self._mip_alpha.first_of((picture.key, False), lambda: mip_alpha(alpha))
        record.uv_set, record.is_nearest = texture.uv_set, int(texture.is_nearest)
        record.wrap = wp.vec2i(*(WRAPS[wrap] for wrap in texture.wrap))
        record.across, record.down = wp.vec3(*texture.transform[:3]), wp.vec3(*texture.transform[3:])
        return record

    def upload(self, look: LookRecord, device: wp.Device) -> None:
        """Set the textures of a look.

        Raises:
            InputError: they have more texels than can be numbered.
        """
        look.textures = wp.array(self._records, dtype=TextureRecord, device=device)
        if not self._records:
            look.textures = wp.empty(0, dtype=TextureRecord, device=device)
        look.texels = joined_texels(self._texels[np.float32].arrays, wp.vec3, device)
        look.texel_bytes = joined_texels(self._texels[np.uint8].arrays, wp.vec3ub, device)
        look.texel_alpha = joined_texels(self._alpha.arrays, wp.uint8, device)
        look.mip_texels = joined_texels(self._mips[np.float32].arrays, wp.vec3, device)
        look.mip_bytes = joined_texels(self._mips[np.uint8].arrays, wp.vec3ub, device)
        look.mip_alpha = joined_texels(self._mip_alpha.arrays, wp.uint8, device)


def joined_texels(pools: list[np.ndarray], dtype: type, device: wp.Device) -> wp.array:
    """Arrays of texels, one after the other, on a device. On the CPU a single one is not copied: it may be large.

    Raises:
        InputError: they are more than can be numbered.
    """
    total = sum(len(pool) for pool in pools)
    if total > np.iinfo(np.int32).max:
        raise InputError(f"an object's textures have {total} texels, at most {np.iinfo(np.int32).max} allowed")
    if len(pools) == 1:
        return wp.array(pools[0], dtype=dtype, device=device, copy=False)
    joined = wp.empty(total, dtype=dtype, device=device)
    first = 0
    for pool in pools:
        wp.copy(joined, wp.array(pool, dtype=dtype, device=device, copy=False), dest_offset=first)
        first += len(pool)
    return joined
