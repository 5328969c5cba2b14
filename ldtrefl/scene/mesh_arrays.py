"""A mesh's arrays: checked, copied, and brought to the unit cube. Each pass is one kernel on all cores that reads its
input once.

    faces    -> in range?             -> int32, and which vertices they use
    vertices -> finite and not large? -> float64, and the box about those in use
    vertices -> the unit cube, float32

Arrays may have any strides. They are copied, unless they are of the right type and nobody can change them
(:func:`is_immutable`). Where something is wrong, the number of the first wrong triangle or vertex is returned, and the
copy is not to be used.
"""

from typing import Any

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.vectors import as_single, high_side, low_side

LARGEST_COORDINATE = 1e100
"""Sizes and their squares stay finite in float64."""

LARGEST_UNIT = 1e30
"""Largest unit coordinate, since they become float32. What lies farther out is put here: squares of either are infinite
in float32."""

RUN = wp.constant(1024)
RUNS = wp.constant(4)
"""A thread of a kernel takes a block of ``RUNS`` runs of ``RUN`` triangles or vertices each. Where little is done with
each, it goes through the runs side by side: along a single one the processor waits for memory half of the time."""

NONE = wp.constant((1 << 31) - 1)
"""Written as the first wrong triangle or vertex of a block in which none is wrong."""

FIRST_LOW = wp.constant(wp.float64(np.inf))
"""The low side of a box about nothing; its high side is the negative."""

WIDEST = wp.constant(wp.float64(LARGEST_COORDINATE))
FARTHEST_UNIT = wp.constant(wp.float64(LARGEST_UNIT))


@wp.func
def is_index(number: wp.int64, count: wp.int64) -> bool:
    """Whether one of ``count`` things has this number."""
    return number >= wp.int64(0) and number < count


@launch.once
def faces_kernel(index: type) -> wp.Kernel:
    """The kernel that checks and copies faces of the Warp type ``index``."""

    @launch.kernel
    def copy_faces(
        first: int,
        # In:
        given: wp.array2d(dtype=index),
        vertices: wp.int64,  # how many there are
        # Out:
        faces_out: wp.array(dtype=wp.vec3i),  # empty if the faces are not to be copied
        used_out: wp.array(dtype=wp.uint8),  # per vertex, 0 before; two threads may write one, and both write 1
        wrong_out: wp.array(dtype=wp.int32),  # per block: its first triangle with an index out of range
    ):
        """Check and copy the triangles of one block, and mark their vertices."""
        block = first + wp.tid()
        copies = faces_out.shape[0] > 0
        wrong = int(NONE)
        for k in range(RUN):
            for run in range(RUNS):
                triangle = RUN * (RUNS * block + run) + k
                if triangle < given.shape[0]:
                    a = wp.int64(given[triangle, 0])
                    b = wp.int64(given[triangle, 1])
                    c = wp.int64(given[triangle, 2])
                    if is_index(a, vertices) and is_index(b, vertices) and is_index(c, vertices):
                        if copies:
                            faces_out[triangle] = wp.vec3i(int(a), int(b), int(c))
                        used_out[int(a)] = wp.uint8(1)
                        used_out[int(b)] = wp.uint8(1)
                        used_out[int(c)] = wp.uint8(1)
                    else:
                        wrong = wp.min(wrong, triangle)
        wrong_out[block] = wrong

    return copy_faces


@launch.once
def vertices_kernel(coordinate: type) -> wp.Kernel:
    """The kernel that checks and copies vertices of the Warp type ``coordinate``."""

    @launch.kernel
    def copy_vertices(
        first: int,
        # In:
        given: wp.array2d(dtype=coordinate),
        used: wp.array(dtype=wp.uint8),
        # Out:
        vertices_out: wp.array(dtype=wp.vec3d),  # empty if the vertices are not to be copied
        low_out: wp.array(dtype=wp.vec3d),  # per block: the box about the vertices in use
        high_out: wp.array(dtype=wp.vec3d),
        wrong_out: wp.array(dtype=wp.int32),  # per block: its first vertex that is not finite or too large
    ):
        """Check and copy the vertices of one block, and find the box about those in use."""
        block = first + wp.tid()
        copies = vertices_out.shape[0] > 0
        wrong = int(NONE)
        low, high = wp.vec3d(FIRST_LOW), wp.vec3d(-FIRST_LOW)
        begin = RUN * RUNS * block
        for vertex in range(begin, wp.min(begin + RUN * RUNS, given.shape[0])):
            x, y, z = wp.float64(given[vertex, 0]), wp.float64(given[vertex, 1]), wp.float64(given[vertex, 2])
            # NaN is not at most anything.
            if not (wp.abs(x) <= WIDEST and wp.abs(y) <= WIDEST and wp.abs(z) <= WIDEST):
                wrong = wp.min(wrong, vertex)
            place = wp.vec3d(x, y, z)
            if copies:
                vertices_out[vertex] = place
            if used[vertex] != wp.uint8(0):
                low = low_side(low, place)
                high = high_side(high, place)
        low_out[block] = low
        high_out[block] = high
        wrong_out[block] = wrong

    return copy_vertices


