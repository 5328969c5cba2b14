"""Many objects of one mesh are drawn to the bit as each alone would be."""

import dataclasses

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.native_sources import native_body
from ldtrefl.frame import instances
from ldtrefl.frame.drawn_objects import DrawnObjects
from ldtrefl.frame.instances import (
    CONSTANTS,
    EVERYWHERE,
    FILES,
    MANY,
    MOST_BOXES,
    NEXT,
    TRIANGLES,
    VIEW,
    InstanceView,
    SeenBox,
    instance_view,
    instances_among,
    next_cluster,
    triangles_seen,
)
from ldtrefl.frame.projection import DrawnObject
from ldtrefl.frame.triangle_rows import Target
from ldtrefl.frame.visibility import draw_gbuffer, draw_in_bands
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.scene.mesh import Mesh
from ldtrefl.world.clusters import CLUSTER, Clusters
from tests.frame.drawing import assert_same
from tests.frame.flat_mirror import on_device

CAMERAS = {
    "outside": Camera(eye=(0, -5, 1.2), look_at=(0, 0, 0), width=160, height=120),
    "among them": Camera(eye=(0, -0.5, 0.1), look_at=(0, 0, 0), fov_y=80, width=160, height=120),
    "wide": Camera(eye=(0, -0.3, 0.1), look_at=(0.1, 1, 0), fov_y=160, width=160, height=120),
    "far": Camera(eye=(0, -300, 20), look_at=(0, 0, 0), fov_y=0.6, width=160, height=120),
    "an image of few pixels": Camera(eye=(0, -5, 1.2), look_at=(0, 0, 0), width=7, height=3),
}
KINDS = {
    "balls": ("sphere", {"segments": [32, 16]}, 0.06, 300),
    "dense knots": ("torus_knot", {"segments": [300, 40]}, 0.12, 70),
    "boxes": ("box", {}, 0.1, 200),
    "rooms, wherein the camera may be": ("room", {}, 1.6, 70),
}


def scene_of(kind: str) -> Scene:
    shape, params, size, count = KINDS[kind]
    rng = np.random.default_rng(6)
    things = [
        Object(
            shape=shape,
            params=params,
            scale=tuple((size * rng.uniform(0.5, 1.5, 3)).tolist()),
            rotate=(1.0, 2.0, 3.0, 17.0 * k),
            translate=tuple(place),
            material=Material(mirror=0.5) if k % 7 == 0 else Material(),
        )
        for k, place in enumerate(rng.uniform(-1, 1, (count, 3)).tolist())
    ]
    return Scene(camera=CAMERAS["outside"], objects=tuple(things))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("view", CAMERAS)
