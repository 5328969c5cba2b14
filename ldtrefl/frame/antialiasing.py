"""Antialiasing: more samples where the image needs them, and their mean by a filter.

An image is first made with a sample at each pixel's centre. Pixels that differ from a neighbour (``contrast.py``) are
sampled at more places (``sample_pattern.py``); of many samples the first few are taken first, and the others only where
those differ. A pixel that is sampled once counts as though all its samples were alike. The filter then blends each
sample into the pixels about it. Where no pixel is sampled more than once that is a blend of nine pixels, made for as
many at once as a vector has lanes, in C++ (``smooth.h``).

The order of all sums is fixed, so no bit depends on the number of threads.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.native_sources import native_body
from ldtrefl.frame.contrast import groups_of_contrast, pixels_of_contrast
from ldtrefl.frame.history import Antialiased, FrameParts
from ldtrefl.frame.pixel_order import pixels_in_blocks
from ldtrefl.frame.sample_pattern import Level, levels, places

TOGETHER = 1 << 18
"""Samples that are traced together: enough for all threads, and their rays take less than 0.1 GB."""

BEYOND = 2
"""Rows beyond a band that its antialiasing looks at: the next one's samples, and what those are chosen by."""

NEIGHBOURS = wp.constant(9)
"""Pixels that a sample counts in."""

FILES = ("device/vectors.h", "frame/smooth.h")
BLEND = """
const int begin = y * width + 1;
Smooth::blend(&centre.data[begin][0], 3 * width, 3 * (width - 2), weights.data, &image_out.data[begin][0]);
"""

RadianceAt = Callable[[wp.array], wp.array]
"""(n,) vec2d points of a band in its pixels -> (n,) vec3 the radiance seen there."""

Pictures = Mapping[str, wp.array]
"""Pictures of a band that are sampled alike, by name: (pixels,) or (points,) vec3. The first says where samples are
needed."""

PicturesAt = Callable[[wp.array], Pictures]
"""(n,) vec2d points of a band in its pixels -> the same pictures there."""


@dataclass(frozen=True)
class Sampling:
    """How often pixels are sampled."""

    samples: int
    """The most of a pixel."""
    adaptive: bool
    """Whether pixels that do not differ from their neighbours are sampled once."""


@launch.kernel
def place_samples(
    first: int,
    # In:
    pixels: wp.array(dtype=wp.int32),
    width: int,
    offsets: wp.array(dtype=wp.vec2d),
    # Out:
    place_out: wp.array(dtype=wp.vec2d),
):
    """Place the samples of one pixel."""
    i, count = first + wp.tid(), offsets.shape[0]
    half, pixel = wp.float64(0.5), pixels[i]
    centre = wp.vec2d(wp.float64(pixel % width) + half, wp.float64(pixel / width) + half)
    for k in range(count):
        place_out[count * i + k] = centre + offsets[k]


@launch.kernel
def weigh_samples(
    first: int,
    # In:
    pixels: wp.array(dtype=wp.int32),
    numbers: wp.array(dtype=wp.int32),  # of these pixels among all that are sampled more than once
    centre: wp.array(dtype=wp.vec3),  # radiance of every pixel's first sample
    few: wp.array(dtype=wp.vec3),  # of the next samples, in a row for each that is sampled more than once
    many: wp.array(dtype=wp.vec3),  # of the last ones, in a row for each of these pixels
    weights: wp.array(dtype=float),
    # Out: NEIGHBOURS for each pixel that is sampled more than once
    shares_out: wp.array(dtype=wp.vec3),
):
    """Sum up what the samples of one pixel count in each of the pixels about it."""
    i, samples = first + wp.tid(), weights.shape[0] / NEIGHBOURS
    number, later = numbers[i], many.shape[0] / pixels.shape[0]
    soon = samples - 1 - later
    for neighbour in range(NEIGHBOURS):
        row = neighbour * samples
        share = weights[row] * centre[pixels[i]]
        for k in range(soon):
            share += weights[row + 1 + k] * few[number * soon + k]
        for k in range(later):
            share += weights[row + 1 + soon + k] * many[i * later + k]
        shares_out[number * NEIGHBOURS + neighbour] = share


