"""The scenes and kernels that the benchmark's parts share."""

from pathlib import Path

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.skip_options import skip_names
from ldtrefl.scene.description import Camera, Light, Material, Object, Scene
from ldtrefl.tracing.batch import batch_kernel
from ldtrefl.tracing.tracer import Tracer, array_of_views, block_of

ROOT = Path(__file__).parent.parent.parent

SKIPS_BUT_FRAMES = [name for name in skip_names() if name != "frames"]
"""Every skip but that of a frame which is the same as the last: so each frame is made anew, and can be timed."""

MIRROR = Material(albedo=(0.02,) * 3, mirror=(0.9,) * 3)

UNIT_SPACE = np.zeros(3), 1.0
"""The ``unit_frame`` of rays that are in unit space already."""


class Batch:
    """A tracer's kernel over fixed rays, its outputs allocated once."""

    def __init__(
        self,
        tracer: Tracer,
        view: object,
        origins: wp.array,
        directions: wp.array,
        unit_frame: tuple[np.ndarray, float] = UNIT_SPACE,
        *,
        only_whether: bool = False,
    ) -> None:
        """Rays in the object space that has this ``unit_frame``; ``only_whether`` they meet anything, where asked."""
        rays, device = origins.shape[0], origins.device
        block = block_of(device)
        items, told = -(-rays // block), 0 if only_whether else rays
        self.t, self.triangle = wp.empty(told, dtype=float, device=device), wp.empty(rays, dtype=int, device=device)
        outputs = [self.t, wp.empty(told, dtype=wp.vec3, device=device), self.triangle]
        outputs += [wp.empty(told, dtype=wp.vec2, device=device), wp.empty(items, dtype=int, device=device)]
        self._view = view  # owns the arrays that the kernel's copy points to
        views = array_of_views([view], tracer.view, device)
        self._arguments = [views, wp.vec3d(*unit_frame[0]), wp.float64(1.0 / unit_frame[1]), origins, directions]
        self._arguments += [wp.empty(0, dtype=float, device=device), *outputs]
        self._kernel, self._count, self._device = batch_kernel(tracer, block, only_whether), items, device

    def __call__(self) -> None:
        launch.launch(self._kernel, self._count, self._arguments, self._device)


def knot_scene(segments: tuple[int, int], width: int, height: int) -> Scene:
    """A mirror ball and a torus knot."""
    ball = Object(name="ball", shape="sphere", material=MIRROR)
    return _with_knot(ball, segments, width, height)


def wall_scene(segments: tuple[int, int], width: int, height: int) -> Scene:
    """The same knot before a flat mirror."""
    wall = Object(
        name="wall", shape="plane", rotate=(1, 0, 0, 90), scale=1.6, translate=(1.0, 1.0, 0.0), material=MIRROR
    )
    return _with_knot(wall, segments, width, height)


def _with_knot(mirror: Object, segments: tuple[int, int], width: int, height: int) -> Scene:
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
        objects=(mirror, knot),
    )
