"""A patch: its box, its plane, and the cells about it."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.box import cell_count, cell_number, cell_of_box
from ldtrefl.ldt.exact.patch import (
    Patch,
    cells_of_patch,
    crosses_cell,
    patch_high,
    patch_low,
    patch_middle,
    patch_normal,
)


@launch.kernel
def measure(
    first: int,
    patches: wp.array(dtype=Patch),
    grid: wp.vec3i,
    out: wp.array2d(dtype=wp.vec3),
    crossed: wp.array2d(dtype=wp.int32),
):
    """A thread measures one patch, and counts the visits of each cell about it; 10 more where it crosses one."""
    i = first + wp.tid()
    patch = patches[i]
    out[i, 0] = patch_low(patch)
    out[i, 1] = patch_high(patch)
    out[i, 2] = patch_middle(patch)
    out[i, 3] = patch_normal(patch)
    box = cells_of_patch(patch, grid)
    for k in range(cell_count(box)):
        cell = cell_of_box(box, k)
        crossed[i, cell_number(cell, grid)] += wp.where(crosses_cell(patch, cell), 11, 1)


def test_boxes_planes_and_cells() -> None:
    rng = np.random.default_rng(0)
    grid, count = (4, 5, 3), 200
    corner = rng.uniform(0.0, np.array(grid) - 0.01, (count, 3)).astype(np.float32)
    edges = rng.uniform(-0.7, 0.7, (2, count, 3)).astype(np.float32)
    given = np.zeros(count, Patch.numpy_dtype())
    given["corner"], given["edge_u"], given["edge_v"] = corner, *edges
    device = launch.resolve_device(None)
    out = wp.zeros((count, 4), dtype=wp.vec3, device=device)
    visits = wp.zeros((count, 60), dtype=wp.int32, device=device)
    launch.launch(measure, count, [wp.array(given, dtype=Patch, device=device), wp.vec3i(*grid), out, visits], device)
    low, high, middle, normal = np.moveaxis(out.numpy(), 1, 0)
    corners = np.stack([corner, corner + edges[0], corner + edges[1], corner + edges[0] + edges[1]])
    np.testing.assert_allclose(low, corners.min(axis=0), atol=1e-6)
    np.testing.assert_allclose(high, corners.max(axis=0), atol=1e-6)
    np.testing.assert_allclose(middle, corners.mean(axis=0), atol=1e-6)
    across = np.cross(*edges)
    np.testing.assert_allclose(normal, across / np.linalg.norm(across, axis=1, keepdims=True), atol=1e-5)

    # Every cell of the box once; and of points on the patch none lies in a cell that it is said not to cross.
    found = visits.numpy().reshape(count, grid[2], grid[1], grid[0])
    assert set(np.unique(found)) == {0, 1, 11}
    u, v = rng.uniform(0.0, 1.0, (2, 100))
    for i in range(count):
        points = corner[i] + u[:, None] * edges[0, i] + v[:, None] * edges[1, i]
        cells = np.floor(points[((points >= 0.0) & (points < grid)).all(axis=1)]).astype(int)
        assert (found[i, cells[:, 2], cells[:, 1], cells[:, 0]] == 11).all()
