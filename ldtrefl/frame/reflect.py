"""A reflected ray's life, written once for every tracer.

    start at the reflector -> closest hit over all other objects -> shade, or environment -> bounce, or end

Rays live in arrays; a bounce is two launches, ``closest_hits`` and ``shade_hits``, both built from a tracer (a factory
closes over its functions). A surface's own object is left out of the search: reflectors do not yet reflect themselves.
When the bounces are used up, a mirror reflects the environment alone.

Device space throughout; directions have unit length.
"""

import functools
from collections.abc import Callable, Set
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import BLOCK, GBuffer, GBufferView, pixel_surface, pixel_view
from ldtrefl.frame.kept import Followed, changed_runs, put_hits, rays_of_runs
from ldtrefl.frame.regions import Culled
from ldtrefl.frame.skips import Skips
from ldtrefl.geometry.sphere import meets_sphere, sphere_entry
from ldtrefl.geometry.vectors import as_single, point_along
from ldtrefl.shading.shade import (
    Surface,
    environment_radiance,
    extended_coordinates,
    make_direct_radiance,
    mirror_direction,
    surface_at,
)
from ldtrefl.tracing.hit import Hit, no_hit
from ldtrefl.tracing.rays import HitBuffer, RayBuffer, Regions, lowest_bit, object_bits
from ldtrefl.tracing.trace import Query, Tracer, block_of, occluded_of, outlier_merger
from ldtrefl.world.camera import camera_ray
from ldtrefl.world.records import LightingRecord, ObjectRecord
from ldtrefl.world.unit_rays import into_unit, start_above, start_above_own, unit_normal

BEYOND = wp.constant(1.000001)
"""Of the distance that was met, how far another object is searched: what lies in the same place must be found too."""


@dataclass(frozen=True, eq=False)
class BoundTracer:
    """A tracer and its views of the scene's objects."""

    tracer: Tracer
    views: wp.array


@wp.struct
class NoView:
    """The view of a tracer that sees nothing."""

    unused: int


@wp.func
def never_hits(
    views: wp.array(dtype=NoView), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
):
    """``closest_hits`` and ``any_hits`` of a tracer that sees nothing: they stay misses."""
    return


@wp.func
def never_occluded(views: wp.array(dtype=NoView), index: int, query: Query, outwards: wp.vec3) -> bool:
    """``occluded`` of a tracer that sees nothing."""
    return False


@wp.func
def never_outlier(views: wp.array(dtype=NoView), index: int, origin: wp.vec3d, direction: wp.vec3, t_max: float) -> Hit:
    """``outlier_hit`` of a tracer that sees nothing."""
    return no_hit()


@wp.func
def no_outliers(views: wp.array(dtype=NoView), index: int) -> int:
    """``outlier_count`` of a tracer that sees nothing."""
    return 0


NOTHING = Tracer("nothing", NoView, never_hits, never_hits, never_occluded, never_outlier, no_outliers)
"""The tracer of scenes without shadows: kernels built from it hold no shadow rays."""


def no_shadows(device: wp.Device) -> BoundTracer:
    """``NOTHING``, bound."""
    return BoundTracer(NOTHING, wp.empty(0, dtype=NoView, device=device))


# Kernels built from a tracer.


@wp.func
def without(bits: wp.uint32, k: int) -> wp.uint32:
    """The bits without that of object ``k``."""
    return bits & ~(wp.uint32(1) << wp.uint32(k % 32))


@wp.func
def bits_without_source(
    regions: Regions, objects: wp.array(dtype=ObjectRecord), source: int, i: int, word: int
) -> wp.uint32:
    """The objects of a word that ray ``i`` can meet: not the one that it leaves."""
    bits = object_bits(regions, objects, i, word)
    if source / 32 == word:
        bits = without(bits, source)
    return bits


