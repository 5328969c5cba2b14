"""The rays of a run, laid side by side so that eight are tested at once against spheres.

The test is in float32, from the run's middle, and spheres are widened by its rounding: no ray is lost, and few are kept
that miss.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device.native_sources import native_body
from ldtrefl.geometry.vectors import from_to
from ldtrefl.tracing.object_sets import RUN
from ldtrefl.tracing.ray_buffers import RayBuffer

ROWS = wp.constant(6 * int(RUN))
"""Floats of a run's rays: where they start from the run's middle, and their directions, a row for each axis."""

ROUNDING = wp.constant(1.0e-6)
"""By how much a sphere is widened, as a share of its distance and of the run's extent: eight roundings of a float32."""

FILES = ("device/vectors.h", "frame/run_rays.h")
CONSTANTS: dict[str, float | int] = {"RUN": int(RUN)}

NEAR = """
    return RunRays::near_sphere(rows.data, &centre[0], radius, asked);
"""


@wp.func_native(native_body(CONSTANTS, FILES, NEAR))
def rays_near_sphere(rows: wp.array(dtype=float), centre: wp.vec3, radius: float, asked: wp.uint64) -> wp.uint64:
    """Of the rays that are asked for, a bit each, those that may meet a sphere about a point, from the run's middle."""
    ...


@wp.func
def lay_side_by_side(rays: RayBuffer, begin: int, end: int, middle: wp.vec3d, rows: wp.array(dtype=float)):
    """Fill in the rows of the rays from ``begin`` to ``end``."""
    for i in range(begin, end):
        start, direction = from_to(middle, rays.origin[i]), rays.direction[i]
        for axis in range(3):
            rows[axis * RUN + i - begin] = start[axis]
            rows[(3 + axis) * RUN + i - begin] = direction[axis]


@wp.func
def rays_near(
    rows: wp.array(dtype=float), middle: wp.vec3d, reach: float, centre: wp.vec3d, radius: float, asked: wp.uint64
) -> wp.uint64:
    """Of the rays that are asked for, a bit each, those that may meet a sphere.

    ``middle`` and ``reach`` are the centre and radius of a ball about where all rays of the run start.
    """
    towards = from_to(middle, centre)
    extent = wp.abs(towards[0]) + wp.abs(towards[1]) + wp.abs(towards[2]) + reach
    return rays_near_sphere(rows, towards, radius + ROUNDING * extent, asked)
