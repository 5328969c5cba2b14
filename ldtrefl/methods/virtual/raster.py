"""Drawing virtual triangles at the points where a reflector is seen.

What is drawn to are points of the image, several in a pixel or one at its centre, sorted by pixel: no others exist, so
a reflection is seen only through the reflector's own pixels. The depth test is that of Roger and Holzschuch 2006,
section 3.3.6: by the distance from the reflection point, and only before the frontmost back faces of the reflector.
Triangles are those of ``geometry/perspective_raster.py``: what crosses the camera's plane needs no clipping, and
neighbours overlap by a hair rather than leave a crack.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.atomics import keep_largest
from ldtrefl.device.bins import CHUNK
from ldtrefl.frame.pixel_box import BEHIND, PixelBox, pixel_box
from ldtrefl.geometry.perspective_raster import (
    HomogeneousTriangle,
    homogeneous_triangle,
    inverse_depth,
    perspective_weights,
)
from ldtrefl.geometry.vectors import as_single, from_to
from ldtrefl.methods.virtual.vertex import HIDDEN, VirtualVertex, device_vertex
from ldtrefl.tracing.ray_buffers import HitBuffer, RayBuffer
from ldtrefl.world.camera import CameraView
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.triangle_numbers import TriangleNumbers, first_triangle_of, number_of, object_of

BACK_SLACK = wp.constant(1.0e-4)
"""Share of its depth by which a back face of the reflector must lie behind what is seen of it, to count as behind."""


@wp.struct
class DrawnPoints:
    """Points of a band's image at which something is drawn, sorted by the pixel that they lie in."""

    first: wp.array(dtype=wp.int32)  # of each pixel, row by row; then the number of points
    place: wp.array(dtype=wp.vec2d)  # in pixels of the band
    width: int  # pixels of a row
    rows: int


@wp.func
def in_pixels(camera: CameraView, point: wp.vec3d) -> wp.vec3d:
    """A point of device space as (x depth, y depth, depth) in pixels of the band: :func:`camera_ray` the other way."""
    away = point - camera.eye
    half = wp.float64(0.5)
    depth = wp.dot(away, camera.forward)
    across = wp.dot(away, camera.right) / wp.length_sq(camera.right)
    along = wp.dot(away, camera.down) / wp.length_sq(camera.down)
    x = half * wp.float64(camera.width) * (across + depth)
    y = half * wp.float64(camera.height) * (along + depth) - wp.float64(camera.first_row) * depth
    return wp.vec3d(x, y, depth)


@wp.func
def as_corner(p: wp.vec3d) -> wp.vec3d:
    """The same as ``pixel_box`` takes it: (x, y, 1 / depth) in front of the camera."""
    if p[2] > BEHIND:
        return wp.vec3d(p[0] / p[2], p[1] / p[2], wp.float64(1.0) / p[2])
    return p


