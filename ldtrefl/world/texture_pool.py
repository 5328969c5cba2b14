"""Textures of a look on a device, each picture once."""

from __future__ import annotations

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

WRAPS = {"repeat": REPEAT, "clamp": CLAMP, "mirror": MIRROR}


class TexturePool:
    """Collects textures, then uploads them."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}  # of each texture, by its key
        self._records: list[TextureRecord] = []
        self._places: dict[tuple[str, bool], int] = {}  # the first texel of each picture
        self._alpha_places: dict[str, int] = {}
        self._pools: dict[type, list[np.ndarray]] = {np.float32: [], np.uint8: []}
        self._alpha: list[np.ndarray] = []

    def number_of(self, texture: Texture) -> int:
        """The number of a texture; it is added if it is new."""
        if texture.key not in self._numbers:
            self._numbers[texture.key] = len(self._records)
            self._records.append(self._added(texture))
        return self._numbers[texture.key]

    def _added(self, texture: Texture) -> TextureRecord:
        picture, record = texture.picture, TextureRecord()
        pixels = picture.pixels
        is_bytes = pixels.dtype == np.uint8
        # Floats are linear: of those that are fractions the decoding is undone.
        place = (picture.key, texture.is_data and not is_bytes)
        pool = self._pools[np.uint8 if is_bytes else np.float32]
        if place not in self._places:
            self._places[place] = sum(map(len, pool))
            values = srgb_from_linear(pixels) if place[1] else pixels
            pool.append(np.ascontiguousarray(values, values.dtype).reshape(-1, 3))
        record.first, record.height, record.width = self._places[place], *pixels.shape[:2]
        record.stored = LINEAR_FLOATS if not is_bytes else FRACTION_BYTES if texture.is_data else SRGB_BYTES
        record.first_alpha = -1 if picture.alpha is None else self._alpha_place(picture.key, picture.alpha)
        record.uv_set, record.is_nearest = texture.uv_set, int(texture.is_nearest)
        record.wrap = wp.vec2i(*(WRAPS[wrap] for wrap in texture.wrap))
        record.across, record.down = wp.vec3(*texture.transform[:3]), wp.vec3(*texture.transform[3:])
        return record

    def _alpha_place(self, key: str, alpha: np.ndarray) -> int:
        if key not in self._alpha_places:
            self._alpha_places[key] = sum(map(len, self._alpha))
            self._alpha.append(np.ascontiguousarray(alpha).reshape(-1))
        return self._alpha_places[key]

    def upload(self, look: LookRecord, device: wp.Device) -> None:
        """Set the textures of a look.

        Raises:
            InputError: they have more texels than can be numbered.
        """
        look.textures = wp.array(self._records, dtype=TextureRecord, device=device)
        if not self._records:
            look.textures = wp.empty(0, dtype=TextureRecord, device=device)
        look.texels = joined_texels(self._pools[np.float32], wp.vec3, device)
        look.texel_bytes = joined_texels(self._pools[np.uint8], wp.vec3ub, device)
        look.texel_alpha = joined_texels(self._alpha, wp.uint8, device)


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
