"""Star-shaped reflectors: all of the surface is seen from one point O (Roger and Holzschuch 2006, section 3.3.1).

Such a surface is its radius r over directions u from O: ``P(u) = O + r(u) u``. Rays from O find it, so that any mesh
will do that is star-shaped, open ones such as bowls too; the direction of a hole meets nothing. Lengths are those of
device space, in which objects stand as they are placed.

The search for reflections follows the gradient of r. Where the object has smooth shading normals, the gradient is that
of a surface with the interpolated normal n: ``grad r = -r n_t / (n . u)``, n_t being the part of n at right angles to
u. By the facets' normals it would jump from triangle to triangle, and the secant method find no zero; and mirrors are
shaded by the interpolated normals, so that this is where the ray tracer sees the reflection, too. Objects with
``smooth = false`` have their facets' gradient: each facet is a flat mirror then, and the search may not converge.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.base.errors import NotForThisScene
from ldtrefl.methods.virtual.radius_map import RadiusMap, node_directions
from ldtrefl.methods.virtual.rim import continue_beyond_rim
from ldtrefl.methods.virtual.star_centre import LEAST_COSINE, star_centre
from ldtrefl.tracing.bvh import Raycaster
from ldtrefl.world.device_object import DeviceObject

NEARER = 1e-3
"""Share of a distance by which something else must be nearer to O to hide a triangle: rays to the middles of triangles
are rounded, and may meet the neighbour instead."""


@dataclass(frozen=True, eq=False)
class StarShape:
    """A star-shaped surface, as seen from O."""

    centre: np.ndarray
    """(3,) float64, O in device space."""
    vertices: np.ndarray
    """(n, 3) float64, from O."""
    faces: np.ndarray
    """(m, 3) vertex numbers."""
    normals: np.ndarray | None
    """(n, 3) float64, the shading normals, of any length, 0 where unknown; None for the facets'."""

    @functools.cached_property
    def _raycaster(self) -> Raycaster:
        return Raycaster(self.vertices, self.faces)

    def radii(self, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where rays from O meet the surface.

        Args:
            directions: (n, 3) float64 unit directions.

        Returns:
            (n,) float64 radii, 0 where a direction meets nothing; (n, 3) float64 their gradients on the unit sphere.
        """
        hits = self._raycaster.trace(np.zeros_like(directions, np.float32), directions.astype(np.float32))
        radii, gradients = np.zeros(len(directions)), np.zeros((len(directions), 3))
        rays = np.flatnonzero(hits.triangle >= 0)
        triangles, ways = self.faces[hits.triangle[rays]], directions[rays]
        a, b, c = self.vertices[triangles].swapaxes(0, 1)
        facets = np.cross(b - a, c - a)
        # The plane of the triangle tells the radius better than the ray's rounded t.
        radii[rays] = np.einsum("ij,ij->i", facets, a) / np.einsum("ij,ij->i", facets, ways)
        normals = facets
        if self.normals is not None:
            u, v = hits.barycentrics[rays].astype(float).T
            smooth = np.einsum("ij,ijk->ik", np.stack([1.0 - u - v, u, v], axis=1), self.normals[triangles])
            is_known = np.einsum("ij,ij->i", smooth, smooth) > 0.0
            normals = np.where(is_known[:, None], smooth, facets)
        gradients[rays] = radii[rays, None] * _relative_gradients(normals, ways)
        return radii, gradients

    def hides_itself(self) -> bool:
        """Whether a triangle hides the middle of another from O."""
        middles = self.vertices[self.faces].mean(axis=1)
        distances = np.linalg.norm(middles, axis=1)
        hits = self._raycaster.trace(np.zeros_like(middles, np.float32), middles.astype(np.float32))
        # t is in lengths of the way from O to the middle. Of triangles without area nothing is met or hidden.
        return bool((hits.t[distances > 0.0] < 1.0 - NEARER).any())

    def radius_map(self, intervals: int, device: wp.Device) -> RadiusMap:
        """r and its gradient on a device, sampled at the nodes of a cube map with this many intervals a side."""
        directions = node_directions(intervals)
        radii, gradients = self.radii(directions)
        is_met = radii > 0.0
        continue_beyond_rim(directions, radii, gradients, self.radii)
        surface = RadiusMap()
        surface.centre, surface.intervals = wp.vec3d(*self.centre), intervals
        values = np.concatenate([radii[:, None], gradients], axis=1).astype(np.float32)
        surface.values = wp.array(values, dtype=wp.vec4, device=device)
        surface.beyond = wp.array(((radii > 0.0) & ~is_met).astype(np.uint8), dtype=wp.uint8, device=device)
        return surface


def _relative_gradients(normals: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """(n, 3): ``-n_t / (n . u)``, the gradient of log r, of normals n of any length in unit directions u."""
    lengths = np.linalg.norm(normals, axis=1)
    along = np.einsum("ij,ij->i", normals, ways)
    across = normals - along[:, None] * ways
    least = LEAST_COSINE * lengths
    return -across / np.where(np.abs(along) < least, np.copysign(least, along), along)[:, None]


def star_shape(vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray | None, name: str) -> StarShape:
    """A mesh as a star-shaped surface.

    Args:
        vertices: (n, 3) float64.
        faces: (m, 3) vertex numbers.
        normals: (n, 3) shading normals of any length, 0 where unknown; None for the facets'.
        name: what the error calls the mesh.

    Raises:
        NotForThisScene: there is no point that sees all of it.
    """
    centre = star_centre(vertices, faces)
    if centre is not None:
        shape = StarShape(centre, vertices - centre, faces, normals)
        if not shape.hides_itself():
            return shape
    raise NotForThisScene(f"{name} is not star-shaped: from no point all of its surface is seen")


def star_shape_of(reflector: DeviceObject, device_from_world: np.ndarray) -> StarShape:
    """A placed object as a star-shaped surface of device space.

    Raises:
        NotForThisScene: it is not star-shaped.
    """
    device_from_unit = device_from_world @ reflector.world_from_unit
    linear, shift = device_from_unit[:3, :3], device_from_unit[:3, 3]
    centre, half = reflector.geometry.mesh.unit_frame
    mesh = reflector.geometry.mesh
    vertices = (mesh.vertices - centre) / half @ linear.T + shift
    normals = None
    if reflector.source.smooth is not False:
        normals = mesh.normals.astype(float) @ np.linalg.inv(linear) * abs(np.linalg.det(linear)) ** (1.0 / 3.0)
    try:
        return star_shape(vertices, mesh.faces, normals, f"object '{reflector.source.called}'")
    except NotForThisScene as refusal:
        raise NotForThisScene(f"{refusal}; ldt or bvh take any mirror, bisector any smooth one") from None