@wp.func
def touched_pixels(points: DrawnPoints, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> PixelBox:
    """The pixels with points that a triangle may cover: its box' and those beside, as points lie about the centres."""
    box = pixel_box(as_corner(a), as_corner(b), as_corner(c), points.width, 0, points.rows)
    box.first_x = wp.max(box.first_x - 1, 0)
    box.first_y = wp.max(box.first_y - 1, 0)
    box.last_x = wp.min(box.last_x + 1, points.width - 1)
    box.last_y = wp.min(box.last_y + 1, points.rows - 1)
    return box


@wp.func
def shares_at(triangle: HomogeneousTriangle, place: wp.vec2d) -> wp.vec3:
    """Barycentrics of the three corners, with perspective, where a triangle is seen at a place; the first below 0 if it
    is not seen there."""
    at = perspective_weights(triangle, place[0], place[1])
    if wp.min(at) >= BEHIND and triangle.volume != BEHIND:
        if inverse_depth(triangle, at) > 0.0:
            return as_single(at / (at[0] + at[1] + at[2]))
    return wp.vec3(-1.0)


@wp.func
def virtual_triangle(
    camera: CameraView, vertices: wp.array(dtype=VirtualVertex), first: int, face: wp.vec3i
) -> HomogeneousTriangle:
    """The triangle between three virtual vertices of an object whose vertex 0 has place ``first``."""
    return homogeneous_triangle(
        in_pixels(camera, vertices[first + face[0]].position),
        in_pixels(camera, vertices[first + face[1]].position),
        in_pixels(camera, vertices[first + face[2]].position),
    )


@wp.func
def keep_nearer_at(keys: wp.array(dtype=wp.int64), i: int, value: float, number: int):
    """Put a value above 0 and a number into the key of point ``i``: the largest value stays."""
    keep_largest(keys, i, (wp.int64(wp.cast(value, wp.int32)) << wp.int64(32)) | wp.int64(number))


@wp.func
def value_in(key: wp.int64) -> float:
    """The value in a key."""
    return wp.cast(int(key >> wp.int64(32)), float)


@launch.kernel
def draw_back_faces(
    first: int,
    # In:
    camera: CameraView,
    points: DrawnPoints,
    nearest: wp.array(dtype=float),  # depth of what each point sees of the reflector
    objects: wp.array(dtype=ObjectRecord),
    reflector: int,
    # Out:
    keys: wp.array(dtype=wp.int64),  # of 1 / depth of the frontmost back face; 0 where there is none
):
    """Draw those triangles of a chunk of the reflector's whose backs are turned to the camera."""
    begin = CHUNK * (first + wp.tid())
    for i in range(begin, wp.min(begin + CHUNK, objects[reflector].faces.shape[0])):
        face = objects[reflector].faces[i]
        a = device_vertex(objects[reflector], face[0])
        b = device_vertex(objects[reflector], face[1])
        c = device_vertex(objects[reflector], face[2])
        if wp.dot(wp.cross(b - a, c - a), a - camera.eye) > BEHIND:
            pa, pb, pc = in_pixels(camera, a), in_pixels(camera, b), in_pixels(camera, c)
            box = touched_pixels(points, pa, pb, pc)
            triangle = homogeneous_triangle(pa, pb, pc)
            for y in range(box.first_y, box.last_y + 1):
                for x in range(box.first_x, box.last_x + 1):
                    pixel = y * points.width + x
                    for k in range(points.first[pixel], points.first[pixel + 1]):
                        at = perspective_weights(triangle, points.place[k][0], points.place[k][1])
                        if wp.min(at) >= BEHIND and triangle.volume != BEHIND:
                            nearness = inverse_depth(triangle, at)
                            if nearness > 0.0 and nearness * nearest[k] * (1.0 + BACK_SLACK) < 1.0:
                                keep_nearer_at(keys, k, nearness, 0)


@wp.func
def is_drawn(a: int, b: int, c: int) -> bool:
    """Whether the triangle between vertices that are seen so is drawn."""
    return wp.min(a, wp.min(b, c)) > 0 and wp.min(a, wp.min(b, c)) < HIDDEN


@launch.kernel
def draw_virtual(
    first: int,
    # In:
    camera: CameraView,
    points: DrawnPoints,
    chunks: wp.array(dtype=wp.vec2i),  # ``chunks_of`` triangles
    drawn: wp.array(dtype=wp.int32),  # numbers of the objects that are drawn
    first_vertex: wp.array(dtype=wp.int32),  # place of vertex 0 of each of them
    vertices: wp.array(dtype=VirtualVertex),
    objects: wp.array(dtype=ObjectRecord),
    numbers: TriangleNumbers,
    backs: wp.array(dtype=wp.int64),  # of ``draw_back_faces``
    # Out:
    keys: wp.array(dtype=wp.int64),  # of 1 / distance and the triangle's number; 0 where nothing is seen
):
    """Draw the virtual triangles of one chunk."""
    chunk = first + wp.tid()
    k, base = drawn[chunks[chunk][0]], first_vertex[chunks[chunk][0]]
    begin = chunks[chunk][1]
    for i in range(begin, wp.min(begin + CHUNK, objects[k].faces.shape[0])):
        face = objects[k].faces[i]
        a, b, c = base + face[0], base + face[1], base + face[2]
        if is_drawn(vertices[a].is_seen, vertices[b].is_seen, vertices[c].is_seen):
            pa, pb = in_pixels(camera, vertices[a].position), in_pixels(camera, vertices[b].position)
            pc = in_pixels(camera, vertices[c].position)
            box = touched_pixels(points, pa, pb, pc)
            triangle = homogeneous_triangle(pa, pb, pc)
            distance = wp.vec3(vertices[a].distance, vertices[b].distance, vertices[c].distance)
            depth = wp.vec3(vertices[a].depth, vertices[b].depth, vertices[c].depth)
            above = wp.vec3(vertices[a].above, vertices[b].above, vertices[c].above)
            for y in range(box.first_y, box.last_y + 1):
                for x in range(box.first_x, box.last_x + 1):
                    pixel = y * points.width + x
                    for point in range(points.first[pixel], points.first[pixel + 1]):
                        shares = shares_at(triangle, points.place[point])
                        if shares[0] >= 0.0 and wp.dot(shares, above) >= 0.0:
                            if value_in(backs[point]) * wp.dot(shares, depth) <= 1.0:
                                nearness = 1.0 / wp.dot(shares, distance)
                                keep_nearer_at(keys, point, nearness, number_of(numbers, k, i))


@launch.kernel
def resolve_points(
    first: int,
    # In:
    camera: CameraView,
    points: DrawnPoints,
    keys: wp.array(dtype=wp.int64),
    ray_of: wp.array(dtype=wp.int32),  # the ray that leaves the reflector at each point
    first_vertex_of: wp.array(dtype=wp.int32),  # place of vertex 0 of each object of the scene
    vertices: wp.array(dtype=VirtualVertex),
    objects: wp.array(dtype=ObjectRecord),
    numbers: TriangleNumbers,
    # In and out: rays where something is seen are turned to it
    rays: RayBuffer,
    # Out:
    hits: HitBuffer,
):
    """Find what one point sees in the mirror, from its key, and let its ray meet that."""
    i = first + wp.tid()
    if keys[i] != wp.int64(0):
        number = int(keys[i] & wp.int64(0x7FFFFFFF))
        k = object_of(numbers, number)
        triangle = first_triangle_of(numbers, k, number)
        face = objects[k].faces[triangle]
        shares = shares_at(virtual_triangle(camera, vertices, first_vertex_of[k], face), points.place[i])
        met = wp.float64(shares[0]) * device_vertex(objects[k], face[0])
        met += wp.float64(shares[1]) * device_vertex(objects[k], face[1])
        met += wp.float64(shares[2]) * device_vertex(objects[k], face[2])
        ray = ray_of[i]
        way = from_to(rays.origin[ray], met)
        length = wp.length(way)
        if length > 0.0:
            rays.direction[ray] = way / length
        hits.t[ray] = length
        hits.object[ray] = k
        hits.triangle[ray] = triangle
        hits.barycentrics[ray] = wp.vec2(shares[1], shares[2])