@wp.func
def first_entered(
    objects: wp.array(dtype=ObjectRecord), bits: wp.uint32, word: int, origin: wp.vec3, direction: wp.vec3
) -> int:
    """Of the objects of a word of bits, the one whose bounding sphere a ray enters first; if it enters none, any."""
    first = 32 * word + lowest_bit(bits)
    rest = without(bits, first)
    if rest == wp.uint32(0):
        return first
    nearest = sphere_entry(origin, direction, objects[first].centre, objects[first].radius)
    while rest != wp.uint32(0):
        k = 32 * word + lowest_bit(rest)
        entry = sphere_entry(origin, direction, objects[k].centre, objects[k].radius)
        if entry >= 0.0 and (entry < nearest or nearest < 0.0):
            nearest = entry
            first = k
        rest = without(rest, k)
    return first


@wp.func
def has_bit(bits: wp.uint32, k: int) -> bool:
    """Whether the bit of object ``k`` is set in its word."""
    return (bits & (wp.uint32(1) << wp.uint32(k % 32))) != wp.uint32(0)


@wp.func
def may_meet(record: ObjectRecord, origin: wp.vec3d, direction: wp.vec3, t_max: float) -> bool:
    """Whether a ray enters the bounding sphere of an object before ``t_max``."""
    start = as_single(origin)
    if t_max == wp.inf:
        return meets_sphere(start, direction, record.centre, record.radius)  # needs no root
    entry = sphere_entry(start, direction, record.centre, record.radius)
    return entry >= 0.0 and entry <= t_max


@wp.func
def keep_nearer(hits: HitBuffer, i: int, k: int, t: float, hit: Hit):
    """Keep what ray ``i`` meets of object ``k``, if it is nearer than what it has met so far."""
    # Of two in one place the first counts, in whatever order they are met.
    if t < hits.t[i] or (t == hits.t[i] and k < hits.object[i]):
        hits.t[i] = t
        hits.object[i] = k
        hits.triangle[i] = hit.triangle
        hits.barycentrics[i] = wp.vec2(hit.u, hit.v)


@launch.once
def closest_hits_kernel(tracer: Tracer, block: int, bounds: bool = True) -> wp.Kernel:
    """The kernel that finds where rays end, ``block`` of them an item. With ``bounds`` an object is searched only for
    the rays that enter its bounding sphere before they have met another; of 32 the first to be entered comes first."""
    find_hits, merge_outliers = tracer.closest_hits, outlier_merger(tracer)
    size, to_infinity = wp.constant(block), wp.constant(not bounds)

    @launch.kernel
    def closest_hits(
        first: int,
        # In:
        rays: RayBuffer,
        objects: wp.array(dtype=ObjectRecord),
        views: wp.array(dtype=tracer.view),
        regions: Regions,
        # Out:
        hits: HitBuffer,
    ):
        begin = size * (first + wp.tid())
        end = wp.min(begin + size, rays.source.shape[0])
        query_room, hit_room = wp.zeros(shape=size, dtype=Query), wp.zeros(shape=size, dtype=Hit)
        queries = wp.array(ptr=query_room.ptr, shape=(size,), dtype=Query)
        found = wp.array(ptr=hit_room.ptr, shape=(size,), dtype=Hit)
        number = wp.zeros(shape=size, dtype=wp.int32)
        stretch = wp.zeros(shape=size, dtype=wp.float32)
        lead = int(-1)  # a ray that says in which order
        for i in range(begin, end):
            hits.t[i] = wp.inf
            hits.object[i] = -1
            hits.triangle[i] = -1
            hits.barycentrics[i] = wp.vec2(0.0)
            hits.steps[i] = 0
            hits.searches[i] = 0
            if lead < 0 and rays.source[i] >= 0:
                lead = i
        words = wp.where(lead >= 0, (objects.shape[0] + 31) / 32, 0)
        for word in range(words):
            left = wp.uint32(0)
            for i in range(begin, end):
                if rays.source[i] >= 0:
                    left = left | bits_without_source(regions, objects, rays.source[i], i, word)
            while left != wp.uint32(0):
                k = first_entered(objects, left, word, as_single(rays.origin[lead]), rays.direction[lead])
                left = without(left, k)

                # The rays that may meet it.
                count = int(0)
                for i in range(begin, end):
                    source = rays.source[i]
                    if source >= 0:
                        bits = bits_without_source(regions, objects, source, i, word)
                        is_searched = has_bit(bits, k)
                        if is_searched and not to_infinity:
                            is_searched = may_meet(objects[k], rays.origin[i], rays.direction[i], hits.t[i])
                        if is_searched:
                            ray = into_unit(objects[k], rays.origin[i], rays.direction[i])
                            # t stays in device units: divide by the direction's length in unit space.
                            t_max = wp.where(to_infinity, wp.inf, BEYOND * hits.t[i] * ray.stretch)
                            queries[count].origin = ray.start
                            queries[count].direction = ray.way
                            queries[count].t_max = t_max
                            number[count] = i
                            stretch[count] = ray.stretch
                            count += 1
                if count > 0:
                    find_hits(views, k, queries, count, found)
                    merge_outliers(views, k, queries, count, found)
                for j in range(count):
                    of = int(number[j])
                    hits.steps[of] = hits.steps[of] + found[j].steps
                    hits.searches[of] = hits.searches[of] + 1
                    is_met = bool(found[j].triangle >= 0)
                    if to_infinity and is_met:
                        # Coarse patches may rise out of the sphere, where a search by bounds does not look.
                        is_met = may_meet(objects[k], rays.origin[of], rays.direction[of], wp.inf)
                    if is_met:
                        keep_nearer(hits, of, k, found[j].t / stretch[j], found[j])

    return closest_hits


