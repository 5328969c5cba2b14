"""Primary visibility by search: the rays of the pixels that an object may cover, searched for in it by a tracer.

A mesh whose triangles are many and small in the image is seen sooner so than if all of them were drawn
(``search_choice.py``). What is found goes into the z-buffer by the rule by which drawn triangles do, so that it does
not matter in which order objects are drawn and searched.

A pixel's ray is found in float64 in the object's unit space. There its direction is rounded to float32, and its origin
is moved by what that is off at the object's centre: so rounding is that of the object's own size, however far the eye
is.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.struct_arrays import host_structs
from ldtrefl.frame.drawn_objects import DrawnObjects
from ldtrefl.frame.pixel_order import BLOCK
from ldtrefl.frame.search_choice import ImageBoxes
from ldtrefl.frame.triangle_rows import Target, is_behind, keep_nearest, nearness_bits
from ldtrefl.geometry.vectors import as_double, as_single
from ldtrefl.scene.description import Camera
from ldtrefl.tracing.hit import Hit
from ldtrefl.tracing.tracer import BoundTracer, Query, Tracer, block_of
from ldtrefl.world.camera import Band
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.triangle_numbers import TriangleNumbers, number_of

SIDE = wp.constant(BLOCK)
"""Pixels along a side of a block."""

PACKET_WIDTH, PACKET_HEIGHT = wp.constant(4), wp.constant(2)
"""Pixels of a block that stand together: eight rays go down a tree as a packet (``ldt/exact/packets.h``)."""

BEYOND = wp.constant(wp.float64(1.000001))
"""Factor on the depth that a pixel sees so far, up to which its ray is searched for: what lies as deep must be found,
too, whatever way it is rounded."""


@dataclass(frozen=True, eq=False)
class CameraSearch:
    """Objects that the camera's rays are searched for in, and by what."""

    numbers: np.ndarray
    """(n,) int64, ascending."""
    tracer: BoundTracer
    """Ready for these objects."""


def numbers_of(search: CameraSearch | None) -> np.ndarray:
    """(n,) int64 numbers of the objects that are searched; none without a search."""
    return np.zeros(0, np.int64) if search is None else search.numbers


@wp.struct
class SearchedObject:
    """An object that is searched, as the camera sees it. All vectors are in its unit space."""

    object: int  # its number
    eye: wp.vec3d
    ray: wp.vec3d  # the ray through pixel coordinates (x, y) is ``ray + x across + y down``, 1 long in depth
    across: wp.vec3d
    down: wp.vec3d
    depth: wp.float64  # of its centre
    nearest: wp.float64  # 1 / depth that no point of it exceeds
    first_x: int  # pixels of the band that it may cover
    last_x: int
    first_y: int
    last_y: int
    columns: int  # blocks of pixels in a row of them


@wp.struct
class PixelRay:
    """A pixel's ray as it is searched for in an object."""

    query: Query
    stretch: wp.float64  # length in unit space of a ray that is 1 long in depth
    x: int
    y: int


@wp.func
def pixel_ray_of(one: SearchedObject, target: Target, x: int, y: int) -> PixelRay:
    """The ray through a pixel's centre, up to what the pixel sees so far."""
    half = wp.float64(0.5)
    exact = one.ray + (wp.float64(x) + half) * one.across + (wp.float64(y) + half) * one.down
    made = PixelRay()
    made.x = x
    made.y = y
    made.stretch = wp.length(exact)
    unit = exact / made.stretch
    made.query.direction = as_single(unit)
    made.query.origin = one.eye + (one.depth * made.stretch) * (unit - as_double(made.query.direction))
    made.query.t_max = wp.inf
    nearness = wp.cast(int(target.keys[(y - target.first_row) * target.width + x] >> wp.int64(32)), float)
    if nearness > 0.0:
        made.query.t_max = float(BEYOND * made.stretch / wp.float64(nearness))
    return made


@wp.func
def pixel_in_block(i: int) -> wp.vec2i:
    """Column and row in a block of the pixel that comes at place ``i`` in it: packet by packet."""
    packet = i / (PACKET_WIDTH * PACKET_HEIGHT)
    within = i % (PACKET_WIDTH * PACKET_HEIGHT)
    packets = SIDE / PACKET_WIDTH
    column = PACKET_WIDTH * (packet % packets) + within % PACKET_WIDTH
    return wp.vec2i(column, PACKET_HEIGHT * (packet / packets) + within / PACKET_WIDTH)


