"""What pixels see of surfaces, as layers of a picture have it: depth, shading normal, albedo."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bits import lowest_bit
from ldtrefl.frame.gbuffer import GBuffer, GBufferView, sight_group
from ldtrefl.shading.finish import Finish, finishing
from ldtrefl.shading.surface import Surface
from ldtrefl.shading.surfaces import GROUP, Sighting, coloring, look_from
from ldtrefl.tracing.tracer import block_of
from ldtrefl.world.look_records import Looks
from ldtrefl.world.records import LightingRecord, ObjectRecord


@dataclass(frozen=True, eq=False)
class SeenSurfaces:
    """What the pixels of a G-buffer see."""

    depth: np.ndarray
    """(h, w) float32 in the world's units along the camera's axis; +inf where nothing is seen."""
    normal: np.ndarray
    """(h, w, 3) float32 unit vectors in the world, facing the viewer, bent by normal maps; 0 where nothing is seen."""
    albedo: np.ndarray
    """(h, w, 3) float32: the share of light that is scattered, textures included; 0 where nothing is seen."""

    @classmethod
    def of(cls, gbuffer: GBuffer) -> SeenSurfaces:
        """Look at every pixel of a G-buffer."""
        scene, count = gbuffer.scene, gbuffer.pixel_count
        depth = wp.full(count, np.inf, dtype=float, device=scene.device)
        normal, albedo = (wp.zeros(count, dtype=wp.vec3, device=scene.device) for _ in range(2))
        block = block_of(scene.device)
        inputs = [block, gbuffer.view, scene.records, scene.lighting, scene.looks, depth, normal, albedo]
        launch.launch(describe_kernel(scene.features.looks), -(-count // block), inputs, scene.device)
        height, width = gbuffer.shape
        in_world = depth.numpy().reshape(height, width) / np.float32(scene.device_units_per_world_unit)
        colors = (values.numpy().reshape(height, width, 3) for values in (normal, albedo))
        return cls(in_world, *colors)


@launch.once
def describe_kernel(has_looks: bool) -> wp.Kernel:
    """The kernel that says what pixels see; ``has_looks`` if any object of the scene has a look."""
    with_looks = wp.constant(has_looks)
    color_surface, finish_surface = coloring(0), finishing(0)

    @launch.kernel
    def describe(
        first: int,
        # In:
        block: int,
        gbuffer: GBufferView,
        objects: wp.array(dtype=ObjectRecord),
        lighting: LightingRecord,
        looks: Looks,
        # Out, where something is seen:
        depth_out: wp.array(dtype=float),  # in device units
        normal_out: wp.array(dtype=wp.vec3),
        albedo_out: wp.array(dtype=wp.vec3),
    ):
        """Say what a block of pixels sees."""
        sight_memory, surface_memory = wp.zeros(shape=GROUP, dtype=Sighting), wp.zeros(shape=GROUP, dtype=Surface)
        sightings = wp.array(ptr=sight_memory.ptr, shape=(GROUP,), dtype=Sighting)
        surfaces = wp.array(ptr=surface_memory.ptr, shape=(GROUP,), dtype=Surface)
        finish_memory = wp.zeros(shape=1, dtype=Finish)
        finishes = wp.array(ptr=finish_memory.ptr, shape=(1,), dtype=Finish)
        begin = block * (first + wp.tid())
        end = wp.min(begin + block, depth_out.shape[0])
        while begin < end:
            lanes = sight_group(gbuffer, begin, end, sightings)
            look_from(objects, lanes, gbuffer.camera.eye, sightings, surfaces)
            while lanes != 0:
                lane = lowest_bit(wp.uint64(lanes))
                lanes = lanes & (lanes - 1)
                color_surface(objects, sightings, lane, surfaces)
                if with_looks:
                    if objects[sightings[lane].object].look >= 0:
                        finish_surface(objects, looks, lighting, sightings, lane, surfaces, finishes)
                away = surfaces[lane].position - gbuffer.camera.eye
                depth_out[begin + lane] = float(wp.dot(away, gbuffer.camera.forward))
                normal_out[begin + lane] = surfaces[lane].normal
                albedo_out[begin + lane] = surfaces[lane].albedo
            begin += GROUP

    return describe
