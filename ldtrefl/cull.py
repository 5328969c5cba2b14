"""Reflection regions: which objects each triangle of a reflector can show.

``flat`` is the test of Zhang, Hsieh and Shen, section 3.2: the object's bounding sphere is mirrored in the triangle's
plane; the triangle is kept if it overlaps the cone from the camera about the mirrored sphere: a corner inside, an edge
crossing, or the whole ellipse inside the triangle. It takes the reflector for flat triangles, so with interpolated
normals it drops pixels that do reflect.

``safe`` never does: the triangle's normals lie in a cone, so do the directions from the eye to it, hence the reflected
directions; the triangle is dropped only if no ray of that cone, from anywhere on the triangle, meets the sphere.

All in device space. A triangle's answer is a row of bits, one per object.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import warp as wp

from ldtrefl import launch
from ldtrefl.device_scene import ObjectRecord
from ldtrefl.gbuffer import GBuffer

CullTest = Literal["safe", "flat", "none"]

FLAT = wp.constant(0)
SAFE = wp.constant(1)

WIDEST_NORMALS = wp.constant(1.4)
"""Radians between a triangle's mean normal and a corner's beyond which nothing is concluded (an interpolated normal
can then pass near zero and turn anywhere)."""

ANGLE_SLACK = wp.constant(2.0e-3)
"""Radians added to every cone of ``safe``: float32 dot products give angles near 0 to about 5e-4."""


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


@wp.func
def angle_between(a: wp.vec3, b: wp.vec3) -> float:
    """Radians between two unit vectors."""
    return wp.acos(wp.clamp(wp.dot(a, b), -1.0, 1.0))


@wp.struct
class MirrorTriangle:
    """A triangle of a reflector and the shading normals at its corners (the facet's if it is not smooth)."""

    a: wp.vec3
    b: wp.vec3
    c: wp.vec3
    normal_a: wp.vec3
    normal_b: wp.vec3
    normal_c: wp.vec3


@wp.func
def shows_safe(eye: wp.vec3, mirror: MirrorTriangle, centre: wp.vec3, radius: float) -> bool:
    """Whether a ray reflected at the triangle may meet the sphere; False only if none can."""
    # The triangle lies in a ball about its centre, seen from the eye within a cone.
    middle = (mirror.a + mirror.b + mirror.c) / 3.0
    reach = wp.max(wp.length(mirror.a - middle), wp.max(wp.length(mirror.b - middle), wp.length(mirror.c - middle)))
    view = middle - eye
    distance = wp.length(view)
    if distance <= reach:
        return True
    view = view / distance
    view_spread = wp.asin(reach / distance)

    # Its normals lie in a cone about their mean.
    mean = mirror.normal_a + mirror.normal_b + mirror.normal_c
    if not wp.length(mean) > 0.5:
        return True
    mean = wp.normalize(mean)
    normal_spread = wp.max(
        angle_between(mean, mirror.normal_a),
        wp.max(angle_between(mean, mirror.normal_b), angle_between(mean, mirror.normal_c)),
    )
    if not normal_spread < WIDEST_NORMALS:
        return True

    # A turn of the normal turns the reflected ray twice as far. Moving all rays to the centre widens the sphere.
    reflected = view - 2.0 * wp.dot(view, mean) * mean
    spread = view_spread + 2.0 * normal_spread + ANGLE_SLACK
    towards = centre - middle
    apart = wp.length(towards)
    widened = radius + reach
    if apart <= widened:
        return True
    return angle_between(wp.normalize(reflected), towards / apart) <= spread + wp.asin(widened / apart)


@wp.func
def mirror_normal(record: ObjectRecord, vertex: int, facet: wp.vec3) -> wp.vec3:
    """The shading normal at a corner; a corner without one spoils the cone, which is then given up."""
    if record.smooth == 0:
        return facet
    return wp.normalize(record.normal_from_unit * wp.normalize(record.normals[vertex]))


@wp.func
def mirror_triangle(record: ObjectRecord, triangle: int) -> MirrorTriangle:
    """A reflector's triangle in device space."""
    corners = record.faces[triangle]
    mirror = MirrorTriangle()
    mirror.a = wp.transform_point(record.device_from_unit, record.vertices[corners[0]])
    mirror.b = wp.transform_point(record.device_from_unit, record.vertices[corners[1]])
    mirror.c = wp.transform_point(record.device_from_unit, record.vertices[corners[2]])
    facet = wp.normalize(wp.cross(mirror.b - mirror.a, mirror.c - mirror.a))
    mirror.normal_a = mirror_normal(record, corners[0], facet)
    mirror.normal_b = mirror_normal(record, corners[1], facet)
    mirror.normal_c = mirror_normal(record, corners[2], facet)
    return mirror


@launch.kernel
def cull_triangles(
    first: int,
    # In:
    objects: wp.array(dtype=ObjectRecord),
    reflector: int,
    first_row: int,
    eye: wp.vec3,
    test: int,
    # Out: bit k % 32 of word k / 32 is set if the triangle can show object k
    bits_out: wp.array2d(dtype=wp.uint32),
):
    triangle = first + wp.tid()
    mirror = mirror_triangle(objects[reflector], triangle)
    for k in range(objects.shape[0]):
        if k != reflector:
            kept = bool(False)
            if test == FLAT:
                kept = shows_flat(eye, mirror.a, mirror.b, mirror.c, objects[k].centre, objects[k].radius)
            else:
                kept = shows_safe(eye, mirror, objects[k].centre, objects[k].radius)
            if kept:
                word = bits_out[first_row + triangle, k / 32]
                bits_out[first_row + triangle, k / 32] = word | (wp.uint32(1) << wp.uint32(k % 32))


@dataclass(frozen=True, eq=False)
class ReflectionRegions:
    """Which objects each reflector triangle can show."""

    bits: wp.array
    """(reflector triangles, words) uint32."""
    first_rows: wp.array
    """(objects,) int32: row of each object's first triangle; -1 for what is no reflector."""
    shown: set[int]
    """Objects that at least one visible pixel's triangle can show."""


@wp.func
def can_show(bits: wp.array2d(dtype=wp.uint32), row: int, index: int) -> bool:
    """Whether the triangle of this row can show object ``index``; row -1 can show all."""
    if row < 0:
        return True
    return ((bits[row, index / 32] >> wp.uint32(index % 32)) & wp.uint32(1)) != wp.uint32(0)


def find_regions(gbuffer: GBuffer, test: CullTest, stats: launch.Stats) -> ReflectionRegions:
    """Test every reflector triangle against every object.

    Counts ``triangles_tested`` and ``triangles_culled`` (pairs of triangle and object), and ``rays_saved`` (pairs of
    reflected ray and object that need no search).
    """
    scene = gbuffer.scene
    device, count = scene.device, len(scene.objects)
    rows = np.full(count, -1, np.int32)
    if test == "none":
        seen = set(np.unique(gbuffer.objects[gbuffer.reflector_mask]).tolist())
        # The only reflector in sight does not show itself.
        shown = {entry.index for entry in scene.objects if seen - {entry.index}}
        empty = wp.zeros((1, 1), dtype=wp.uint32, device=device)
        return ReflectionRegions(empty, wp.array(rows, dtype=wp.int32, device=device), shown)
    total = 0
    for entry in scene.reflectors:
        rows[entry.index] = total
        total += len(entry.geometry.faces)
    bits = wp.zeros((max(total, 1), (count + 31) // 32), dtype=wp.uint32, device=device)
    code = int(FLAT if test == "flat" else SAFE)
    for entry in scene.reflectors:
        inputs = [scene.records, entry.index, int(rows[entry.index]), gbuffer.view.camera.eye, code, bits]
        launch.launch(cull_triangles, len(entry.geometry.faces), inputs, device)

    # Count, and find the objects that some visible pixel may show.
    table = bits.numpy()
    kept = int(np.bitwise_count(table).sum(dtype=np.int64))
    tested = total * (count - 1)
    stats.count("triangles_tested", tested)
    stats.count("triangles_culled", tested - kept)
    mask = gbuffer.reflector_mask
    visible = table[rows[gbuffer.objects[mask]] + gbuffer.triangles[mask]]
    stats.count("rays_saved", len(visible) * (count - 1) - int(np.bitwise_count(visible).sum(dtype=np.int64)))
    union = np.bitwise_or.reduce(visible, axis=0) if len(visible) else np.zeros(bits.shape[1], np.uint32)
    shown = {k for k in range(count) if union[k // 32] >> np.uint32(k % 32) & np.uint32(1)}
    return ReflectionRegions(bits, wp.array(rows, dtype=wp.int32, device=device), shown)
