"""Materials of parts of meshes, as files give them."""

from __future__ import annotations

from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.mesh import Part
from ldtrefl.scene.surface_material import SurfaceMaterial, Texture


def textured(picture: StoredPicture, color: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> SurfaceMaterial:
    """A matt material with a picture."""
    return SurfaceMaterial(base_color=color, base_texture=Texture(picture))


def picture_of(part: Part) -> StoredPicture | None:
    """The picture of a part's base colour."""
    texture = part.material.base_texture
    return None if texture is None else texture.picture
