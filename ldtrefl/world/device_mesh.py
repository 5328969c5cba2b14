"""A mesh on a device. Objects with the same mesh share its arrays."""

from __future__ import annotations

import functools

import numpy as np
import warp as wp

from ldtrefl.device import warp_abi
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.description import Object, Reflection
from ldtrefl.scene.material import Material
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.two_sided import triangles_with_image
from ldtrefl.scene.welding import first_of_equals
from ldtrefl.world.appearance import Appearance, appearance_of
from ldtrefl.world.clusters import Clusters, clustered
from ldtrefl.world.hidden_backs import hides_backs
from ldtrefl.world.looks import Look, has_material, look_of, mesh_needs_look
from ldtrefl.world.outliers import Outliers, outliers_of


class DeviceMesh:
    """A mesh's arrays on a device. Normals, texture coordinates and textures, which only shading needs, are uploaded
    when they are first asked for. On the CPU all arrays are the mesh's own memory, which nobody writes."""

    def __init__(self, mesh: Mesh, device: wp.Device, *, filters: bool = False) -> None:
        """Upload the vertices and faces of a mesh; with ``filters``, textures will have their mip maps."""
        self.mesh = mesh
        self._filters = filters
        self.vertices = wp.array(mesh.unit_vertices, dtype=wp.vec3, device=device, copy=False)
        self.faces = wp.array(mesh.faces, dtype=wp.vec3i, device=device, copy=False)
        self.attribute_bytes = 0
        """Bytes of the normals and texture coordinates that have been uploaded."""
        self._appearances: dict[str | None, Appearance] = {}
        """By key of the texture."""
        self._looks: dict[object, Look] = {}
        """By what the scene says of an object, and of reflections."""

    @functools.cached_property
    def reach(self) -> float:
        """How far from the centre of its box the mesh reaches, in unit space."""
        vertices, is_used = self.mesh.unit_vertices, self.mesh.is_used
        used = vertices if is_used.all() else vertices[is_used]
        return float(np.sqrt(np.einsum("ij,ij->i", used, used, dtype=float).max()))

    @functools.cached_property
    def unit_bounds(self) -> np.ndarray:
        """(2, 3) float64: the lowest and highest corner of the box about all triangles, in unit space."""
        centre, half = self.mesh.unit_frame
        return (self.mesh.bounds - centre) / half

    @functools.cached_property
    def outliers(self) -> Outliers:
        """The mesh's triangles far outside its bulk."""
        return outliers_of(self.mesh, self.vertices.device)

    @functools.cached_property
    def clusters(self) -> Clusters:
        """The mesh's triangles in clusters, of a mesh without outliers."""
        return clustered(self.mesh, self.vertices.device)

    @functools.cached_property
    def exact_vertices(self) -> wp.array:
        """(n,) vec3d in unit space if the mesh has outliers, else empty: float32 then holds for all of it."""
        centre, half = self.mesh.unit_frame
        exact = (self.mesh.vertices - centre) / half if len(self.mesh.outliers) else np.zeros((0, 3))
        return wp.array(exact, dtype=wp.vec3d, device=self.vertices.device, copy=False)

    @functools.cached_property
    def normals(self) -> wp.array:
        """(n,) vec3 shading normals."""
        return self._attribute(self.mesh.normals, wp.vec3)

    @functools.cached_property
    def uvs(self) -> wp.array:
        """(n,) vec2 texture coordinates, empty if the mesh has none."""
        return self._attribute(np.zeros((0, 2), np.float32) if self.mesh.uvs is None else self.mesh.uvs, wp.vec2)

    def _attribute(self, values: np.ndarray, dtype: type) -> wp.array:
        uploaded = wp.array(values, dtype=dtype, device=self.vertices.device, copy=False)
        self.attribute_bytes += warp_abi.array_bytes(uploaded)
        return uploaded

    @functools.cached_property
    def has_material(self) -> bool:
        """Whether the mesh's file says anything of its colours."""
        return has_material(self.mesh)

    @functools.cached_property
    def needs_look(self) -> bool:
        """Whether the mesh's file says more of its surface than colours and plain pictures."""
        return mesh_needs_look(self.mesh)

    @functools.cached_property
    def is_single_sided(self) -> bool:
        """Whether the mesh's file says of some part that it is seen from the front alone."""
        return any(not part.material.double_sided for part in self.mesh.parts)

    def _owns(self, source: Object) -> list[Material]:
        """What the scene says of each of the mesh's parts."""
        return [source.material_of(part.material.name) for part in self.mesh.parts]

    def hides_backs(self, source: Object) -> bool:
        """Whether an object with this mesh hides backs that may be looked at."""
        return hides_backs(self.mesh, self._owns(source))

    def look(self, source: Object, reflection: Reflection) -> Look:
        """The look of an object with this mesh. Objects of which the scene says the same share one."""
        owns = self._owns(source)
        key = (tuple(own.key for own in owns), reflection.threshold, reflection.rough_limit)
        if key not in self._looks:
            arrays, device = dict(self._look_arrays), self.vertices.device
            if hides_backs(self.mesh, owns):
                arrays["has_image"] = self._has_image
            self._looks[key] = look_of(self.mesh, owns, reflection, arrays, device, filters=self._filters)
        return self._looks[key]

    @functools.cached_property
    def _look_arrays(self) -> dict[str, wp.array]:
        """What a look has of the vertices, by the names of its fields; empty arrays of what the mesh has not."""
        arrays = {"uvs": self.uvs}
        for name, width, dtype in (("second_uvs", 2, wp.vec2), ("colors", 4, wp.vec4), ("tangents", 4, wp.vec4)):
            values = getattr(self.mesh, name)
            missing = np.zeros((0, width), np.float32)
            arrays[name] = self._attribute(missing if values is None else values, dtype)
        return arrays

    @property
    def has_textures(self) -> bool:
        """Whether any object with this mesh, of those uploaded so far, has a texture."""
        looks, appearances = self._looks.values(), self._appearances.values()
        return any(look.has_textures for look in looks) or any(plain.has_textures for plain in appearances)

    @functools.cached_property
    def _has_image(self) -> wp.array:
        """(m,) uint8: 1 for triangles whose mirror image is in the mesh, too; empty if none is."""
        firsts = first_of_equals(self.mesh.vertices)
        has_image = triangles_with_image(self.mesh.faces if firsts is None else firsts[self.mesh.faces])
        found = has_image.astype(np.uint8) if has_image.any() else np.zeros(0, np.uint8)
        return wp.array(found, dtype=wp.uint8, device=self.vertices.device)

    @functools.cached_property
    def bare_appearance(self) -> Appearance:
        """The colours of the mesh's parts without textures, of objects that have a look."""
        return appearance_of(self.mesh, None, self.vertices.device, has_look=True)

    @functools.cached_property
    def no_normals(self) -> wp.array:
        """An empty array in the place of the normals, for objects whose shading reads none."""
        return wp.empty(0, dtype=wp.vec3, device=self.vertices.device)

    @functools.cached_property
    def no_uvs(self) -> wp.array:
        """An empty array in the place of the texture coordinates, for objects whose shading reads none."""
        return wp.empty(0, dtype=wp.vec2, device=self.vertices.device)

    def appearance(self, texture: StoredPicture | None) -> Appearance:
        """The colours and textures of the mesh's parts; ``texture`` takes the place of all parts' own if it is given.
        Objects with the same mesh and texture share one."""
        key = None if texture is None else texture.key
        if key not in self._appearances:
            self._appearances[key] = appearance_of(self.mesh, texture, self.vertices.device, filters=self._filters)
        return self._appearances[key]
