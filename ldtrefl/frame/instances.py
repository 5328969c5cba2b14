"""Drawing many objects of one mesh, at a cost near what is seen of them.

Objects are drawn front to back. Each goes down the tree over its mesh's clusters (``world/clusters.py``). What lies
beside the view, between pixel centres, or behind what the pixels see already is left out, box by box and then triangle
by triangle. That is found in floats, eight at a time, in C++ (``instance_boxes.h``, ``cluster_triangles.h``). Nothing
that may be seen is left out. The triangles that are left are drawn as all others are: to the bit the same.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bits import lowest_bit
from ldtrefl.device.native_sources import native_body
from ldtrefl.frame.drawn_objects import DrawnObjects
from ldtrefl.frame.large_triangles import LargeTriangles, draw_or_set_aside, draw_those_set_aside, none_set_aside
from ldtrefl.frame.projection import DrawnObject, projected
from ldtrefl.frame.triangle_rows import Target, Triangle
from ldtrefl.geometry.vectors import as_double, as_single
from ldtrefl.scene.description import Camera
from ldtrefl.tracing.tracer import array_of_views
from ldtrefl.world.clusters import CLUSTER, LANES, Clusters
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.triangle_numbers import TriangleNumbers, number_of

MANY = 64
"""Objects of one mesh from which clusters are made of it: that takes about as long as to draw so many without them."""

FIRST_BATCH = 512
"""Objects that are drawn at once, the nearest. Each next batch is twice as large: it sees what those before it hide."""

MOST_BOXES = wp.constant(96)
"""Boxes that may be left to go on with: 8 for each of the ten levels that the largest mesh has."""

EVERYWHERE = wp.constant(1 << 14)
"""Pixels along the sides of the first box: so large a one is not looked at whether it is hidden."""

NEAREST_PART = 0.25
"""Of the depth of an object's centre: no part of an instance is nearer to the camera's plane, so that floats tell it
apart from that plane. Objects that reach nearer are drawn apart."""

LARGEST_SIZE = 2048.0
"""Pixels across an instance, at most. Larger objects are drawn apart."""

ERROR = wp.constant(wp.float64(1.0e-6))
"""Share of an instance's size by which its points are off in floats: eight roundings, where they are four times as far
from its centre as they seem, since they may be nearer than it."""

SLACK = wp.constant(1.0e-3)
"""Pixels by which bounds are widened at least: far more than what triangles' boxes are widened by."""

CONSTANTS: dict[str, float | int] = {
    "CHILDREN": LANES,
    "CLUSTER": int(CLUSTER),
    "FARTHEST": 1.0e6,  # pixels, outside of every image
    "MOST_PIXELS": 256,  # of a box up to which it is looked whether all see something nearer
    "NO_BOUND": (1 << 31) - 1,
    "ROUNDED_UP": 1.00001,  # nearness in floats times this is no less than it is
}
"""What the C++ reads, by the names that it has there."""
FILES = ("device/vectors.h", "frame/instance_boxes.h", "frame/cluster_triangles.h")
"""The C++, each file after those that its class is derived from."""


@wp.struct
class InstanceView:
    """An object as the camera sees it (``instance_boxes.h`` says what the fields mean)."""

    x: wp.vec3
    y: wp.vec3
    z: wp.vec3
    across: float
    down: float
    depth: float
    error: float
    slack: float
    pixel_x: int  # that is counted from, in the whole image
    pixel_y: int


@wp.struct
class SeenBox:
    """A box that may be seen (``instance_boxes.h``)."""

    level: int
    number: int
    depth: float
    first_x: int
    last_x: int
    first_y: int
    last_y: int
    nearest: int


@wp.func
def instance_view(drawn: DrawnObject) -> InstanceView:
    """Look at an object from near its centre."""
    row_x, row_y, row_z = drawn.row_x, drawn.row_y, drawn.row_z
    depth = row_z[3]
    x, y = row_x[3] / depth, row_y[3] / depth
    of_x = wp.vec3d(row_x[0] - x * row_z[0], row_x[1] - x * row_z[1], row_x[2] - x * row_z[2])
    of_y = wp.vec3d(row_y[0] - y * row_z[0], row_y[1] - y * row_z[1], row_y[2] - y * row_z[2])
    view = InstanceView()
    view.x = as_single(of_x)
    view.y = as_single(of_y)
    view.z = wp.vec3(float(row_z[0]), float(row_z[1]), float(row_z[2]))
    view.pixel_x = int(wp.floor(x))
    view.pixel_y = int(wp.floor(y))
    view.across = float(x - wp.floor(x))
    view.down = float(y - wp.floor(y))
    view.depth = float(depth)
    size = wp.float64(4.0) * (wp.length(of_x) + wp.length(of_y)) / depth
    view.error = float(ERROR * (size + wp.float64(1.0)))
    view.slack = SLACK + view.error
    return view