@launch.once
def direct_radiance_of(tracer: Tracer) -> Any:
    """``direct_radiance`` with this tracer's shadows."""
    is_blocked = occluded_of(tracer)
    view_type = tracer.view

    @wp.func
    def is_lit(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        surface: Surface,
        towards: wp.vec3,
        distance: float,
    ) -> bool:
        own = surface.object
        rounded_origin = as_single(surface.position)
        for k in range(objects.shape[0]):
            entry = sphere_entry(rounded_origin, towards, objects[k].centre, objects[k].radius)
            if entry >= 0.0 and entry < distance:
                ray = into_unit(objects[k], surface.position, towards)
                outwards = unit_normal(objects[k], surface.facet)
                start = start_above(ray.start, outwards)
                if k == own:
                    start = start_above_own(objects[k], surface.triangle, ray.start, outwards)
                else:
                    outwards = wp.vec3(0.0)
                query = Query()
                query.origin = start
                query.direction = ray.way
                query.t_max = distance * ray.stretch
                if is_blocked(views, k, query, outwards):
                    return False
        return True

    @wp.func
    def always_lit(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        surface: Surface,
        towards: wp.vec3,
        distance: float,
    ) -> bool:
        return True

    return make_direct_radiance(always_lit if view_type is NoView else is_lit)


@launch.once
def shade_pixels_kernel(tracer: Tracer) -> wp.Kernel:
    """The kernel that shades what the camera sees, reflectors left out."""
    direct_radiance = direct_radiance_of(tracer)

    @launch.kernel
    def shade_pixels(
        first: int,
        # In:
        gbuffer: GBufferView,
        objects: wp.array(dtype=ObjectRecord),
        lighting: LightingRecord,
        views: wp.array(dtype=tracer.view),
        # Out:
        radiance_out: wp.array(dtype=wp.vec3),
    ):
        i = first + wp.tid()
        if gbuffer.object[i] < 0:
            x, y = float(i % gbuffer.camera.width) + 0.5, float(i / gbuffer.camera.width) + 0.5
            radiance_out[i] = environment_radiance(lighting, wp.normalize(camera_ray(gbuffer.camera, x, y)))
        elif gbuffer.reflector[i] == wp.uint8(0):
            surface = pixel_surface(gbuffer, objects, i, pixel_view(gbuffer, objects, i))
            radiance_out[i] = direct_radiance(views, objects, lighting, surface)

    return shade_pixels


