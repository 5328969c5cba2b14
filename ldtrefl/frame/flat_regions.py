"""Reflection regions by the test of Zhang, Hsieh and Shen (section 3.2), for flat mirror triangles.

For each triangle of the reflector the object's bounding sphere is mirrored in the triangle's plane. The triangle is
kept if it overlaps the cone from the camera about the mirrored sphere: a corner lies inside, an edge crosses the cone,
or the whole ellipse lies inside the triangle. The test takes the reflector for flat triangles, so with interpolated
normals it drops pixels that do reflect. Later bounces are not culled, nor is the reflector itself, which the paper
leaves out: its sphere reaches its own triangles.

All in device space.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.base import budget
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.regions import Regions
from ldtrefl.frame.run_lists import RunLists, listed, set_entry
from ldtrefl.geometry.vectors import as_double, from_to
from ldtrefl.tracing.object_sets import RUN, run_count
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.world.records import ObjectRecord


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
    """Test one triangle of a reflector against all objects."""
    triangle = first + wp.tid()
    corners = objects[reflector].faces[triangle]
    device_from_unit = objects[reflector].device_from_unit
    # Seen from the eye, so that float32 holds wherever that is.
    a = from_to(eye, wp.transform_point(device_from_unit, as_double(objects[reflector].vertices[corners[0]])))
    b = from_to(eye, wp.transform_point(device_from_unit, as_double(objects[reflector].vertices[corners[1]])))
    c = from_to(eye, wp.transform_point(device_from_unit, as_double(objects[reflector].vertices[corners[2]])))
    for k in range(objects.shape[0]):
        centre = from_to(eye, objects[k].centre)
        is_own = k == reflector
        if is_own and objects[k].returns == 0:
            continue
        if is_own or shows_flat(wp.vec3(0.0), a, b, c, centre, objects[k].radius):
            word = bits_out[first_row + triangle, k / 32]
            bits_out[first_row + triangle, k / 32] = word | (wp.uint32(1) << wp.uint32(k % 32))


@launch.kernel
def list_shown(
    first: int,
    # In:
    rays: RayBuffer,
    objects: int,
    bits: wp.array2d(dtype=wp.uint32),
    pixel_triangle: wp.array(dtype=wp.int32),
    first_rows: wp.array(dtype=wp.int32),
    room: int,
    # In and out:
    lists: RunLists,
    # Out, whoever writes it: 1 for objects that are listed
    shown_out: wp.array(dtype=wp.uint8),
):
    """List the objects that the triangles which the rays of one run leave can show."""
    run = first + wp.tid()
    begin, end = RUN * run, wp.min(RUN * run + RUN, rays.source.shape[0])
    found = int(0)
    for k in range(objects):
        met = wp.uint64(0)
        for i in range(begin, end):
            if rays.source[i] < 0:
                continue
            row = first_rows[rays.source[i]] + pixel_triangle[rays.pixel[i]]
            if (bits[row, k / 32] >> wp.uint32(k % 32)) & wp.uint32(1) != wp.uint32(0):
                if rays.source[i] != k or rays.may_return[i] != wp.uint8(0):
                    met = met | (wp.uint64(1) << wp.uint64(i - begin))
        if met != wp.uint64(0):
            shown_out[k] = wp.uint8(1)
            if found < room:
                set_entry(lists, lists.start[run] + found, k, met, 0.0)
            found += 1
    lists.count[run] = found


def flat_regions(gbuffer: GBuffer, rays: RayBuffer, stats: Stats) -> Regions:
    """Test the triangles of all reflectors for the rays of the first bounce. Counts what ``safe_regions`` counts.

    Raises:
        InputError: a bit for each triangle and object needs more memory than is allowed.
    """
    scene, device, count = gbuffer.scene, gbuffer.scene.device, len(gbuffer.scene.objects)
    first_rows, total = scene.reflector_rows
    words = -(-count // 32)
    budget.take(4 * total * words, f"cull=flat of {total} triangles and {count} objects", "their number, or cull=safe")
    bits = wp.zeros((total, words), dtype=wp.uint32, device=device)
    for entry, first_row in zip(scene.objects, first_rows.numpy().tolist(), strict=True):
        if scene.is_reflector[entry.index]:
            inputs = [scene.records, entry.index, first_row, gbuffer.view.camera.eye, bits]
            launch.launch(cull_triangles, len(entry.geometry.faces), inputs, device)
    shown = wp.zeros(count, dtype=wp.uint8, device=device)

    def fill(lists: RunLists, room: int) -> None:
        inputs = [rays, count, bits, gbuffer.view.triangle, first_rows, room, lists, shown]
        launch.launch(list_shown, lists.start.shape[0], inputs, device)

    sets = listed(run_count(rays.source.shape[0]), count, device, fill)
    stats.count("triangles_tested", total)
    stats.count("triangles_culled", int((~bits.numpy().any(axis=1)).sum()))
    return Regions(sets, set(np.flatnonzero(shown.numpy()).tolist()))