VIEW = """
const int left = view.pixel_x, top = view.pixel_y;
ClusterTriangles::View seen_as;
for (int k = 0; k < 3; ++k) {
    seen_as.x[k] = view.x[k];
    seen_as.y[k] = view.y[k];
    seen_as.z[k] = view.z[k];
}
seen_as.across = view.across;
seen_as.down = view.down;
seen_as.depth = view.depth;
seen_as.error = view.error;
seen_as.slack = view.slack;
ClusterTriangles::Band band;
band.keys = (const long long*)target.keys.data + (long long)(top - target.first_row) * target.width + left;
band.width = target.width;
band.first_x = -left;
band.last_x = target.width - 1 - left;
band.first_y = target.first_row - top;
band.last_y = target.end_row - 1 - top;
"""
NEXT = """
const ClusterTriangles::Tree tree = {
    (const float*)mesh.boxes.data, (const int*)mesh.first_node.data, (int)mesh.first_group.shape[0] - 1
};
return ClusterTriangles::next_cluster(tree, seen_as, band, (ClusterTriangles::Box*)boxes.data, *(int*)count.data);
"""
TRIANGLES = """
const int group = ((const int*)mesh.first_group.data)[cluster], end = ((const int*)mesh.first_group.data)[cluster + 1];
const int rest = (int)mesh.triangles.shape[0] - CLUSTER * cluster;  // the last cluster is filled up
return (rest < CLUSTER ? (1 << rest) - 1 : (1 << CLUSTER) - 1) & ClusterTriangles::triangles_seen(
    (const float*)mesh.points.data + 24 * (long long)group, end - group,
    (const unsigned char*)mesh.corners.data + 3 * CLUSTER * (long long)cluster, seen_as, band
);
"""


@wp.func_native(native_body(CONSTANTS, FILES, VIEW + NEXT))
def next_cluster(
    mesh: Clusters, view: InstanceView, target: Target, boxes: wp.array(dtype=SeenBox), count: wp.array(dtype=int)
) -> wp.int32:
    """The next cluster that may be seen, -1 if there is none; ``boxes`` are ``count[0]`` to go on with."""
    ...


@wp.func_native(native_body(CONSTANTS, FILES, VIEW + TRIANGLES))
def triangles_seen(mesh: Clusters, view: InstanceView, target: Target, cluster: int) -> wp.int32:
    """A bit for each triangle of a cluster that may be seen."""
    ...


@wp.func
def corner_point(mesh: Clusters, cluster: int, corner: int, k: int) -> wp.vec3d:
    """A corner of triangle ``k`` of a cluster, in unit space."""
    point = int(mesh.corners[CLUSTER * (3 * cluster + corner) + k])
    place = 24 * (mesh.first_group[cluster] + point / 8) + point % 8
    return as_double(wp.vec3(mesh.points[place], mesh.points[place + 8], mesh.points[place + 16]))


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
    """Draw what may be seen of one object, from front to back."""
    place = begin + first + wp.tid()
    one = drawn[place]
    mesh = clusters[meshes[place]]
    view = instance_view(one)
    box_memory, count_memory = wp.zeros(shape=MOST_BOXES, dtype=SeenBox), wp.zeros(shape=1, dtype=int)
    boxes = wp.array(ptr=box_memory.ptr, shape=(MOST_BOXES,), dtype=SeenBox)
    count = wp.array(ptr=count_memory.ptr, shape=(1,), dtype=int)
    boxes[0].level = mesh.first_node.shape[0] - 1
    boxes[0].last_x = EVERYWHERE
    boxes[0].last_y = EVERYWHERE
    count[0] = 1
    cluster = next_cluster(mesh, view, target, boxes, count)
    while cluster >= 0:
        seen = triangles_seen(mesh, view, target, cluster)
        while seen != 0:
            k = lowest_bit(wp.uint64(seen))
            seen = seen & (seen - 1)
            index = mesh.triangles[CLUSTER * cluster + k]
            triangle = Triangle()
            triangle.a = projected(one, corner_point(mesh, cluster, 0, k))
            triangle.b = projected(one, corner_point(mesh, cluster, 1, k))
            triangle.c = projected(one, corner_point(mesh, cluster, 2, k))
            triangle.number = number_of(numbers, one.object, index)
            draw_or_set_aside(target, triangle, place, index, large)
        cluster = next_cluster(mesh, view, target, boxes, count)


def instances_among(scene: DeviceScene, camera: Camera, objects: DrawnObjects) -> np.ndarray:
    """(n,) bool: which objects are drawn as instances, because many have the same mesh."""
    if len(objects.numbers) < MANY:
        return np.zeros(len(objects.numbers), bool)
    mesh_of, radii = scene.mesh_of[objects.numbers], scene.spheres[objects.numbers, 3]
    counts = np.bincount(mesh_of, minlength=len(scene.meshes))
    can_be = np.array([len(mesh.mesh.outliers) == 0 for mesh in scene.meshes])
    pixels_at_1 = 0.5 * camera.height / np.tan(np.radians(camera.fov_y) / 2.0)
    nearest = objects.depths - radii
    is_small = (nearest > NEAREST_PART * objects.depths) & (2.0 * radii * pixels_at_1 < LARGEST_SIZE * nearest)
    return ((counts >= MANY) & can_be)[mesh_of] & is_small


def draw_all_instances(scene: DeviceScene, objects: DrawnObjects, target: Target) -> None:
    """Draw instances of meshes that many objects have."""
    device = scene.device
    objects = objects.some(np.argsort(objects.depths, kind="stable"))
    meshes, mesh_of = np.unique(scene.mesh_of[objects.numbers], return_inverse=True)
    views = array_of_views([scene.meshes[number].clusters for number in meshes], Clusters, device)
    drawn = objects.on_device(np.full(len(objects.numbers), -1), device)
    of_drawn = wp.array(mesh_of.astype(np.int32), dtype=wp.int32, device=device)
    begin, size = 0, FIRST_BATCH
    while begin < len(objects.numbers):
        count, large = min(size, len(objects.numbers) - begin), none_set_aside(device)
        inputs = [begin, drawn, of_drawn, views, scene.triangle_numbers, target, large]
        launch.launch(draw_instances, count, inputs, device)
        no_corners = wp.empty(0, dtype=wp.vec3d, device=device)
        draw_those_set_aside(large, scene.records, drawn, scene.triangle_numbers, no_corners, target)
        begin, size = begin + count, 2 * size