@launch.once
def search_pixels_kernel(tracer: Tracer, block: int) -> wp.Kernel:
    """The kernel that finds what pixels see of objects by this tracer; one item searches for ``block`` pixels' rays."""
    find_hits = tracer.closest_hits
    size = wp.constant(block)

    @launch.kernel
    def search_pixels(
        first: int,
        # In:
        blocks: wp.array(dtype=wp.vec2i),  # the place of an object among ``searched``, and a block of its pixels
        searched: wp.array(dtype=SearchedObject),
        views: wp.array(dtype=tracer.view),
        numbers: TriangleNumbers,
        # Out:
        target: Target,
    ):
        """Search for the rays of some pixels of a block, in one object."""
        begin = size * (first + wp.tid())
        of_block = blocks[begin / (SIDE * SIDE)]
        one = searched[of_block[0]]
        block_x = one.first_x + SIDE * (of_block[1] % one.columns)
        block_y = one.first_y + SIDE * (of_block[1] / one.columns)
        nearest = nearness_bits(one.nearest)
        rays = wp.zeros(shape=size, dtype=PixelRay)
        query_memory, hit_memory = wp.zeros(shape=size, dtype=Query), wp.zeros(shape=size, dtype=Hit)
        queries = wp.array(ptr=query_memory.ptr, shape=(size,), dtype=Query)
        hits = wp.array(ptr=hit_memory.ptr, shape=(size,), dtype=Hit)
        count = int(0)
        for i in range(size):
            at = pixel_in_block((begin + i) % (SIDE * SIDE))
            x = block_x + at[0]
            y = block_y + at[1]
            if x <= one.last_x and y <= one.last_y:
                if not is_behind(target, x, y, nearest):
                    rays[count] = pixel_ray_of(one, target, x, y)
                    queries[count] = rays[count].query
                    count += 1
        if count > 0:
            find_hits(views, one.object, queries, count, hits)
        for i in range(count):
            if hits[i].triangle >= 0:
                nearness = float(rays[i].stretch / wp.float64(hits[i].t))
                keep_nearest(target, number_of(numbers, one.object, hits[i].triangle), rays[i].x, rays[i].y, nearness)

    return search_pixels


def search_pixels(
    scene: DeviceScene, camera: Camera, band: Band, objects: DrawnObjects, tracer: BoundTracer, target: Target
) -> None:
    """Find what the pixels of a band see of objects, all of which lie before the camera."""
    objects = objects.some(np.argsort(objects.depths, kind="stable"))
    boxes = ImageBoxes.of(scene, objects).within(camera, band)
    device = scene.device
    made, rows = host_structs(len(objects.numbers), SearchedObject)
    from_pixels = np.linalg.inv(objects.projections[:, :, :3])
    rows["object"] = objects.numbers
    rows["eye"] = -np.einsum("nij,nj->ni", from_pixels, objects.projections[:, :, 3])
    for axis, name in enumerate(("across", "down", "ray")):
        rows[name] = from_pixels[:, :, axis]
    rows["depth"], rows["nearest"] = objects.projections[:, 2, 3], 1.0 / boxes.nearest
    for name in ("first_x", "last_x", "first_y", "last_y"):
        rows[name] = getattr(boxes, name)
    columns, lines = (np.maximum(0, -(-pixels // BLOCK)) for pixels in (boxes.columns, boxes.lines))
    rows["columns"] = columns
    counts = columns * lines
    place = np.repeat(np.arange(len(counts)), counts)
    block = np.arange(len(place)) - np.repeat(np.cumsum(counts) - counts, counts)
    blocks = wp.array(np.stack([place, block], axis=1).astype(np.int32), dtype=wp.vec2i, device=device)
    size = block_of(device)
    inputs = [blocks, made.to(device), tracer.views, scene.triangle_numbers, target]
    launch.launch(search_pixels_kernel(tracer.tracer, size), len(place) * (BLOCK * BLOCK // size), inputs, device)
