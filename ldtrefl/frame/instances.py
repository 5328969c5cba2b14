"""Drawing many objects of one mesh, at a cost near what is seen of them.

Objects are drawn front to back. Each goes down the tree over its mesh's clusters (``world/clusters.py``). What lies
beside the view, between pixel centres, or behind what the pixels see already is left out, box by box. The triangles
that are left are drawn as all others are: to the bit the same.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.drawn_objects import DrawnObjects
from ldtrefl.frame.large_triangles import LargeTriangles, draw_or_set_aside, draw_those_set_aside, none_set_aside
from ldtrefl.frame.pixel_box import BEHIND, GUARD, first_pixel, last_pixel
from ldtrefl.frame.projection import DrawnObject, projected
from ldtrefl.frame.triangle_rows import Target, Triangle, is_behind, nearness_bits
from ldtrefl.geometry.vectors import as_double
from ldtrefl.tracing.tracer import array_of_views
from ldtrefl.world.clusters import CHILDREN, CLUSTER, Clusters
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.triangle_numbers import TriangleNumbers, number_of

MANY = 64
"""Objects of one mesh from which clusters are made of it: that takes about as long as to draw so many without them."""

FIRST_BATCH = 512
"""Objects that are drawn at once, the nearest. Each next batch is twice as large: it sees what those before it hide."""

MOST_POINTS = wp.constant(3 * CLUSTER)
"""The most points of a cluster."""

MOST_BOXES = wp.constant(96)
"""Boxes that may be left to go on with: 8 for each of the ten levels that the largest mesh has."""

MOST_PIXELS = wp.constant(256)
"""Pixels of a box up to which it is looked whether all of them see something nearer."""

SLACK = wp.constant(wp.float64(1.0e-3))
"""Pixels by which boxes are widened: far more than what triangles' boxes are widened by, and than rounding."""


@wp.struct
class BoxView:
    """A box of unit space as the camera sees it."""

    depth: wp.float64  # of its centre
    nearest: wp.float64  # depth
    farthest: wp.float64
    may_be_seen: bool


@wp.func
def spread(x: wp.float64, y: wp.float64, z: wp.float64, half: wp.vec3d) -> wp.float64:
    """How far x, y, z times a point of a box is from that of its centre, at most."""
    return wp.abs(x) * half[0] + wp.abs(y) * half[1] + wp.abs(z) * half[2]


@wp.func
def box_view(drawn: DrawnObject, low: wp.vec3, high: wp.vec3, target: Target) -> BoxView:
    """Look at a box of an object."""
    two = wp.float64(2.0)
    centre, half = (as_double(low) + as_double(high)) / two, (as_double(high) - as_double(low)) / two
    point = wp.vec4d(centre[0], centre[1], centre[2], wp.float64(1.0))
    row_x, row_y, row_z = drawn.row_x, drawn.row_y, drawn.row_z
    view = BoxView()
    view.depth = wp.dot(row_z, point)
    deep = spread(row_z[0], row_z[1], row_z[2], half)
    view.nearest = view.depth - deep
    view.farthest = view.depth + deep
    view.may_be_seen = view.farthest > BEHIND
    if view.nearest > BEHIND:
        x, y = wp.dot(row_x, point) / view.depth, wp.dot(row_y, point) / view.depth
        reach_x = (
            SLACK
            + spread(row_x[0] - x * row_z[0], row_x[1] - x * row_z[1], row_x[2] - x * row_z[2], half) / view.nearest
        )
        reach_y = (
            SLACK
            + spread(row_y[0] - y * row_z[0], row_y[1] - y * row_z[1], row_y[2] - y * row_z[2], half) / view.nearest
        )
        limit = GUARD - wp.float64(1.0)
        if wp.abs(x) + reach_x < limit and wp.abs(y) + reach_y < limit:
            first_x, last_x = wp.max(first_pixel(x - reach_x), 0), wp.min(last_pixel(x + reach_x), target.width - 1)
            first_y = wp.max(first_pixel(y - reach_y), target.first_row)
            last_y = wp.min(last_pixel(y + reach_y), target.end_row - 1)
            view.may_be_seen = first_x <= last_x and first_y <= last_y
            if view.may_be_seen and (last_x - first_x + 1) * (last_y - first_y + 1) <= MOST_PIXELS:
                bits = nearness_bits(wp.float64(1.0) / view.nearest)
                view.may_be_seen = not is_hidden(target, first_x, last_x, first_y, last_y, bits)
    return view


@wp.func
def is_hidden(target: Target, first_x: int, last_x: int, first_y: int, last_y: int, nearest: int) -> bool:
    """Whether all pixels of a box see something nearer already."""
    y = int(first_y)
    while y <= last_y:
        x = int(first_x)
        while x <= last_x:
            if not is_behind(target, x, y, nearest):
                return False
            x += 1
        y += 1
    return True