@launch.once
def shade_reflectors_kernel(tracer: Tracer) -> wp.Kernel:
    """The kernel that shades the pixels that see a reflector, without what it reflects, and starts their rays."""
    direct_radiance = direct_radiance_of(tracer)

    @launch.kernel
    def shade_reflectors(
        first: int,
        # In:
        gbuffer: GBufferView,
        objects: wp.array(dtype=ObjectRecord),
        lighting: LightingRecord,
        views: wp.array(dtype=tracer.view),
        # In: of each ray the pixel. Out: the rest
        rays: RayBuffer,
        # Out:
        radiance_out: wp.array(dtype=wp.vec3),
        mirror_out: wp.array(dtype=wp.vec3),  # of each ray
    ):
        i = first + wp.tid()
        pixel = rays.pixel[i]
        view = pixel_view(gbuffer, objects, pixel)
        surface = pixel_surface(gbuffer, objects, pixel, view)
        radiance_out[pixel] = direct_radiance(views, objects, lighting, surface)
        mirror_out[i] = surface.mirror
        rays.origin[i] = surface.position
        rays.direction[i] = mirror_direction(view.direction, surface.normal)
        rays.weight[i] = wp.vec3(1.0)
        rays.source[i] = gbuffer.object[pixel]

    return shade_reflectors


@launch.once
def shade_hits_kernel(tracer: Tracer) -> wp.Kernel:
    """The kernel that adds what rays met to their pixels, and sends them on from mirrors."""
    direct_radiance = direct_radiance_of(tracer)

    @launch.kernel
    def shade_hits(
        first: int,
        # In:
        hits: HitBuffer,
        objects: wp.array(dtype=ObjectRecord),
        lighting: LightingRecord,
        views: wp.array(dtype=tracer.view),
        is_last: int,
        # In and out:
        rays: RayBuffer,
        radiance: wp.array(dtype=wp.vec3),
    ):
        i = first + wp.tid()
        if rays.source[i] < 0:
            return
        direction = rays.direction[i]
        weight = rays.weight[i]
        pixel = rays.pixel[i]
        index = hits.object[i]
        source = int(-1)
        if index < 0:
            radiance[pixel] = radiance[pixel] + wp.cw_mul(weight, environment_radiance(lighting, direction))
        else:
            uv = hits.barycentrics[i]
            point = point_along(rays.origin[i], direction, hits.t[i])
            if uv[0] < 0.0:
                uv = extended_coordinates(objects[index], hits.triangle[i], point)
            surface = surface_at(objects, index, hits.triangle[i], uv[0], uv[1], direction)
            # The ray's own point: a map's hit lies a little off the triangle.
            surface.position = point
            light = direct_radiance(views, objects, lighting, surface)
            if wp.max(surface.mirror) > 0.0:
                onwards = mirror_direction(direction, surface.normal)
                if is_last != 0:
                    light += wp.cw_mul(surface.mirror, environment_radiance(lighting, onwards))
                else:
                    rays.origin[i] = surface.position
                    rays.direction[i] = onwards
                    rays.weight[i] = wp.cw_mul(weight, surface.mirror)
                    source = index
            radiance[pixel] = radiance[pixel] + wp.cw_mul(weight, light)
        rays.source[i] = source

    return shade_hits


@dataclass(frozen=True, eq=False)
class FirstHits:
    """Where the rays of the first reflection end, per pixel of the image; each picture is made when it is asked for."""

    shape: tuple[int, int]
    """(h, w) of the image."""
    rays: Any
    """A ``RayBuffer``: of each ray the pixel."""
    ends: Any
    """The ``HitBuffer`` of the first bounce."""
    device_units_per_world_unit: float

    @functools.cached_property
    def distance(self) -> np.ndarray:
        """(h, w) float32 world units along the ray; +inf on a miss and outside the reflectors."""
        return self._picture(self.ends.t, np.inf) / np.float32(self.device_units_per_world_unit)

    @functools.cached_property
    def object(self) -> np.ndarray:
        """(h, w) int32; -1 on a miss and outside the reflectors."""
        return self._picture(self.ends.object, -1)

    @functools.cached_property
    def triangle(self) -> np.ndarray:
        """(h, w) int32; -1 on a miss and outside the reflectors."""
        return self._picture(self.ends.triangle, -1)

    def _picture(self, values: wp.array, fill: float) -> np.ndarray:
        picture = np.full(self.shape[0] * self.shape[1], fill, values.numpy().dtype)
        picture[self.rays.pixel.numpy()] = values.numpy()
        return picture.reshape(self.shape)


