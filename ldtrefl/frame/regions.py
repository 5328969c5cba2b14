"""Reflection regions: which objects each reflected ray can meet.

``safe``, the default, looks at the rays themselves, of any bounce. Rays come in runs that stand together on the screen
(``rays.py``): the origins of a run lie in a ball, its directions in a cone. An object whose bounding sphere no ray of
such a cone can meet is dropped for all of them at once; one that is left is kept if a ray of the run does meet the
sphere. So nothing is lost, whatever the normals, and the cost follows the pixels, not the reflector's triangles.

``flat`` is the test of Zhang, Hsieh and Shen, section 3.2, on each triangle of the reflector: the object's bounding
sphere is mirrored in the triangle's plane; the triangle is kept if it overlaps the cone from the camera about the
mirrored sphere: a corner inside, an edge crossing, or the whole ellipse inside the triangle. It takes the reflector for
flat triangles, so with interpolated normals it drops pixels that do reflect. Later bounces are not culled.

All in device space.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.geometry.sphere import meets_sphere
from ldtrefl.geometry.vectors import as_double, as_single
from ldtrefl.tracing.rays import RUN, RayBuffer, Regions, objects_in, regions_of_runs, run_count, word_count
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import ObjectRecord

CullTest = Literal["safe", "flat"]

COSINE_SLACK = wp.constant(1.0e-5)
"""By which cones are widened: a hundred roundings of a float32 dot product."""


@wp.func
def is_in_cone(apex: wp.vec3, axis: wp.vec3, cosine: float, p: wp.vec3) -> bool:
    """Whether ``p`` lies in the cone (unit axis, cosine of the half-angle)."""
    offset = p - apex
    return wp.dot(offset, axis) >= cosine * wp.length(offset)


@wp.func
def edge_meets_cone(apex: wp.vec3, axis: wp.vec3, cosine: float, a: wp.vec3, b: wp.vec3) -> bool:
    """Whether a point strictly between ``a`` and ``b`` lies on the cone's surface."""
    p, q = a - apex, b - a
    # (axis . x)^2 - cosine^2 x . x is a quadratic in s along x = p + s q; its roots lie on the double cone.
    along_p, along_q = wp.dot(axis, p), wp.dot(axis, q)
    c2 = cosine * cosine
    qa = along_q * along_q - c2 * wp.dot(q, q)
    qb = along_p * along_q - c2 * wp.dot(p, q)
    qc = along_p * along_p - c2 * wp.dot(p, p)
    root = qb * qb - qa * qc
    if root < 0.0 or qa == 0.0:
        return False
    root = wp.sqrt(root)
    s = (-qb - root) / qa
    if s > 0.0 and s < 1.0 and along_p + s * along_q > 0.0:
        return True
    s = (-qb + root) / qa
    return s > 0.0 and s < 1.0 and along_p + s * along_q > 0.0


@wp.func
def axis_meets_triangle(apex: wp.vec3, axis: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3) -> bool:
    """Whether the cone's axis passes through the triangle."""
    pa, pb, pc = a - apex, b - apex, c - apex
    wa, wb, wc = (
        wp.dot(axis, wp.cross(pb, pc)),
        wp.dot(axis, wp.cross(pc, pa)),
        wp.dot(axis, wp.cross(pa, pb)),
    )
    one_sign = (wa >= 0.0 and wb >= 0.0 and wc >= 0.0) or (wa <= 0.0 and wb <= 0.0 and wc <= 0.0)
    return one_sign and wp.dot(axis, pa + pb + pc) > 0.0


@wp.func
def shows_flat(eye: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3, centre: wp.vec3, radius: float) -> bool:
    """The paper's test of a flat mirror triangle against an object's bounding sphere."""
    normal = wp.normalize(wp.cross(b - a, c - a))
    eye_height, centre_height = wp.dot(normal, eye - a), wp.dot(normal, centre - a)
    if eye_height < 0.0:
        centre_height = -centre_height
    if centre_height < -radius:
        return False  # the whole object is behind the mirror
    mirrored = centre - 2.0 * wp.dot(normal, centre - a) * normal
    offset = mirrored - eye
    distance = wp.length(offset)
    if distance <= radius:
        return True  # the camera is inside the mirrored sphere
    axis = offset / distance
    sine = radius / distance
    cosine = wp.sqrt(1.0 - sine * sine)
    if is_in_cone(eye, axis, cosine, a) or is_in_cone(eye, axis, cosine, b) or is_in_cone(eye, axis, cosine, c):
        return True
    if edge_meets_cone(eye, axis, cosine, a, b) or edge_meets_cone(eye, axis, cosine, b, c):
        return True
    return edge_meets_cone(eye, axis, cosine, c, a) or axis_meets_triangle(eye, axis, a, b, c)