def test_instances_give_the_bits_of_objects_drawn_apart(kind: str, view: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, camera = on_device(scene_of(kind)), CAMERAS[view]
    found = draw_gbuffer(scene, camera)
    if view == "outside":
        assert len(np.unique(found.objects)) > 3
    monkeypatch.setattr(instances, "MANY", 10**9)
    assert_same(found, draw_gbuffer(scene, camera))
    monkeypatch.setattr(instances, "MANY", 1)
    monkeypatch.setattr(instances, "FIRST_BATCH", 7)
    assert_same(draw_gbuffer(scene, camera), found)


def test_bands_of_instances_are_parts_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, camera = on_device(scene_of("dense knots")), CAMERAS["outside"]
    whole = draw_gbuffer(scene, camera)
    monkeypatch.setattr("ldtrefl.frame.visibility.BAND_PIXELS", 40 * camera.width)
    bands = list(draw_in_bands(scene, camera))
    assert len(bands) == 3
    np.testing.assert_array_equal(np.concatenate([band.objects for band in bands]), whole.objects)
    np.testing.assert_array_equal(np.concatenate([band.triangles for band in bands]), whole.triangles)


def test_what_is_hidden_is_found_behind_a_wall() -> None:
    """A wall of boxes before many balls: no ball is seen, and each that looks over it is."""
    wall = [Object(shape="box", scale=(1.2, 0.1, 1.0), translate=(2.0 * x, 0, -1.0)) for x in range(-10, 11)]
    balls = [
        Object(shape="sphere", params={"segments": [16, 8]}, scale=0.2, translate=(x, 2.0 + y, z))
        for z in (-1.0, 0.3)
        for x in range(-5, 6)
        for y in range(3)
    ]
    camera = Camera(eye=(0, -6, 0), look_at=(0, 0, 0), fov_y=40, width=200, height=100)
    seen = np.unique(draw_gbuffer(on_device(Scene(camera=camera, objects=(*wall, *balls))), camera).objects)
    behind, above = np.split(len(wall) + np.arange(len(balls)), 2)
    assert not np.isin(behind, seen).any() and np.isin(above.reshape(-1, 3)[3:-3, 0], seen).all()


def test_meshes_of_many_objects_are_drawn_as_instances_but_for_odd_ones() -> None:
    """Not those with outliers, nor what is very large or as near as the camera's plane."""
    many = [Object(shape="box", translate=(0, 3.0 * k, 0)) for k in range(MANY)]
    few = [Object(shape="torus", translate=(5, 3.0 * k, 0)) for k in range(MANY - 1)]
    ball = Object(shape="sphere", params={"segments": [32, 16]}).geometry
    far = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1e7, 0, 0], [1e7, 1, 0], [1e7, 0, 1]])
    faces = np.r_[ball.faces, len(ball.vertices) + np.arange(6).reshape(2, 3)]
    odd = Mesh(np.r_[ball.vertices, far], faces)
    assert len(odd.outliers) > 0
    outliers = [Object(mesh=odd, translate=(0, 0, 3.0 * k)) for k in range(MANY)]
    camera = CAMERAS["outside"]
    scene = on_device(Scene(camera=camera, objects=(*many, *few, *outliers)))
    every, radius = np.arange(len(scene.objects)), scene.spheres[0, 3]
    objects = DrawnObjects(every, np.full(len(every), 100.0 * radius), np.zeros((len(every), 3, 4)))
    assert np.flatnonzero(instances_among(scene, camera, objects)).tolist() == list(range(MANY))
    assert not instances_among(scene, camera, objects.some(slice(1, None))).any()
    for depth, fov_y, expected in ((1.3 * radius, 40.0, 0), (1.4 * radius, 40.0, MANY), (100.0 * radius, 1e-3, 0)):
        nearer = dataclasses.replace(objects, depths=np.full(len(every), depth))
        narrow = dataclasses.replace(camera, fov_y=fov_y)
        assert instances_among(scene, narrow, nearer)[:MANY].sum() == expected


@wp.func_native("\n#define PLAIN_VECTORS\n" + native_body(CONSTANTS, FILES, VIEW + TRIANGLES))
def triangles_seen_without_vectors(mesh: Clusters, view: InstanceView, target: Target, cluster: int) -> wp.int32: ...


@wp.func_native("\n#define PLAIN_VECTORS\n" + native_body(CONSTANTS, FILES, VIEW + NEXT))
def next_cluster_without_vectors(
    mesh: Clusters, view: InstanceView, target: Target, boxes: wp.array(dtype=SeenBox), count: wp.array(dtype=int)
) -> wp.int32: ...


