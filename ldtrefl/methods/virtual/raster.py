"""Drawing virtual triangles at the points where a reflector is seen.

What is drawn to are points of the image, several in a pixel or one at its centre, sorted by pixel: no others exist, so
a reflection is seen only through the reflector's own pixels. The depth test is that of Roger and Holzschuch 2006,
section 3.3.6: by the distance from the reflection point, and only before the frontmost back faces of the reflector.
Nor may the reflection point lie far before what is seen of the reflector: it would be another part of it.
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


@wp.struct
class Piece:
    """A part of a triangle."""

    object: int
    triangle: int
    vertices: wp.vec3i  # numbers of its corners among all virtual vertices
    a: wp.vec2  # barycentrics of its corners in the whole triangle: the weights of its second and third corner
    b: wp.vec2
    c: wp.vec2


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
def virtual_triangle(camera: CameraView, a: VirtualVertex, b: VirtualVertex, c: VirtualVertex) -> HomogeneousTriangle:
    """The triangle between three virtual vertices."""
    return homogeneous_triangle(
        in_pixels(camera, a.position), in_pixels(camera, b.position), in_pixels(camera, c.position)
    )


@wp.func
def keep_nearer_at(keys: wp.array(dtype=wp.int64), i: int, value: float, number: int):
    """Put a value above 0 and a number into the key of point ``i``: the largest value stays."""
    keep_largest(keys, i, (wp.int64(wp.cast(value, wp.int32)) << wp.int64(32)) | wp.int64(number))


@wp.func
def value_in(key: wp.int64) -> float:
    """The value in a key."""
    return wp.cast(int(key >> wp.int64(32)), float)


@wp.func
def number_in(key: wp.int64) -> int:
    """The number in a key."""
    return int(key & wp.int64(0x7FFFFFFF))


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


@wp.func
def draw_between(
    camera: CameraView,
    points: DrawnPoints,
    a: VirtualVertex,
    b: VirtualVertex,
    c: VirtualVertex,
    number: int,
    fronts: wp.array(dtype=float),
    backs: wp.array(dtype=wp.int64),
    keys: wp.array(dtype=wp.int64),
):
    """Draw the triangle of this number between three virtual vertices."""
    pa, pb, pc = in_pixels(camera, a.position), in_pixels(camera, b.position), in_pixels(camera, c.position)
    box = touched_pixels(points, pa, pb, pc)
    triangle = homogeneous_triangle(pa, pb, pc)
    distance, depth = wp.vec3(a.distance, b.distance, c.distance), wp.vec3(a.depth, b.depth, c.depth)
    above = wp.vec3(a.above, b.above, c.above)
    for y in range(box.first_y, box.last_y + 1):
        for x in range(box.first_x, box.last_x + 1):
            pixel = y * points.width + x
            for point in range(points.first[pixel], points.first[pixel + 1]):
                shares = shares_at(triangle, points.place[point])
                if shares[0] >= 0.0 and wp.dot(shares, above) >= 0.0:
                    reach = wp.dot(shares, depth)
                    if value_in(backs[point]) * reach <= 1.0 and (reach <= 0.0 or reach >= fronts[point]):
                        keep_nearer_at(keys, point, 1.0 / wp.dot(shares, distance), number)


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
    fronts: wp.array(dtype=float),  # the least depth of a reflection point at each point
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
            number = number_of(numbers, k, i)
            draw_between(camera, points, vertices[a], vertices[b], vertices[c], number, fronts, backs, keys)


@launch.kernel
def draw_pieces(
    first: int,
    # In:
    camera: CameraView,
    points: DrawnPoints,
    pieces: wp.array(dtype=Piece),
    vertices: wp.array(dtype=VirtualVertex),
    fronts: wp.array(dtype=float),
    backs: wp.array(dtype=wp.int64),
    # Out:
    keys: wp.array(dtype=wp.int64),  # of 1 / distance and the piece's number; 0 where nothing is seen
):
    """Draw one piece of a triangle."""
    i = first + wp.tid()
    a, b, c = pieces[i].vertices[0], pieces[i].vertices[1], pieces[i].vertices[2]
    if is_drawn(vertices[a].is_seen, vertices[b].is_seen, vertices[c].is_seen):
        draw_between(camera, points, vertices[a], vertices[b], vertices[c], i, fronts, backs, keys)


@wp.func
def meet_at(
    rays: RayBuffer,
    ray: int,
    objects: wp.array(dtype=ObjectRecord),
    k: int,
    triangle: int,
    uv: wp.vec2,
    hits: HitBuffer,
):
    """Let a ray meet an object's triangle at barycentrics (u, v): it is turned there."""
    face, u, v = objects[k].faces[triangle], wp.float64(uv[0]), wp.float64(uv[1])
    met = (wp.float64(1.0) - u - v) * device_vertex(objects[k], face[0])
    met += u * device_vertex(objects[k], face[1]) + v * device_vertex(objects[k], face[2])
    way = from_to(rays.origin[ray], met)
    length = wp.length(way)
    if length > 0.0:
        rays.direction[ray] = way / length
    hits.t[ray] = length
    hits.object[ray] = k
    hits.triangle[ray] = triangle
    hits.barycentrics[ray] = uv


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
        number = number_in(keys[i])
        k = object_of(numbers, number)
        triangle = first_triangle_of(numbers, k, number)
        face, base = objects[k].faces[triangle], first_vertex_of[k]
        a, b, c = vertices[base + face[0]], vertices[base + face[1]], vertices[base + face[2]]
        shares = shares_at(virtual_triangle(camera, a, b, c), points.place[i])
        meet_at(rays, ray_of[i], objects, k, triangle, wp.vec2(shares[1], shares[2]), hits)


@launch.kernel
def resolve_pieces(
    first: int,
    # In:
    camera: CameraView,
    points: DrawnPoints,
    keys: wp.array(dtype=wp.int64),
    ray_of: wp.array(dtype=wp.int32),  # the ray that leaves the reflector at each point
    pieces: wp.array(dtype=Piece),
    vertices: wp.array(dtype=VirtualVertex),
    objects: wp.array(dtype=ObjectRecord),
    # In and out: rays where something is seen are turned to it
    rays: RayBuffer,
    # Out:
    hits: HitBuffer,
):
    """Find which piece one point sees in the mirror, from its key, and let its ray meet that."""
    i = first + wp.tid()
    if keys[i] != wp.int64(0):
        piece = pieces[number_in(keys[i])]
        a, b, c = vertices[piece.vertices[0]], vertices[piece.vertices[1]], vertices[piece.vertices[2]]
        shares = shares_at(virtual_triangle(camera, a, b, c), points.place[i])
        uv = shares[0] * piece.a + shares[1] * piece.b + shares[2] * piece.c
        meet_at(rays, ray_of[i], objects, piece.object, piece.triangle, uv, hits)