@wp.struct
class RunBounds:
    """A ball about the origins of some rays, and a cone about their directions."""

    middle: wp.vec3
    reach: float
    axis: wp.vec3
    cosine: float  # of the cone's half-angle; -1 if nothing is known


@wp.func
def bounds_of_run(rays: RayBuffer, begin: int, end: int) -> RunBounds:
    """The bounds of the rays from ``begin`` to ``end`` that are alive."""
    middle = wp.vec3(0.0)
    axis = wp.vec3(0.0)
    alive = int(0)
    for i in range(begin, end):
        if rays.source[i] >= 0:
            middle += as_single(rays.origin[i])
            axis += rays.direction[i]
            alive += 1
    bounds = RunBounds()
    bounds.middle = middle / float(wp.max(alive, 1))
    bounds.axis = wp.normalize(axis)
    bounds.cosine = 1.0
    for i in range(begin, end):
        if rays.source[i] >= 0:
            bounds.reach = wp.max(bounds.reach, wp.length(as_single(rays.origin[i]) - bounds.middle))
            bounds.cosine = wp.min(bounds.cosine, wp.dot(rays.direction[i], bounds.axis))
    bounds.cosine = wp.max(bounds.cosine - COSINE_SLACK, -1.0)
    return bounds


@wp.func
def may_meet(bounds: RunBounds, centre: wp.vec3, radius: float) -> bool:
    """Whether a ray from the ball along a direction of the cone may meet a sphere; False only if none can."""
    # To move all rays to the ball's middle widens the sphere.
    towards = centre - bounds.middle
    apart = wp.length(towards)
    widened = radius + bounds.reach
    if apart <= widened or bounds.cosine <= 0.0:
        return True
    # The angle between the axis and the sphere's centre is at most the cone's half-angle and the sphere's together.
    sphere_sine = widened / apart
    sphere_cosine = wp.sqrt(1.0 - sphere_sine * sphere_sine)
    sine = wp.sqrt(1.0 - bounds.cosine * bounds.cosine)
    least = bounds.cosine * sphere_cosine - sine * sphere_sine
    return wp.dot(bounds.axis, towards) >= (least - COSINE_SLACK) * apart


@launch.kernel
def cull_runs(
    first: int,
    # In:
    rays: RayBuffer,
    objects: wp.array(dtype=ObjectRecord),
    pixel_triangle: wp.array(dtype=wp.int32),
    first_rows: wp.array(dtype=wp.int32),
    # Out: bit k % 32 of word k / 32 is set if a ray of the run meets the sphere of object k
    bits_out: wp.array2d(dtype=wp.uint32),
    # Out, if it is not empty: 1 for triangles of reflectors in a run that shows an object, the same from whoever writes
    kept_out: wp.array(dtype=wp.uint8),
):
    run = first + wp.tid()
    begin, end = RUN * run, wp.min(RUN * run + RUN, rays.source.shape[0])
    bounds = bounds_of_run(rays, begin, end)
    shows_any = bool(False)
    for word in range(bits_out.shape[1]):
        bits = wp.uint32(0)
        for k in range(32 * word, wp.min(32 * word + 32, objects.shape[0])):
            centre, radius = objects[k].centre, objects[k].radius
            if may_meet(bounds, centre, radius):
                i = int(begin)
                while i < end:
                    if (
                        rays.source[i] >= 0
                        and rays.source[i] != k
                        and meets_sphere(as_single(rays.origin[i]), rays.direction[i], centre, radius)
                    ):
                        bits = bits | (wp.uint32(1) << wp.uint32(k % 32))
                        i = end
                    i += 1
        bits_out[run, word] = bits
        shows_any = shows_any or bits != wp.uint32(0)
    if shows_any and kept_out.shape[0] > 0:
        for i in range(begin, end):
            kept_out[first_rows[rays.source[i]] + pixel_triangle[rays.pixel[i]]] = wp.uint8(1)


