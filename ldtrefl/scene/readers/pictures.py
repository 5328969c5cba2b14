"""The pictures that a mesh file names: read from beside it, each once, and none missed in silence."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import PurePosixPath

import numpy as np
from PIL import Image

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.files.mesh_textures import unpacked_picture
from ldtrefl.files.srgb import srgb_from_linear
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.readers.files_beside import Beside

OPAQUE = 255


@dataclass(eq=False)
class Pictures:
    """Pictures by the names that a mesh file has for them."""

    beside: Beside
    not_shown: list[str] = field(default_factory=list)
    """What could not be read, a line each."""
    _read: dict[tuple[str, bool], StoredPicture | None] = field(default_factory=dict)

    def get(self, name: str, *, with_alpha: bool = False) -> StoredPicture | None:
        """A picture; None, and a line in ``not_shown``, if it is missing or damaged.

        Raises:
            InputError: it is larger than is allowed.
        """
        key = (name, with_alpha)
        if key not in self._read:
            self._read[key] = self._unpacked(name, with_alpha=with_alpha)
        return self._read[key]

    def _unpacked(self, name: str, *, with_alpha: bool) -> StoredPicture | None:
        data = file_beside(self.beside, name)
        if data is None:
            self._miss(f"the picture '{name}' (it is not beside the file)")
            return None
        try:
            return unpacked_picture(data, with_alpha=with_alpha)
        except InputError as error:
            if budget.is_refusal(error):
                raise
            self._miss(f"the picture '{name}' ({error})")
            return None

    def _miss(self, line: str) -> None:
        if line not in self.not_shown:
            self.not_shown.append(line)


def file_beside(beside: Beside, name: str) -> bytes | None:
    """A file by the name that a mesh file has for it, or by the last part of that; None if it is not to be had.

    Programs of other systems write backslashes, and paths of the machine that they ran on.

    Raises:
        InputError: it is no plain file, or larger than is allowed.
    """
    plain = name.strip().strip('"').replace("\\", "/")
    for candidate in dict.fromkeys((plain, PurePosixPath(plain).name)):
        try:
            return beside(candidate)
        except InputError:
            raise
        except Exception:  # resolvers raise what they like for what is missing or outside
            continue
    return None


def with_alpha_of(picture: StoredPicture | None, mask: StoredPicture) -> StoredPicture:
    """A picture, or else white, whose alpha is the grey of another, which is brought to its size; of a mask with alpha
    of its own, as PNG files have it, that alpha."""
    values = _values(mask)[..., 1] if is_opaque(mask) else mask.alpha
    assert values is not None
    if picture is None:
        return StoredPicture(np.full((*values.shape, 3), OPAQUE, np.uint8), values.copy())
    return StoredPicture(picture.pixels.copy(), _resized(values, picture.pixels.shape[:2]))


def roughness_and_metallic(roughness: StoredPicture | None, metallic: StoredPicture | None) -> StoredPicture:
    """One picture of two, as glTF has it: roughness is its green and metallic its blue channel; 1 where one is missing,
    and so the number of the material counts. At least one is to be given."""
    size = max((of.pixels.shape[:2] for of in (roughness, metallic) if of is not None), default=(1, 1))
    joined = np.full((*size, 3), OPAQUE, np.uint8)
    for channel, of in ((1, roughness), (2, metallic)):
        if of is not None:
            joined[..., channel] = _resized(_values(of)[..., 1], size)
    return StoredPicture(joined)


def is_grey(picture: StoredPicture) -> bool:
    """Whether a picture has no colours: a map of heights rather than of normals."""
    pixels = picture.pixels
    return bool((pixels[..., 0] == pixels[..., 1]).all() and (pixels[..., 1] == pixels[..., 2]).all())


def is_opaque(picture: StoredPicture) -> bool:
    """Whether a picture has no alpha, or one that hides nothing."""
    return picture.alpha is None or bool((picture.alpha == OPAQUE).all())


def _values(picture: StoredPicture) -> np.ndarray:
    """(h, w, 3) uint8: the values as the file stores them."""
    if picture.pixels.dtype == np.uint8:
        return picture.pixels
    return np.round(srgb_from_linear(picture.pixels) * OPAQUE).astype(np.uint8)


def _resized(values: np.ndarray, size: tuple[int, ...]) -> np.ndarray:
    """(h, w) uint8 at another size (height, width), as a copy."""
    if values.shape == size:
        return values.copy()
    return np.array(Image.fromarray(values).resize((size[1], size[0]), Image.Resampling.BILINEAR))
