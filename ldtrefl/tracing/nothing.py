"""A tracer that meets nothing, for scenes without shadows and occlusion: kernels built from it hold no such rays."""

from __future__ import annotations

import warp as wp

from ldtrefl.device.stats import Stats
from ldtrefl.tracing.hit import Hit, no_hit
from ldtrefl.tracing.tracer import BoundTracer, Query, SceneTracer, Tracer
from ldtrefl.world.device_scene import DeviceScene


@wp.struct
class NoView:
    """The view of a tracer that meets nothing."""

    unused: int


@wp.func
def never_hits(
    views: wp.array(dtype=NoView), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
):
    """``closest_hits`` and ``any_hits`` of a tracer that meets nothing."""
    for i in range(count):
        hits[i] = no_hit()


@wp.func
def never_occluded(views: wp.array(dtype=NoView), index: int, query: Query, outwards: wp.vec3) -> bool:
    """``occluded`` of a tracer that meets nothing."""
    return False


NOTHING = Tracer("nothing", NoView, never_hits, never_hits, never_occluded)


def no_shadows(device: wp.Device) -> BoundTracer:
    """The tracer ``NOTHING``, ready for kernels."""
    return BoundTracer(NOTHING, wp.empty(0, dtype=NoView, device=device))


def shadow_tracer(tracer: SceneTracer, scene: DeviceScene, stats: Stats) -> BoundTracer:
    """The tracer that answers a scene's shadow rays, and those for occlusion: ``tracer``, or one that meets nothing if
    there are none."""
    if not scene.scene.lighting.is_traced:
        return no_shadows(scene.device)
    return tracer.bound(scene, range(len(scene.objects)), stats)