@launch.kernel
def cull_triangles(
    first: int,
    # In:
    objects: wp.array(dtype=ObjectRecord),
    reflector: int,
    first_row: int,
    eye: wp.vec3d,
    # Out: bit k % 32 of word k / 32 is set if the triangle can show object k
    bits_out: wp.array2d(dtype=wp.uint32),
):
    triangle = first + wp.tid()
    corners = objects[reflector].faces[triangle]
    device_from_unit = objects[reflector].device_from_unit
    a = as_single(wp.transform_point(device_from_unit, as_double(objects[reflector].vertices[corners[0]])))
    b = as_single(wp.transform_point(device_from_unit, as_double(objects[reflector].vertices[corners[1]])))
    c = as_single(wp.transform_point(device_from_unit, as_double(objects[reflector].vertices[corners[2]])))
    for k in range(objects.shape[0]):
        if k != reflector and shows_flat(as_single(eye), a, b, c, objects[k].centre, objects[k].radius):
            word = bits_out[first_row + triangle, k / 32]
            bits_out[first_row + triangle, k / 32] = word | (wp.uint32(1) << wp.uint32(k % 32))


@launch.kernel
def find_rows(
    first: int,
    # In:
    rays: RayBuffer,
    pixel_triangle: wp.array(dtype=wp.int32),
    first_rows: wp.array(dtype=wp.int32),
    # Out:
    rows_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    rows_out[i] = first_rows[rays.source[i]] + pixel_triangle[rays.pixel[i]]


@dataclass(frozen=True, eq=False)
class Culled:
    """What is left for each ray."""

    regions: Any
    """The ``Regions``."""
    shown: set[int]
    """Objects that at least one ray can meet."""


def not_culled(scene: DeviceScene) -> Culled:
    """Every ray may meet every object but its own."""
    regions = regions_of_runs(wp.empty((0, 0), dtype=wp.uint32, device=scene.device))
    mirrors = {entry.index for entry in scene.reflectors}
    # A mirror alone is met by no ray.
    alone = mirrors if len(mirrors) == 1 else set()
    shown = set(range(len(scene.objects))) - alone if mirrors else set()
    return Culled(regions, shown)


def cull_rays(gbuffer: GBuffer, rays: Any, bounce: int, test: CullTest, stats: Stats) -> Culled:
    """Test the rays of a bounce, 0 the first.

    Counts ``triangles_tested``, those of all reflectors, and ``triangles_culled``, those that are not seen or that none
    of the objects can be seen in.
    """
    if test == "flat":
        return _flat(gbuffer, rays, stats) if bounce == 0 else not_culled(gbuffer.scene)
    scene, device = gbuffer.scene, gbuffer.scene.device
    runs, count = run_count(rays.source.shape[0]), len(scene.objects)
    bits = wp.empty((runs, word_count(count)), dtype=wp.uint32, device=device)
    first_rows, total = scene.reflector_rows
    kept = wp.zeros(total if bounce == 0 else 0, dtype=wp.uint8, device=device)
    inputs = [rays, scene.records, gbuffer.view.triangle, first_rows, bits, kept]
    launch.launch(cull_runs, runs, inputs, device)
    if bounce == 0:
        stats.count("triangles_tested", total)
        stats.count("triangles_culled", total - int(np.count_nonzero(kept.numpy())))
    return Culled(regions_of_runs(bits), objects_in(bits.numpy(), count))


def _flat(gbuffer: GBuffer, rays: Any, stats: Stats) -> Culled:
    scene, device, count = gbuffer.scene, gbuffer.scene.device, len(gbuffer.scene.objects)
    first_rows, total = scene.reflector_rows
    regions = Regions()
    regions.bits = wp.zeros((total, word_count(count)), dtype=wp.uint32, device=device)
    for entry, first_row in zip(scene.objects, first_rows.numpy().tolist(), strict=True):
        if entry.source.is_reflector:
            inputs = [scene.records, entry.index, first_row, gbuffer.view.camera.eye, regions.bits]
            launch.launch(cull_triangles, len(entry.geometry.faces), inputs, device)
    n = rays.source.shape[0]
    regions.rows = wp.empty(n, dtype=wp.int32, device=device)
    launch.launch(find_rows, n, [rays, gbuffer.view.triangle, first_rows, regions.rows], device)
    table = regions.bits.numpy()
    stats.count("triangles_tested", total)
    stats.count("triangles_culled", int((~table.any(axis=1)).sum()))
    return Culled(regions, objects_in(table[regions.rows.numpy()], count))