@launch.kernel
def look_at_clusters(
    first: int,
    # In:
    drawn: wp.array(dtype=DrawnObject),
    mesh: Clusters,
    target: Target,
    # Out: of each cluster 1 if it may be seen, and its triangles; of each object with vectors, then without
    clusters_out: wp.array3d(dtype=int),
    triangles_out: wp.array3d(dtype=int),
):
    """Go through the clusters of one object that may be seen, both ways."""
    i = first + wp.tid()
    view = instance_view(drawn[i])
    memory, count_memory = wp.zeros(shape=MOST_BOXES, dtype=SeenBox), wp.zeros(shape=1, dtype=int)
    boxes = wp.array(ptr=memory.ptr, shape=(MOST_BOXES,), dtype=SeenBox)
    count = wp.array(ptr=count_memory.ptr, shape=(1,), dtype=int)
    for way in range(2):
        boxes[0].level = mesh.first_node.shape[0] - 1
        boxes[0].first_x = 0
        boxes[0].first_y = 0
        boxes[0].last_x = EVERYWHERE
        boxes[0].last_y = EVERYWHERE
        boxes[0].number = 0
        count[0] = 1
        cluster = int(0)
        while cluster >= 0:
            if way == 0:
                cluster = next_cluster(mesh, view, target, boxes, count)
            else:
                cluster = next_cluster_without_vectors(mesh, view, target, boxes, count)
            if cluster >= 0:
                clusters_out[i, way, cluster] = 1
        for k in range(triangles_out.shape[2]):
            if way == 0:
                triangles_out[i, way, k] = triangles_seen(mesh, view, target, k)
            else:
                triangles_out[i, way, k] = triangles_seen_without_vectors(mesh, view, target, k)


@pytest.mark.parametrize("view", ["outside", "far"])
def test_no_triangle_that_covers_a_pixel_is_left_out_with_vectors_or_without(view: str) -> None:
    """Every object is looked at before an empty z-buffer. Each pixel is tested in float64, in or beside a triangle."""
    scene, camera = on_device(scene_of("dense knots")), CAMERAS[view]
    objects = DrawnObjects.of(scene, camera, np.arange(12))
    target = Target()
    target.keys = wp.zeros(camera.width * camera.height, dtype=wp.int64, device=scene.device)
    target.width, target.first_row, target.end_row = camera.width, 0, camera.height
    clusters, count = scene.meshes[0].clusters, len(objects.numbers)
    number = clusters.first_group.shape[0] - 1
    found = [wp.zeros((count, 2, number), dtype=int, device=scene.device) for _ in range(2)]
    drawn = objects.on_device(np.full(count, -1), scene.device)
    launch.launch(look_at_clusters, count, [drawn, clusters, target, *found], scene.device)
    seen_clusters, seen = (values.numpy() for values in found)
    order, mesh = clusters.triangles.numpy(), scene.meshes[0].mesh
    points = np.c_[mesh.unit_vertices.astype(float), np.ones(len(mesh.unit_vertices))]
    for k in range(count):
        x, y, depth = (points @ objects.projections[k].T).T
        corners = np.stack([x / depth, y / depth], axis=1)[mesh.faces[order]]
        covers = np.array([covers_a_centre(triangle, camera) for triangle in corners])
        assert 10 < covers.sum() < 0.5 * len(covers)
        of_cluster = np.arange(len(order)) // int(CLUSTER)
        for way in range(2):
            kept = seen[k, way, of_cluster] >> np.arange(len(order)) % int(CLUSTER) & 1 == 1
            assert kept[covers].all() and seen_clusters[k, way, of_cluster[covers]].all()
            assert (kept & (seen_clusters[k, way, of_cluster] == 1)).sum() < 2.0 * covers.sum() + 50


def covers_a_centre(corners: np.ndarray, camera: Camera) -> bool:
    """Whether a triangle, (3, 2) in pixels, covers a pixel's centre, by all pixels in its box."""
    low = np.maximum(np.ceil(corners.min(axis=0) - 0.5), 0).astype(int)
    high = np.minimum(np.floor(corners.max(axis=0) - 0.5), [camera.width - 1, camera.height - 1]).astype(int)
    x, y = np.meshgrid(np.arange(low[0], high[0] + 1) + 0.5, np.arange(low[1], high[1] + 1) + 0.5)
    a, b, c = corners
    sides = [(q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) for p, q in ((a, b), (b, c), (c, a))]
    return bool(((np.min(sides, axis=0) >= 0) | (np.max(sides, axis=0) <= 0)).any()) if x.size else False
