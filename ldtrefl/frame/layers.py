"""The layers of a picture: what it is composed of, and what is seen where, each as an array of its own.

    beauty         (h, w, 3)  the image: ``direct`` and all reflections, which add up to it
    alpha          (h, w)     the share of a pixel that objects cover
    direct         (h, w, 3)  emitted and scattered light, and the environment behind all objects
    reflection_1   (h, w, 3)  what reaches the camera by way of one mirror;
    reflection_2   (h, w, 3)  of two mirrors, one after another; and so on, as far as any ray has gone
    depth          (h, w)     along the camera's axis, in the world's units; +inf where nothing is seen
    normal         (h, w, 3)  shading normal in the world, facing the viewer; 0 where nothing is seen
    albedo         (h, w, 3)  the share of light that surfaces scatter; of a mirror 0
    object_id      (h, w)     the number of the object that is seen; -1 where none is
    hit_distance   (h, w)     from a mirror to what it shows; +inf where it shows nothing, or the method has no rays

All are float32. ``beauty``, ``alpha``, ``direct`` and the reflections are means of all samples of a pixel, filtered
alike; the others are of the pixels' centres. A surface that lets light through counts as one that mirrors it straight
on. Where a ray ends at a mirror, the environment that stands for what would follow is counted with the mirrors before.

A *cutout* leaves out what lies behind all objects, also where it is seen through some (``see_through.py``).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ldtrefl.base import budget
from ldtrefl.frame.bounces import summed_by_pixel
from ldtrefl.frame.composite import composed, reflected_to_camera
from ldtrefl.frame.history import FrameParts
from ldtrefl.frame.see_through import SeenThrough
from ldtrefl.frame.seen_surfaces import SeenSurfaces

Layers = dict[str, np.ndarray]

REFLECTION = "reflection_"
"""What the names of reflections begin with; then comes the number of mirrors."""

SMALLER = "camera.width or camera.height"
"""What an error names for the user to make smaller."""


LEFT_OUT = np.float32(4.0)
"""Radiance that stands for what a cutout leaves out where samples are chosen: what it will be put before is not known.
Little is as bright, and what is darker or much brighter differs from it by the measure of ``contrast.py``."""


def coverage(objects: np.ndarray) -> np.ndarray:
    """float32: 1 where the number of an object is seen, 0 where none is."""
    return (objects >= 0).astype(np.float32)


def light_of(parts: FrameParts, most: int, *, cutout: bool) -> Layers:
    """(pixels, 3) float32 of one G-buffer and the rays that leave it: ``beauty``, ``direct``, ``most`` reflections, and
    ``alpha`` in three channels. Samples are chosen by ``beauty``, which of a cutout serves that alone."""
    through, covered = SeenThrough.of(parts), coverage(parts.gbuffer.objects)
    direct, mirrored = parts.shaded.radiance.numpy().reshape(*parts.gbuffer.shape, 3), reflections(parts)
    beauty, alpha = composed(parts).numpy().reshape(*parts.gbuffer.shape, 3), (covered - through.share)[..., None]
    if cutout:
        beauty = np.where(alpha > 0.5, beauty, LEFT_OUT)
        direct = direct * covered[..., None]
        for picture, is_behind in zip(mirrored, through.bounces, strict=False):
            picture[is_behind] = 0.0
    made = {"beauty": beauty, "alpha": np.repeat(alpha, 3, axis=2), "direct": direct}
    nothing = np.zeros((parts.gbuffer.pixel_count, 3), np.float32)
    made |= {f"{REFLECTION}{number}": nothing for number in range(1, most + 1)}
    made |= {f"{REFLECTION}{number}": picture for number, picture in enumerate(mirrored, 1)}
    return {name: picture.reshape(-1, 3) for name, picture in made.items()}


def reflections(parts: FrameParts) -> list[np.ndarray]:
    """(h, w, 3) float32 radiance that reaches the camera by way of one mirror, of two, and so on."""
    pixels, followed = parts.gbuffer.reflector_pixels, parts.reflected.followed
    brought = [parts.reflected.radiance]
    if followed is not None and followed.kept:
        brought = [summed_by_pixel(pixels, followed.rays, bounce.brought) for bounce in followed.kept]
    so_far = [reflected_to_camera(parts, radiance) for radiance in brought]
    return [so_far[0], *(after - before for before, after in itertools.pairwise(so_far))]


@dataclass(frozen=True, eq=False)
class LightBand:
    """The light of a band of an image, all samples of its pixels together."""

    parts: FrameParts
    """The band, sampled at its pixels' centres."""
    rows: slice
    """Of the image."""
    within: slice
    """The same rows in the band."""
    light: Layers
    """As :func:`light_of` gives it, but for the band's pixels filtered."""

    def in_rows(self, layer: np.ndarray) -> np.ndarray:
        """What is in these rows of a layer of the band."""
        return layer.reshape(*self.parts.gbuffer.shape, *layer.shape[1:])[self.within]

    def pictures(self, *, cutout: bool) -> Layers:
        """Its light in these rows: (rows, w, 3), and ``alpha`` (rows, w)."""
        made = {name: self.in_rows(layer) for name, layer in self.light.items()}
        if cutout:
            made["beauty"] = sum((made[name] for name in made if name.startswith(REFLECTION)), made["direct"])
        return made | {"alpha": made["alpha"][..., 0]}

    def of_centres(self) -> Layers:
        """The layers that are of the pixels' centres, in these rows."""
        gbuffer, seen, hits = self.parts.gbuffer, SeenSurfaces.of(self.parts.gbuffer), self.parts.reflected.hits
        distance = np.full(gbuffer.shape, np.inf, np.float32) if hits is None else hits.distance
        made = {"depth": seen.depth, "normal": seen.normal, "albedo": seen.albedo}
        made |= {"object_id": gbuffer.objects.astype(np.float32), "hit_distance": distance}
        return {name: layer[self.within] for name, layer in made.items()}


