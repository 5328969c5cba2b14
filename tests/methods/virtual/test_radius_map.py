"""The cube map of radii: its nodes, what it gives between them, its seams and holes."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.methods.virtual.radius_map import RadiusMap, node_directions, radial_point

RNG = np.random.default_rng(3)


@launch.kernel
def look_up(
    first: int,
    # In:
    surface: RadiusMap,
    directions: wp.array(dtype=wp.vec3d),
    # Out:
    found_out: wp.array(dtype=wp.vec4d),
):
    """Each thread looks up one direction."""
    i = first + wp.tid()
    found = radial_point(surface, directions[i])
    found_out[i] = wp.vec4d(found.radius, found.gradient[0], found.gradient[1], found.gradient[2])


def looked_up(intervals: int, values: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    device = wp.get_device("cpu")
    surface = RadiusMap()
    surface.intervals = intervals
    surface.values = wp.array(values.astype(np.float32), dtype=wp.vec4, device=device)
    surface.beyond = wp.zeros(len(values), dtype=wp.uint8, device=device)
    found = wp.zeros(len(directions), dtype=wp.vec4d, device=device)
    launch.launch(look_up, len(directions), [surface, wp.array(directions, dtype=wp.vec3d), found], device)
    return found.numpy()[:, 0], found.numpy()[:, 1:]


def random_directions(count: int) -> np.ndarray:
    ways = RNG.normal(size=(count, 3))
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


def ellipsoid(directions: np.ndarray) -> np.ndarray:
    """(n, 4): radius and gradient of an ellipsoid about its middle."""
    squares = 1.0 / np.array([1.0, 1.5, 2.0]) ** 2
    radii = (directions**2 @ squares) ** -0.5
    gradients = -(radii**3)[:, None] * squares * directions
    gradients -= np.einsum("ij,ij->i", gradients, directions)[:, None] * directions
    return np.concatenate([radii[:, None], gradients], axis=1)


def test_faces_are_in_the_houses_order_and_share_their_borders() -> None:
    nodes = node_directions(4).reshape(6, 5, 5, 3)
    axes = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    assert np.allclose(nodes[:, 2, 2], axes)
    # 8 corners, 12 edges with 3 nodes between corners, 6 faces with 3 x 3 inside.
    assert len(np.unique(nodes.reshape(-1, 3).round(12), axis=0)) == 8 + 12 * 3 + 6 * 9


def test_nodes_are_looked_up_as_they_are() -> None:
    nodes = node_directions(5)
    radii, gradients = looked_up(5, ellipsoid(nodes), nodes)
    found = np.concatenate([radii[:, None], gradients], axis=1)
    assert np.allclose(found, ellipsoid(nodes), atol=1e-6)


def test_between_nodes_it_errs_by_the_square_of_their_distance() -> None:
    directions = random_directions(20_000)
    worst = []
    for intervals in (16, 32):
        radii, gradients = looked_up(intervals, ellipsoid(node_directions(intervals)), directions)
        exact = ellipsoid(directions)
        worst.append([abs(radii - exact[:, 0]).max(), abs(gradients - exact[:, 1:]).max()])
    assert np.all(np.array(worst[1]) < 0.3 * np.array(worst[0])) and worst[1][0] < 4e-3
    assert abs(np.einsum("ij,ij->i", gradients, directions)).max() < 1e-9


def test_there_are_no_seams() -> None:
    values = RNG.uniform(1.0, 2.0, size=(6, 9, 9, 4)).reshape(-1, 4)
    nodes = node_directions(8)
    # Random values, equal where nodes of two faces are one.
    _, same = np.unique(nodes.round(9), axis=0, return_inverse=True)
    values = values[np.unique(same, return_index=True)[1]][same]
    along = RNG.uniform(-1.0, 1.0, 2000)
    steps = 1e-9 * np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0]])
    edge = np.stack([np.ones(2000), np.ones(2000), along], axis=1)
    this, other = (
        looked_up(8, values, side / np.linalg.norm(side, axis=1, keepdims=True))[0] for side in edge + steps[:, None]
    )
    assert np.allclose(this, other, atol=1e-6)


def test_a_hole_takes_all_texels_about_it() -> None:
    nodes = node_directions(8)
    values = ellipsoid(nodes)
    hole = 4 * 81 + 4 * 9 + 4  # the middle of face +z
    values[hole] = 0.0
    directions = random_directions(5000)
    radii, _ = looked_up(8, values, directions)
    is_near = (directions[:, 2] > 0.0) & (np.abs(directions[:, :2]) < 0.25 * directions[:, 2:]).all(axis=1)
    assert is_near.sum() > 50
    assert np.array_equal(radii == 0.0, is_near)
