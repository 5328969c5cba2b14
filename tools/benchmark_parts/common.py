"""The scenes and kernels that the benchmark's parts share."""

from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

from ldtrefl import launch, skips
from ldtrefl.scene import Camera, Light, Material, Object, Scene
from ldtrefl.trace import Tracer, array_of_views, batch_kernel, occluded_of

ROOT = Path(__file__).parent.parent.parent

SKIPS_BUT_FRAMES = [name for name in skips.names() if name != "frames"]
"""So that every frame is made anew."""


UNIT_SPACE = np.zeros(3), 1.0
"""The ``unit_frame`` of rays that are in unit space already."""


class Batch:
    """A tracer's kernel over fixed rays, its outputs allocated once."""

    def __init__(
        self,
        tracer: Tracer,
        view: Any,
        origins: wp.array,
        directions: wp.array,
        unit_frame: tuple[np.ndarray, float] = UNIT_SPACE,
    ) -> None:
        n, device = origins.shape[0], origins.device
        self.t, self.triangle = wp.empty(n, dtype=float, device=device), wp.empty(n, dtype=int, device=device)
        outputs = [self.t, wp.empty(n, dtype=wp.vec3, device=device), self.triangle]
        outputs += [wp.empty(n, dtype=wp.vec2, device=device), wp.zeros(n, dtype=wp.uint8, device=device)]
        self._view = view  # owns the arrays that the kernel's copy points to
        views = array_of_views([view], tracer.view, device)
        self._arguments = [views, wp.vec3d(*unit_frame[0]), wp.float64(1.0 / unit_frame[1])]
        self._arguments += [origins, directions, *outputs]
        self._kernel, self._count, self._device = batch_kernel(tracer), n, device

    def __call__(self) -> None:
        launch.launch(self._kernel, self._count, self._arguments, self._device)


@launch.once
def any_hit_kernel(tracer: Tracer) -> wp.Kernel:
    """The kernel that asks of rays, given in object space with unit directions, whether they meet anything."""
    is_blocked = occluded_of(tracer)

    @launch.kernel
    def trace_any_hit(
        first: int,
        # In:
        views: wp.array(dtype=tracer.view),
        centre: wp.vec3d,
        per_half: wp.float64,
        origins: wp.array(dtype=wp.vec3),
        directions: wp.array(dtype=wp.vec3),
        # Out:
        occluded_out: wp.array(dtype=wp.bool),
    ):
        i = first + wp.tid()
        o = origins[i]
        start = per_half * (wp.vec3d(wp.float64(o[0]), wp.float64(o[1]), wp.float64(o[2])) - centre)
        occluded_out[i] = is_blocked(views, 0, start, directions[i], float(wp.inf), wp.vec3(0.0))

    return trace_any_hit


class AnyHitBatch:
    """The same for any-hit queries."""

    def __init__(
        self,
        tracer: Tracer,
        view: Any,
        origins: wp.array,
        directions: wp.array,
        unit_frame: tuple[np.ndarray, float] = UNIT_SPACE,
    ) -> None:
        self.occluded = wp.empty(origins.shape[0], dtype=wp.bool, device=origins.device)
        self._view = view
        views = array_of_views([view], tracer.view, origins.device)
        self._arguments = [views, wp.vec3d(*unit_frame[0]), wp.float64(1.0 / unit_frame[1])]
        self._arguments += [origins, directions, self.occluded]
        self._kernel, self._count, self._device = any_hit_kernel(tracer), origins.shape[0], origins.device

    def __call__(self) -> None:
        launch.launch(self._kernel, self._count, self._arguments, self._device)


def knot_scene(segments: tuple[int, int], width: int, height: int) -> Scene:
    """A mirror ball and a torus knot."""
    knot = Object(
        name="knot",
        shape="torus_knot",
        params={"segments": list(segments)},
        rotate=(1, 0.3, 0, 50),
        scale=0.75,
        translate=(1.2, -1.1, 0.1),
    )
    return Scene(
        camera=Camera(eye=(-0.5, -4.5, 0.8), look_at=(0.4, 0, 0.0), fov_y=36, width=width, height=height),
        lights=(Light(kind="directional", direction=(0.3, 0.8, -0.7), radiance=(1.0, 1.0, 1.0)),),
        objects=(
            Object(name="ball", shape="sphere", material=Material(albedo=(0.02,) * 3, mirror=(0.9,) * 3)),
            knot,
        ),
    )