def joined_layers(image: np.ndarray, bands: Iterable[LightBand], *, cutout: bool) -> Layers:
    """All layers of an image, from those of its bands in any order.

    Raises:
        InputError: they need more memory than is allowed.
    """
    height, width = image.shape[:2]
    made: Layers = {}
    with budget.given_back():
        for band in bands:
            for name, layer in (band.pictures(cutout=cutout) | band.of_centres()).items():
                if name not in made:
                    whole = (height, *layer.shape[1:])
                    budget.take(4 * int(np.prod(whole)), f"the layer {name} of {width} x {height} pixels", SMALLER)
                    made[name] = np.zeros(whole, np.float32)
                made[name][band.rows] = layer
    if not cutout:
        made["beauty"] = image.copy()
    used = [name for name in made if not name.startswith(REFLECTION) or made[name].any()]
    number_of = [int(name.removeprefix(REFLECTION)) for name in used if name.startswith(REFLECTION)]
    names = {*used, *(f"{REFLECTION}{number}" for number in range(1, max(number_of, default=1) + 1))}
    return {name: made[name] for name in sorted(names, key=_place)}


def joined_cutout(shape: tuple[int, int], bands: Iterable[LightBand]) -> np.ndarray:
    """(h, w, 4) float32 cutout of an image and its alpha, from those of its bands in any order.

    Raises:
        InputError: it needs more memory than is allowed.
    """
    height, width = shape
    budget.take(16 * height * width, f"a cutout of {width} x {height} pixels", SMALLER)
    made = np.empty((height, width, 4), np.float32)
    for band in bands:
        pictures = band.pictures(cutout=True)
        made[band.rows] = np.concatenate([pictures["beauty"], pictures["alpha"][..., None]], axis=2)
    return made


ORDER = ("beauty", "alpha", "direct", REFLECTION, "depth", "normal", "albedo", "object_id", "hit_distance")
"""Layers as they are listed."""


def _place(name: str) -> tuple[int, int]:
    """Where a layer is listed."""
    kind, _, number = name.rpartition("_")
    if f"{kind}_" == REFLECTION:
        return ORDER.index(REFLECTION), int(number)
    return ORDER.index(name), 0