@launch.kernel
def filter_pixels(
    first: int,
    # In:
    pixels: wp.array(dtype=wp.int32),
    width: int,
    number_of: wp.array(dtype=wp.int32),  # of each pixel among those that are sampled more than once, -1 of others
    centre: wp.array(dtype=wp.vec3),
    shares: wp.array(dtype=wp.vec3),
    weights: wp.array(dtype=float),  # of a whole pixel, by neighbour
    # Out: of these pixels
    radiance_out: wp.array(dtype=wp.vec3),
):
    """Sum up what the samples of all pixels about one count in it."""
    pixel, height = pixels[first + wp.tid()], centre.shape[0] / width
    x, y = pixel % width, pixel / width
    total, weight = wp.vec3(0.0), float(0.0)
    for neighbour in range(NEIGHBOURS):
        other_x, other_y = x + neighbour % 3 - 1, y + neighbour / 3 - 1
        if other_x >= 0 and other_x < width and other_y >= 0 and other_y < height:
            other = other_y * width + other_x
            if number_of[other] >= 0:
                total += shares[number_of[other] * NEIGHBOURS + neighbour]
            else:
                total += weights[neighbour] * centre[other]
            weight += weights[neighbour]
    radiance_out[first + wp.tid()] = total / weight


@wp.func_native(native_body({}, FILES, BLEND))
def blend_row(
    centre: wp.array(dtype=wp.vec3),
    width: int,
    y: int,
    weights: wp.array(dtype=float),
    image_out: wp.array(dtype=wp.vec3),
):
    """Blend the pixels of a row that have neighbours on all sides."""
    ...


@launch.kernel
def blend_pixels(
    first: int,
    # In:
    width: int,
    centre: wp.array(dtype=wp.vec3),
    weights: wp.array(dtype=float),  # of a whole pixel, by neighbour
    # Out:
    image_out: wp.array(dtype=wp.vec3),
):
    """Blend each pixel of one row with its neighbours, but for those at the image's border."""
    y = first + wp.tid()
    if y > 0 and (y + 2) * width <= centre.shape[0] and width > 2:
        blend_row(centre, width, y, weights, image_out)


@launch.kernel
def put_pixels(
    first: int,
    # In:
    pixels: wp.array(dtype=wp.int32),
    radiance: wp.array(dtype=wp.vec3),
    # Out:
    image_out: wp.array(dtype=wp.vec3),
):
    """Write the radiance of one of these pixels into the image."""
    image_out[pixels[first + wp.tid()]] = radiance[first + wp.tid()]


