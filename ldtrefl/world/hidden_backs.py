"""Whether an object hides the backs of its triangles: what glTF calls back-face culling.

A material of a file that is not ``double_sided`` is seen from the front alone, by the triangles' winding in the mesh's
own coordinates: an object that is placed by a mirroring matrix keeps its fronts (glTF 2.0, 3.7.4). Where nobody can
tell, nothing is done about it: from outside of solids all that is seen are fronts. What passes alpha may be inside.
"""

from __future__ import annotations

from collections.abc import Sequence

from ldtrefl.scene.material import Material
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.surface_material import SurfaceMaterial


def is_double_sided(material: SurfaceMaterial, own: Material) -> bool:
    """Whether a file's material is seen from both sides, with what the scene says of it: a mirror takes its place."""
    if own.double_sided is not None:
        return own.double_sided
    return material.double_sided or any(own.mirror)


def hides_backs(mesh: Mesh, owns: Sequence[Material]) -> bool:
    """Whether a back of an object may be looked at that is not there.

    Args:
        mesh: its mesh.
        owns: what the scene says of each of the mesh's parts.

    Raises:
        InputError: to find out needs more memory than is allowed.
    """
    if all(is_double_sided(part.material, own) for part, own in zip(mesh.parts, owns, strict=True)):
        return False
    return any(part.material.alpha_mode != "opaque" for part in mesh.parts) or not mesh.is_solid