def pixels_in_blocks(mask: np.ndarray) -> np.ndarray:
    """(n,) int32 numbers of the pixels set in an (h, w) bool mask, block by block of ``BLOCK`` x ``BLOCK``."""
    height, width = mask.shape
    padded = np.pad(mask, ((0, -height % BLOCK), (0, -width % BLOCK)))
    # A row of a block is eight bytes: taken for one number it moves as one.
    rows = padded.view(np.uint64).reshape(-1, BLOCK, padded.shape[1] // BLOCK)
    return _pixels_by_place(height, width)[rows.transpose(0, 2, 1).ravel().view(bool)]


@functools.lru_cache(maxsize=4)
def _pixels_by_place(height: int, width: int) -> np.ndarray:
    """The number of the pixel at each place of the blocks; places beyond the image hold any."""
    rows, columns = -(-height // BLOCK), -(-width // BLOCK)
    y, x = np.mgrid[: rows * BLOCK, : columns * BLOCK].astype(np.int32)
    pixels = (y * width + x).reshape(rows, BLOCK, columns, BLOCK)
    return np.ascontiguousarray(pixels.transpose(0, 2, 1, 3)).ravel()


def follow_rays(
    gbuffer: GBuffer,
    rays: Any,
    cull: Callable[[Any, int], Culled],
    bind: Callable[[set[int]], BoundTracer],
    max_bounces: int,
    skips: Skips,
    stats: Stats,
    before: Followed | None = None,
    moved: Set[int] = frozenset(),
) -> tuple[Followed, FirstHits]:
    """Follow the rays of the pixels that see a reflector.

    Args:
        rays: their ``RayBuffer``.
        cull: ``cull(rays, bounce)`` says which objects rays may meet.
        bind: ``bind(objects)`` makes the tracer ready for those.
        before: the last frame's, in the same device space.
        moved: numbers of the objects that have moved since. Rays that are the same and could not meet one of them, nor
            can now, are not followed again.

    Returns:
        what became of them, and where the first rays end.
    """
    scene, device = gbuffer.scene, gbuffer.scene.device
    shadows = bool(scene.lighting.shadows)
    with stats.stage("cull", device):
        culled = cull(rays, 0)
        runs = None
        if before is not None and max_bounces == 1 and not shadows:
            runs = changed_runs(before, rays, culled.regions, moved)
    needed = everything = {entry.index for entry in scene.objects}
    if skips.maps and not shadows:
        needed = culled.shown
    bound, n = bind(needed), rays.pixel.shape[0]
    if before is not None and runs is not None:
        made = before.copied(rays, culled.regions)
        numbers, part, regions = rays_of_runs(made, runs)
        if len(runs):
            hits = _hit_buffer(numbers.shape[0], device)
            _bounce(gbuffer, part, regions, bound, hits, made.radiance, True, skips, stats)
            launch.launch(put_hits, numbers.shape[0], [numbers, hits, made.hits], device)
        stats.count("rays_kept", n - numbers.shape[0])
    else:
        black = wp.zeros(gbuffer.pixel_count, dtype=wp.vec3, device=device)
        made = Followed(rays, culled.regions, _hit_buffer(n, device), black)
        going, hits = _copy_to_send_on(rays, max_bounces > 1), made.hits
        for bounce in range(max_bounces):
            is_last = bounce + 1 == max_bounces
            if not _bounce(gbuffer, going, culled.regions, bound, hits, black, is_last, skips, stats):
                break
            with stats.stage("cull", device):
                culled = cull(going, bounce + 1)
            bound = bind(culled.shown if skips.maps and not shadows else everything)
            hits = _hit_buffer(n, device)
    return made, FirstHits(gbuffer.shape, rays, made.hits, scene.device_units_per_world_unit)


def _copy_to_send_on(rays: Any, beyond_one: bool) -> Any:
    """The rays, to be sent on without changing these."""
    own = RayBuffer()
    own.pixel, own.source = rays.pixel, wp.clone(rays.source)
    own.origin, own.direction, own.weight = rays.origin, rays.direction, rays.weight
    if beyond_one:
        own.origin, own.direction, own.weight = wp.clone(rays.origin), wp.clone(rays.direction), wp.clone(rays.weight)
    return own


def _bounce(
    gbuffer: GBuffer,
    rays: Any,
    regions: Any,
    bound: BoundTracer,
    hits: Any,
    radiance: wp.array,
    is_last: bool,
    skips: Skips,
    stats: Stats,
) -> int:
    """Find where rays end and shade that; the number of rays that go on."""
    scene, device, n = gbuffer.scene, gbuffer.scene.device, rays.pixel.shape[0]
    with stats.stage("march", device):
        inputs = [rays, scene.records, bound.views, regions, hits]
        block = block_of(device)
        launch.launch(closest_hits_kernel(bound.tracer, block, skips.bounds), -(-n // block), inputs, device)
        alive = int(np.count_nonzero(rays.source.numpy() >= 0))
        searches = int(hits.searches.numpy().sum(dtype=np.int64))
        stats.count("rays", alive)
        stats.count("steps", int(hits.steps.numpy().sum(dtype=np.int64)))
        stats.count("searches", searches)
        stats.count("searches_saved", alive * (len(scene.objects) - 1) - searches)
    with stats.stage("shade", device):
        shadow = bound if scene.lighting.shadows else no_shadows(device)
        inputs = [hits, scene.records, scene.lighting, shadow.views, int(is_last), rays, radiance]
        launch.launch(shade_hits_kernel(shadow.tracer), n, inputs, device)
        return 0 if is_last else int(np.count_nonzero(rays.source.numpy() >= 0))


def _hit_buffer(n: int, device: wp.Device) -> Any:
    hits = HitBuffer()
    hits.t = wp.empty(n, dtype=float, device=device)
    hits.object, hits.triangle = (wp.empty(n, dtype=wp.int32, device=device) for _ in range(2))
    hits.steps, hits.searches = (wp.empty(n, dtype=wp.int32, device=device) for _ in range(2))
    hits.barycentrics = wp.empty(n, dtype=wp.vec2, device=device)
    return hits


@dataclass(frozen=True, eq=False)
class Shaded:
    """What a camera sees, but for what reflectors reflect."""

    radiance: wp.array
    """(h * w,) vec3, reflections left out."""
    rays: Any
    """The ``RayBuffer`` of the first reflection: one ray per pixel that sees a reflector, in blocks of pixels."""
    mirror: wp.array
    """(rays,) vec3: the reflector's specular reflectance."""


def shade_gbuffer(gbuffer: GBuffer, shadow: BoundTracer) -> Shaded:
    """Shade every pixel, and start the rays of those that see a reflector."""
    scene, device = gbuffer.scene, gbuffer.scene.device
    radiance = wp.empty(gbuffer.pixel_count, dtype=wp.vec3, device=device)
    inputs = [gbuffer.view, scene.records, scene.lighting, shadow.views]
    launch.launch(shade_pixels_kernel(shadow.tracer), gbuffer.pixel_count, [*inputs, radiance], device)
    pixels = pixels_in_blocks(gbuffer.reflector_mask)
    n = len(pixels)
    rays = RayBuffer()
    rays.pixel = wp.array(pixels, dtype=wp.int32, device=device)
    rays.origin = wp.empty(n, dtype=wp.vec3d, device=device)
    rays.direction, rays.weight, mirror = (wp.empty(n, dtype=wp.vec3, device=device) for _ in range(3))
    rays.source = wp.empty(n, dtype=wp.int32, device=device)
    launch.launch(shade_reflectors_kernel(shadow.tracer), n, [*inputs, rays, radiance, mirror], device)
    return Shaded(radiance, rays, mirror)
