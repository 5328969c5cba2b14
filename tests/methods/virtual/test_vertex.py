"""Virtual vertices against the unfolded path in closed form."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.projection import chunks_of
from ldtrefl.methods.virtual.vertex import VirtualVertex, find_points, not_seen, unfolded
from tests.frame import flat_mirror


@launch.kernel
def unfold(
    first: int,
    # In:
    eye: wp.vec3d,
    points: wp.array(dtype=wp.vec3d),
    vertices: wp.array(dtype=wp.vec3d),
    # Out:
    vertices_out: wp.array(dtype=VirtualVertex),
):
    """Unfold the path to one vertex."""
    i = first + wp.tid()
    vertices_out[i] = unfolded(eye, points[i], vertices[i], wp.float64(2.5))
    if i == 0:
        vertices_out[i] = not_seen()


def test_a_path_is_unfolded_to_its_whole_length() -> None:
    rng, device = np.random.default_rng(3), launch.resolve_device(None)
    eye, points, vertices = np.array([1e3, 2.0, -1.0]), rng.normal(size=(50, 3)), rng.normal(size=(50, 3))
    points, vertices = points + eye + [5.0, 0.0, 0.0], vertices + eye
    made = wp.empty(50, dtype=VirtualVertex, device=device)
    inputs = [wp.vec3d(*eye), *(wp.array(values, dtype=wp.vec3d, device=device) for values in (points, vertices))]
    launch.launch(unfold, 50, [*inputs, made], device)
    found = made.numpy()[1:]
    there, onwards = points - eye, vertices - points
    length = np.linalg.norm(there, axis=1) + np.linalg.norm(onwards, axis=1)
    expected = eye + there / np.linalg.norm(there, axis=1, keepdims=True) * length[:, None]
    np.testing.assert_allclose(found["position"], expected[1:], rtol=1e-12)
    np.testing.assert_allclose(found["distance"], np.linalg.norm(onwards, axis=1)[1:], rtol=1e-6)
    assert (found["is_seen"] == 1).all() and (found["depth"] == 2.5).all() and (found["above"] > 0).all()
    assert made.numpy()["is_seen"][0] == 0


@pytest.mark.parametrize("offset", [0.0, 1e5])
def test_chunks_hold_every_vertex_of_each_object(offset: float) -> None:
    box = (0.1 + offset, 0.5, 1.2)
    scene = flat_mirror.on_device(flat_mirror.scene(place=box))
    drawn, counts = np.array([1, 0], np.int32), scene.vertex_counts[[1, 0]]
    first = (np.cumsum(counts) - counts).astype(np.int32)
    device, points = scene.device, wp.zeros(int(counts.sum()), dtype=wp.vec3d, device=scene.device)
    chunks = chunks_of(counts, device)
    arrays = [wp.array(values, dtype=wp.int32, device=device) for values in (drawn, first)]
    launch.launch(find_points, chunks.shape[0], [chunks, *arrays, scene.records, points], device)
    found = flat_mirror.in_world(scene, points.numpy())
    for number, begin, count in zip(drawn, first, counts, strict=True):
        source = scene.scene.objects[number]
        matrix = source.world_from_object()
        expected = source.geometry.vertices @ matrix[:3, :3].T + matrix[:3, 3]
        np.testing.assert_allclose(found[begin : begin + count], expected, atol=1e-6)
