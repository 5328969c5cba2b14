"""Our picture against Mitsuba's paths: which pixels are judged, and how many of them are off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from picture_edges import around, near_edge

from .mirror_paths import MirrorPaths

OFF = 0.02
"""Radiance, in a channel, by which a pixel may differ."""
MOST_OFF = 0.002
"""Share of the judged pixels that may be off, and of the mask that may be unlike all around."""


@dataclass(frozen=True)
class Judgement:
    """A scene's pixels, counted. Those judged see a mirror first, and are neither near an edge nor below a facet."""

    scene: str
    mask: int
    """Pixels that see a mirror first."""
    mirrored_again: int
    """Of the mask, those that see a mirror in the mirror."""
    below_facet: int
    """Of the mask, those whose shading normal sends a ray below its triangle."""
    off_below_facet: int
    """Of these, those that are off."""
    near_edge: int
    """Of the others, those within a pixel of an edge."""
    off_anywhere: int
    """Of the mask, those that are off."""
    unlike_all_around: int
    """Of the mask but those below a facet, those that are off from each of the 3 x 3 pixels around: no edge that lies a
    pixel aside tells why."""
    judged: int
    off: int
    """Of those judged, those that are off."""
    off_by_spawn_ray: int
    """The same, where Mitsuba starts rays at its own distance from surfaces."""
    path_differs: float
    """The largest difference between Mitsuba's ``path`` integrator and our loop over its paths."""

    @property
    def passed(self) -> bool:
        """Whether the picture is Mitsuba's."""
        few = self.off <= MOST_OFF * self.judged and self.unlike_all_around <= MOST_OFF * self.mask
        return self.judged > 0 and few


def is_off(picture: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(h, w) bool: pixels of an (h, w, 3) picture that differ from the true one; what is not finite does."""
    with np.errstate(invalid="ignore"):
        return ~(np.abs(picture - truth) <= OFF).all(axis=-1)


def judgement(
    scene: str, picture: np.ndarray, paths: MirrorPaths, spawned: MirrorPaths, by_path: np.ndarray
) -> Judgement:
    """Count a scene's pixels.

    Args:
        scene: its name.
        picture: ours, (h, w, 3).
        paths: Mitsuba's, their rays starting close to surfaces.
        spawned: those that start where Mitsuba lets them.
        by_path: the picture by Mitsuba's own integrator, (h, w, 3).
    """
    mask, truth = paths.mirrors >= 1, paths.radiance + paths.beyond
    off = is_off(picture, truth)
    is_below = mask & paths.leaves_below
    is_near = mask & ~is_below & near_edge(paths.surfaces)
    judged = mask & ~is_below & ~is_near
    is_unlike = mask & ~is_below & np.all([is_off(picture, moved) for moved in around(truth)], axis=0)

    def count(pixels: np.ndarray) -> int:
        return int(np.count_nonzero(pixels))

    return Judgement(
        scene=scene,
        mask=count(mask),
        mirrored_again=count(paths.mirrors >= 2),
        below_facet=count(is_below),
        off_below_facet=count(is_below & off),
        near_edge=count(is_near),
        off_anywhere=count(mask & off),
        unlike_all_around=count(is_unlike),
        judged=count(judged),
        off=count(judged & off),
        off_by_spawn_ray=count(judged & is_off(picture, spawned.radiance + spawned.beyond)),
        path_differs=float(np.abs(by_path - spawned.radiance).max()),
    )
