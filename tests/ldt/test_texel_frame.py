"""The box of texels about a mesh, and the frames of its maps."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.ldt.texel_frame import TexelFrame, point_from_texel


@launch.kernel
def find_points(first: int, out: wp.array(dtype=wp.vec3)):
    """A thread finds a point in the map of one axis."""
    axis = first + wp.tid()
    out[axis] = point_from_texel(axis, wp.vec3(1.0, 2.0, 3.0))


def test_points_of_texels() -> None:
    """The map of an axis has the next axis along u, the one after along v, and its own as depth."""
    device = launch.resolve_device(None)
    points = wp.zeros(3, dtype=wp.vec3, device=device)
    launch.launch(find_points, 3, [points], device)
    np.testing.assert_array_equal(points.numpy(), [[3.0, 1.0, 2.0], [2.0, 3.0, 1.0], [1.0, 2.0, 3.0]])


def test_the_box_is_whole_texels_about_the_middle() -> None:
    frame = TexelFrame.around(np.array([-1.0, 0.0, 0.2]), np.array([1.0, 0.5, 0.2]), 64)
    assert frame.size == (64, 16, 1) and frame.scale == 32.0
    np.testing.assert_allclose(np.array([0.0, 0.25, 0.2]) * frame.scale + frame.offset, [32.0, 8.0, 0.5])
    assert [frame.map_shape(axis) for axis in range(3)] == [(1, 16), (64, 1), (16, 64)]
    assert frame.first_texels == (0, 16, 80, 1104)
    assert frame.cells(8) == (8, 2, 1) and frame.cells(64) == (64, 16, 1)


def test_a_side_of_whole_texels_gains_none_by_rounding() -> None:
    for longest in (1.0, 1.0 + 1e-7, 3.0, 1e-3):
        low = np.full(3, -longest / 2)
        assert TexelFrame.around(low, -low, 256).size == (256, 256, 256)


def test_a_point_has_a_box() -> None:
    assert TexelFrame.around(np.zeros(3), np.zeros(3), 16).size == (1, 1, 1)
