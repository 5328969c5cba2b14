"""What sorted maps imply: checked against every fragment and every texel, one by one."""

import itertools

import numpy as np
import pytest

import ldtrefl
from ldtrefl.ldt.linear.occupancy import INSIDE_DOWN, INSIDE_UP, MAY_BE_INSIDE, MAY_BE_OUTSIDE, log2_up
from ldtrefl.scene import shapes


def opened(mesh: ldtrefl.Mesh) -> ldtrefl.Mesh:
    return ldtrefl.Mesh(mesh.vertices, mesh.faces[: len(mesh.faces) * 3 // 4])


@pytest.mark.parametrize("is_open", [False, True])
def test_inside_is_balance_or_parity(is_open: bool) -> None:
    mesh = shapes.make("torus", {"segments": [48, 24]})
    maps = ldtrefl.peel(*_arrays(opened(mesh) if is_open else mesh), 32, search="linear")
    start, reference = maps.start.numpy(), maps.reference.numpy()
    inside = maps.sorted_maps.occupancy.inside.numpy()
    for first, end in itertools.pairwise(start):
        wound = np.cumsum(2 * (reference[first:end] & 1) - 1)
        passed = np.arange(1, end - first + 1)
        up = down = wound != 0
        if end > first and wound[-1] != 0:
            up, down = passed % 2 == 1, (end - first - passed) % 2 == 1
        np.testing.assert_array_equal(inside[first:end], int(INSIDE_UP) * up + int(INSIDE_DOWN) * down)
    assert maps.sorted_maps.occupancy.octants == (8 if is_open else 1)


def test_cells_hold_what_any_map_says() -> None:
    """Every texel centre that the map along z says is inside lies in a cell that may be inside; and so with outside."""
    mesh = shapes.make("torus", {"segments": [48, 24]})
    maps = ldtrefl.peel(*_arrays(mesh), 32, search="linear")
    occupancy, start, depth = maps.sorted_maps.occupancy, maps.start.numpy(), maps.depth.numpy()
    side, first = occupancy.sides[0], maps.frame.first_texels[2]
    words = occupancy.cells.numpy()[: side * side].reshape(side, side, 2)
    columns, rows = maps.frame.size[0], maps.frame.size[1]
    for v in range(rows):
        for u in range(columns):
            texel = first + v * columns + u
            own = depth[start[texel] : start[texel + 1]]
            for z in range(maps.frame.size[2]):
                kind = MAY_BE_INSIDE if (own <= z + 0.5).sum() % 2 else MAY_BE_OUTSIDE
                word = int(words[v >> occupancy.cell_shift, u >> occupancy.cell_shift, int(kind)])
                assert word >> (z >> occupancy.cell_shift) & 1, (u, v, z)


def test_coarser_columns_hold_what_finer_ones_do() -> None:
    mesh = shapes.make("torus", {"segments": [48, 24]})
    occupancy = ldtrefl.peel(*_arrays(mesh), 256, search="linear").sorted_maps.occupancy
    cells, firsts = occupancy.cells.numpy(), occupancy.first_columns
    assert len(occupancy.sides) == 3 and occupancy.column_shift == log2_up(occupancy.sides[0]) == 6
    for level in (1, 2):
        finer, coarser = (
            cells[firsts[k] : firsts[k] + occupancy.sides[k] ** 2].reshape(occupancy.sides[k], occupancy.sides[k], 2)
            for k in (level - 1, level)
        )
        joined = finer.reshape(len(coarser), 4, len(coarser), 4, 2)
        np.testing.assert_array_equal(np.bitwise_or.reduce(np.bitwise_or.reduce(joined, axis=3), axis=1), coarser)


def _arrays(mesh: ldtrefl.Mesh) -> tuple[np.ndarray, np.ndarray]:
    return mesh.vertices, mesh.faces