class _Samples:
    """The samples of a band's pixels."""

    def __init__(self, sampling: Sampling, shape: tuple[int, int], centre: Pictures, pictures_at: PicturesAt) -> None:
        self._chosen_by = next(iter(centre))
        self._levels = levels(sampling.samples)
        self._offsets = places(sampling.samples)
        self._adaptive = sampling.adaptive
        self._width, self._device = shape[1], centre[self._chosen_by].device
        self._centre, self._pictures_at = centre, pictures_at

    def shares(self, pixels: np.ndarray, counts: np.ndarray) -> Pictures:
        """(m * NEIGHBOURS,) vec3 of each picture: what (m,) ``pixels`` count in those about them. ``counts``, (all
        pixels,), is filled in where they are sampled."""
        size = len(pixels) * int(NEIGHBOURS)
        shares = {name: wp.empty(size, dtype=wp.vec3, device=self._device) for name in self._centre}
        at_once = max(1, TOGETHER // self._levels[-1].samples)
        for begin in range(0, len(pixels), at_once):
            part = pixels[begin : begin + at_once]
            of_part = slice(begin * int(NEIGHBOURS), (begin + len(part)) * int(NEIGHBOURS))
            self._sample(part, counts, {name: array[of_part] for name, array in shares.items()})
        return shares

    def _sample(self, pixels: np.ndarray, counts: np.ndarray, shares: Pictures) -> None:
        """Sample pixels at the second level, and those that need it at the last."""
        first, last = self._levels[1], self._levels[-1]
        if not self._adaptive:
            first = last
        every = np.arange(len(pixels))
        few = self._traced(pixels, 1, first.samples)
        nothing = dict.fromkeys(self._centre, wp.empty(0, dtype=wp.vec3, device=self._device))
        counts[pixels] = first.samples
        self._weigh(pixels, every, few, nothing, first, shares)
        if first is not last:
            varied = groups_of_contrast(few[self._chosen_by], first.samples - 1)
            if len(varied):
                counts[pixels[varied]] = last.samples
                many = self._traced(pixels[varied], first.samples, last.samples)
                self._weigh(pixels[varied], varied, few, many, last, shares)

    def _traced(self, pixels: np.ndarray, begin: int, end: int) -> Pictures:
        """(m * (end - begin),) vec3 of each picture: the samples from ``begin`` to ``end`` of (m,) pixels."""
        offsets = wp.array(self._offsets[begin:end], dtype=wp.vec2d, device=self._device)
        place = wp.empty(len(pixels) * (end - begin), dtype=wp.vec2d, device=self._device)
        launch.launch(place_samples, len(pixels), [self._on_device(pixels), self._width, offsets, place], self._device)
        return self._pictures_at(place)

    def _weigh(
        self, pixels: np.ndarray, numbers: np.ndarray, few: Pictures, many: Pictures, level: Level, shares: Pictures
    ) -> None:
        weights = wp.array(level.weights.ravel(), dtype=float, device=self._device)
        places = [self._on_device(pixels), self._on_device(numbers)]
        for name, centre in self._centre.items():
            inputs = [*places, centre, few[name], many[name], weights, shares[name]]
            launch.launch(weigh_samples, len(pixels), inputs, self._device)

    def _on_device(self, numbers: np.ndarray) -> wp.array:
        return wp.array(numbers.astype(np.int32), dtype=wp.int32, device=self._device)


def _filtered_apart(pixels: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """(n,) int32: these pixels, all that touch one of them, and those at the image's border, block by block."""
    inner = np.zeros(shape[0] * shape[1], bool)
    inner[pixels] = True
    mask = np.pad(inner.reshape(shape), 1)
    rows = mask[:-2] | mask[1:-1] | mask[2:]
    apart = np.ascontiguousarray(rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:])
    apart[0] = apart[-1] = apart[:, 0] = apart[:, -1] = True
    return pixels_in_blocks(apart)


def antialiased(parts: FrameParts, centre: wp.array, sampling: Sampling, radiance_at: RadianceAt) -> Antialiased:
    """The pixels of a band that more samples change.

    Args:
        parts: the band, sampled at the centres of its pixels.
        centre: (pixels,) vec3, its radiance.
        sampling: more than one sample.
        radiance_at: traces more samples.
    """
    of_image = antialiased_alike(parts, {"": centre}, sampling, lambda place: {"": radiance_at(place)})
    return of_image[""]


def antialiased_alike(
    parts: FrameParts, centres: Pictures, sampling: Sampling, pictures_at: PicturesAt
) -> dict[str, Antialiased]:
    """The same of several pictures of a band, all sampled where the first needs it."""
    gbuffer, centre = parts.gbuffer, next(iter(centres.values()))
    device, shape = centre.device, gbuffer.shape
    counts = np.ones(gbuffer.pixel_count, np.uint16)
    if sampling.adaptive:
        pixels = pixels_of_contrast(gbuffer, parts.reflected.hits, centre, sampling.samples)
    else:
        pixels = pixels_in_blocks(np.ones(shape, bool))
    shares = _Samples(sampling, shape, centres, pictures_at).shares(pixels, counts)
    number_of = np.full(gbuffer.pixel_count, -1, np.int32)
    number_of[pixels] = np.arange(len(pixels), dtype=np.int32)
    apart = wp.array(_filtered_apart(pixels, shape), dtype=wp.int32, device=device)
    numbers = wp.array(number_of, dtype=wp.int32, device=device)
    made = {}
    for name, picture in centres.items():
        radiance = wp.empty(apart.shape[0], dtype=wp.vec3, device=device)
        inputs = [apart, shape[1], numbers, picture, shares[name], _weights(sampling, device), radiance]
        launch.launch(filter_pixels, apart.shape[0], inputs, device)
        made[name] = Antialiased(apart, radiance, counts.reshape(shape))
    return made


def filtered(found: Antialiased, centre: wp.array, sampling: Sampling) -> wp.array:
    """(pixels,) vec3: the whole image, from what was found of it and its radiance at the pixels' centres."""
    height, width = found.counts.shape
    image, device = wp.empty_like(centre), centre.device
    launch.launch(blend_pixels, height, [width, centre, _weights(sampling, device), image], device)
    launch.launch(put_pixels, found.pixels.shape[0], [found.pixels, found.radiance, image], device)
    return image


def _weights(sampling: Sampling, device: wp.Device) -> wp.array:
    """(NEIGHBOURS,) float: of a pixel that is sampled once."""
    return wp.array(levels(sampling.samples)[0].weights.ravel(), dtype=float, device=device)