@launch.kernel
def draw_instances(
    first: int,
    # In:
    begin: int,
    drawn: wp.array(dtype=DrawnObject),
    meshes: wp.array(dtype=wp.int32),  # of each object drawn, its mesh's place among ``clusters``
    clusters: wp.array(dtype=Clusters),
    numbers: TriangleNumbers,
    # Out:
    target: Target,
    large: LargeTriangles,
):
    """Draw one object, from front to back. Long because the boxes to go on with, and a cluster's corners, are kept in
    arrays of the kernel's own."""
    place = begin + first + wp.tid()
    one = drawn[place]
    mesh = clusters[meshes[place]]
    levels = wp.zeros(shape=MOST_BOXES, dtype=wp.int32)
    boxes = wp.zeros(shape=MOST_BOXES, dtype=wp.int32)  # numbers within the level
    depths = wp.zeros(shape=MOST_BOXES, dtype=wp.float64)  # the nearest box last
    corners = wp.zeros(shape=MOST_POINTS, dtype=wp.vec3d)
    count = int(1)
    levels[0] = mesh.first_box.shape[0] - 2
    while count > 0:
        count -= 1
        level, index = int(levels[count]), int(boxes[count])
        box = mesh.first_box[level] + index
        if level > 0:
            # Those inside it that may be seen, the nearest last.
            level -= 1
            base = int(count)
            end = wp.min(CHILDREN * index + CHILDREN, mesh.first_box[level + 1] - mesh.first_box[level])
            for child in range(CHILDREN * index, end):
                box = mesh.first_box[level] + child
                view = box_view(one, mesh.low[box], mesh.high[box], target)
                if view.may_be_seen:
                    k = int(count)
                    while k > base and depths[k - 1] < view.depth:
                        boxes[k] = boxes[k - 1]
                        depths[k] = depths[k - 1]
                        k -= 1
                    boxes[k] = child
                    depths[k] = view.depth
                    levels[count] = level
                    count += 1
        elif box_view(one, mesh.low[box], mesh.high[box], target).may_be_seen:
            first_point = mesh.first_point[index]
            for k in range(mesh.first_point[index + 1] - first_point):
                corners[k] = projected(one, as_double(mesh.points[first_point + k]))
            for k in range(CLUSTER * index, wp.min(CLUSTER * index + CLUSTER, mesh.triangles.shape[0])):
                triangle = Triangle()
                triangle.a = corners[int(mesh.corners[k][0])]
                triangle.b = corners[int(mesh.corners[k][1])]
                triangle.c = corners[int(mesh.corners[k][2])]
                triangle.number = number_of(numbers, one.object, mesh.triangles[k])
                draw_or_set_aside(target, triangle, place, mesh.triangles[k], large)


def instances_among(scene: DeviceScene, objects: DrawnObjects) -> np.ndarray:
    """(n,) bool: which objects are instances of meshes that many of them have."""
    if len(objects.numbers) < MANY:
        return np.zeros(len(objects.numbers), bool)
    mesh_of = scene.mesh_of[objects.numbers]
    counts = np.bincount(mesh_of, minlength=len(scene.meshes))
    can_be = np.array([len(mesh.mesh.outliers) == 0 for mesh in scene.meshes])
    return ((counts >= MANY) & can_be)[mesh_of]


def draw_all_instances(scene: DeviceScene, objects: DrawnObjects, target: Target) -> None:
    """Draw instances of meshes that many objects have."""
    device = scene.device
    objects = objects.some(np.argsort(objects.depths, kind="stable"))
    meshes, mesh_of = np.unique(scene.mesh_of[objects.numbers], return_inverse=True)
    views = array_of_views([scene.meshes[number].clusters for number in meshes], Clusters, device)
    not_kept = np.full(len(objects.numbers), -1)
    drawn, of_drawn = (
        objects.on_device(not_kept, device),
        wp.array(mesh_of.astype(np.int32), dtype=wp.int32, device=device),
    )
    begin, size = 0, FIRST_BATCH
    while begin < len(objects.numbers):
        count, large = min(size, len(objects.numbers) - begin), none_set_aside(device)
        inputs = [begin, drawn, of_drawn, views, scene.triangle_numbers, target, large]
        launch.launch(draw_instances, count, inputs, device)
        no_corners = wp.empty(0, dtype=wp.vec3d, device=device)
        draw_those_set_aside(large, scene.records, drawn, scene.triangle_numbers, no_corners, target)
        begin, size = begin + count, 2 * size