@launch.kernel
def fit_vertices(
    first: int,
    # In:
    vertices: wp.array(dtype=wp.vec3d),
    centre: wp.vec3d,
    half: wp.float64,
    # Out:
    unit_out: wp.array(dtype=wp.vec3),
):
    """Bring the vertices of one block to the unit cube."""
    block = first + wp.tid()
    farthest = wp.vec3d(FARTHEST_UNIT)
    for k in range(RUN):
        for run in range(RUNS):
            vertex = RUN * (RUNS * block + run) + k
            if vertex < vertices.shape[0]:
                place = (vertices[vertex] - centre) / half
                unit_out[vertex] = as_single(low_side(farthest, high_side(-farthest, place)))


def copied_faces(given: np.ndarray, vertices: int) -> tuple[np.ndarray, np.ndarray, int | None]:
    """Check faces, and copy them.

    Args:
        given: (m, 3) int32 or int64, any strides.
        vertices: how many there are.

    Returns:
        (m, 3) int32; (vertices,) bool, which vertices they use; the first triangle with an index out of range.
    """
    is_shared = is_immutable(given, np.int32)
    faces = given if is_shared else np.empty(given.shape, np.int32)
    used = np.zeros(vertices, np.uint8)
    blocks, cpu = _block_count(len(given)), launch.resolve_device("cpu")
    wrong = np.empty(blocks, np.int32)
    index = wp.int32 if given.dtype == np.int32 else wp.int64
    copies = _as_warp(faces[:0] if is_shared else faces, wp.vec3i, cpu)
    outputs = [copies, _as_warp(used, wp.uint8, cpu), _as_warp(wrong, wp.int32, cpu)]
    launch.launch(faces_kernel(index), blocks, [_as_warp(given, index, cpu), wp.int64(vertices), *outputs], cpu)
    return faces, used.view(bool), _first_of(wrong)


def copied_vertices(given: np.ndarray, is_used: np.ndarray) -> tuple[np.ndarray, np.ndarray, int | None]:
    """Check vertices, and copy them.

    Args:
        given: (n, 3) float32 or float64, any strides.
        is_used: (n,) bool, the vertices that a triangle has.

    Returns:
        (n, 3) float64; (2, 3) float64, the lowest and highest corner of the box about those in use; the first vertex
        that is not finite or too large.
    """
    is_shared = is_immutable(given, np.float64)
    vertices = given if is_shared else np.empty(given.shape, np.float64)
    blocks, cpu = _block_count(len(given)), launch.resolve_device("cpu")
    low, high, wrong = np.empty((blocks, 3)), np.empty((blocks, 3)), np.empty(blocks, np.int32)
    coordinate = wp.float64 if given.dtype == np.float64 else wp.float32
    inputs = [_as_warp(given, coordinate, cpu), _as_warp(is_used.view(np.uint8), wp.uint8, cpu)]
    copies = _as_warp(vertices[:0] if is_shared else vertices, wp.vec3d, cpu)
    outputs = [copies, _as_warp(low, wp.vec3d, cpu), _as_warp(high, wp.vec3d, cpu), _as_warp(wrong, wp.int32, cpu)]
    launch.launch(vertices_kernel(coordinate), blocks, [*inputs, *outputs], cpu)
    return vertices, np.stack([low.min(axis=0), high.max(axis=0)]), _first_of(wrong)


def fitted_vertices(vertices: np.ndarray, centre: np.ndarray, half: float) -> np.ndarray:
    """(n, 3) float32: ``(vertices - centre) / half`` of (n, 3) float64, in float64, within float32's range."""
    unit, cpu = np.empty(vertices.shape, np.float32), launch.resolve_device("cpu")
    inputs = [_as_warp(vertices, wp.vec3d, cpu), wp.vec3d(*centre), wp.float64(half)]
    launch.launch(fit_vertices, _block_count(len(vertices)), [*inputs, _as_warp(unit, wp.vec3, cpu)], cpu)
    return unit


def is_immutable(array: np.ndarray, dtype: type) -> bool:
    """Whether an array is of this type, lies in C order, and is read-only, as is all that it is a view of.

    Memory that is not numpy's own may change all the same: a file that is mapped, another library's array.
    """
    if array.dtype != dtype or not (array.flags.c_contiguous and array.flags.aligned):
        return False
    part: Any = array
    while isinstance(part, np.ndarray):
        if part.flags.writeable:
            return False
        part = part.base
    return part is None


def _block_count(items: int) -> int:
    return -(-items // int(RUN * RUNS))


def _as_warp(array: np.ndarray, dtype: type, cpu: wp.Device) -> wp.array:
    """A numpy array as kernels read and write it, where it lies."""
    return wp.array(array, dtype=dtype, device=cpu, copy=False)


def _first_of(wrong: np.ndarray) -> int | None:
    """The first wrong item, from the first of each block."""
    first = int(wrong.min())
    return None if first == int(NONE) else first
