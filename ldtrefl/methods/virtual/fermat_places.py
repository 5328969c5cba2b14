"""Virtual vertices by Fermat's principle, on a star-shaped reflector: ``methods/fermat.py`` says how."""

from __future__ import annotations

import dataclasses

import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.methods.virtual.fermat_search import Reflection, SearchLimits, fermat_search
from ldtrefl.methods.virtual.radius_map import RadiusMap, met_radius, radial_point
from ldtrefl.methods.virtual.silhouette import silhouette_point
from ldtrefl.methods.virtual.subdivision import SurfacePoint, edge_errors_kernel
from ldtrefl.methods.virtual.vertex import HIDDEN, VirtualVertex, not_seen, unfolded
from ldtrefl.world.camera import CameraView

VIEW_STEPS = wp.constant(4)
"""Steps of Newton's method from a point near the reflector to where the eye sees it."""

EDGE_ON = wp.constant(wp.float64(1.0e-3))
"""Cosine of a view with a normal below which the surface is not looked for: the step would go far off."""

WAY_STEPS = wp.constant(32)
"""Points of the way from the reflection to a vertex that are looked at."""

WAY_RADII = wp.constant(wp.float64(4.0))
"""The length of the way that is looked at, in distances of the reflection from O: a reflector reaches no farther."""

NEAR = wp.constant(wp.float64(1.0e-3))
"""Share of the radius within which a point counts as on the surface."""

search = fermat_search(RadiusMap, radial_point)


@wp.func
def is_walled_off(surface: RadiusMap, found: Reflection, eye: wp.vec3d, vertex: wp.vec3d) -> bool:
    """Whether the way from a reflection to a vertex leads through the surface, and not through one of its holes.
    Positions are from O."""
    one, point = wp.float64(1.0), found.point
    length = wp.length(vertex - point)
    part = wp.min(one, WAY_RADII * wp.length(point) / length)
    side = wp.where(wp.dot(found.normal, eye - point) < wp.float64(0.0), int(-1), int(1))
    for step in range(WAY_STEPS):
        share = (wp.float64(step) + one) / wp.float64(WAY_STEPS)
        at = point + (part * share * share) * (vertex - point)
        distance = wp.length(at)
        radius = met_radius(radial_point(surface, at / distance))
        now = int(0)
        if radius > wp.float64(0.0):
            now = side
            if distance < (one - NEAR) * radius:
                now = -1
            elif distance > (one + NEAR) * radius:
                now = 1
        if side * now < 0:
            return True
        side = now
    return False


@launch.kernel
def find_vertices(
    first: int,
    # In:
    camera: CameraView,
    surface: RadiusMap,
    limits: SearchLimits,
    points: wp.array(dtype=wp.vec3d),
    # Out:
    vertices_out: wp.array(dtype=VirtualVertex),
    iterations_out: wp.array(dtype=wp.int32),
):
    """Search for the reflection of one point."""
    i = first + wp.tid()
    eye, vertex = camera.eye - surface.centre, points[i]
    found = search(surface, eye, vertex - surface.centre, limits)
    made = not_seen()
    if found.is_found != 0 and found.is_inside != 0:
        if is_walled_off(surface, found, eye, vertex - surface.centre):
            found.is_found = 0
    point = found.point
    if found.is_hidden != 0:
        point = silhouette_point(surface, eye, found.point)
    if found.is_found + found.is_hidden != 0:
        made = unfolded(camera.eye, surface.centre + point, vertex, wp.dot(point - eye, camera.forward))
        if found.is_hidden != 0 and made.is_seen != 0:
            made.is_seen = HIDDEN
    vertices_out[i] = made
    iterations_out[i] = found.iterations


@wp.func
def surface_towards(surface: RadiusMap, camera: CameraView, point: wp.vec3d) -> SurfacePoint:
    """What the eye sees of a star-shaped surface in the direction of a point near it, by Newton's method: the tangent
    plane in the point's direction from O is looked at, and the direction to where it is met taken next."""
    eye, near = camera.eye - surface.centre, point - surface.centre
    way = wp.normalize(near - eye)
    found = SurfacePoint()
    goes_on = bool(True)
    for _ in range(VIEW_STEPS):
        if goes_on:
            direction = wp.normalize(near)
            at = radial_point(surface, direction)
            goes_on = at.radius > wp.float64(0.0)
            if goes_on:
                normal = wp.normalize(direction - at.gradient / at.radius)
                along = wp.dot(way, normal)
                found.position = surface.centre + at.radius * direction
                found.normal = wp.where(along > wp.float64(0.0), -normal, normal)
                found.is_known = 1
                goes_on = wp.abs(along) > EDGE_ON
                if goes_on:
                    near = eye + way * (wp.dot(at.radius * direction - eye, normal) / along)
    return found


@dataclasses.dataclass(frozen=True, eq=False)
class FermatPlaces:
    """Places vertices where one reflector shows them."""

    camera: CameraView
    surface: RadiusMap
    limits: SearchLimits
    stats: Stats

    def __call__(self, points: wp.array, vertices: wp.array) -> None:
        """Fill in the virtual vertices of (n,) vec3d points."""
        count, device = points.shape[0], points.device
        iterations = wp.zeros(count, dtype=wp.int32, device=device)
        inputs = [self.camera, self.surface, self.limits, points, vertices, iterations]
        launch.launch(find_vertices, count, inputs, device)
        self.stats.count("vertices", count)
        self.stats.count("vertices_found", int((vertices.numpy()["is_seen"] != 0).sum()))
        self.stats.count("iterations", int(iterations.numpy().sum()))

    def errors(self, pieces: wp.array, points: wp.array, vertices: wp.array) -> wp.array:
        """(n,) vec3: the errors of the edges of (n,) pieces."""
        errors = wp.empty(pieces.shape[0], dtype=wp.vec3, device=pieces.device)
        kernel = edge_errors_kernel(RadiusMap, surface_towards)
        inputs = [self.camera, self.surface, pieces, points, vertices, errors]
        launch.launch(kernel, pieces.shape[0], inputs, pieces.device)
        return errors
