"""Pictures with triangles in pieces, and the holes in them."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

import ldtrefl
from ldtrefl.compare import metrics
from ldtrefl.frame.result import Frame
from ldtrefl.scene.description import Scene

from .scenes import paper_scene

FARTHER = 1.01
"""A pixel shows what is behind a hole if what it shows is so many times as far as what it ought to show."""


@dataclass(frozen=True)
class Picture:
    """What a picture comes to."""

    ssim: float
    """Over the mirrors, against one reflection by the ray caster."""
    vertices: int
    """That were searched for."""
    milliseconds: float
    """Of placing and drawing them, once."""
    holes: int
    """Pixels."""


@functools.cache
def _scene_and_truth(name: str, quick: bool) -> tuple[Scene, Frame]:
    scene = paper_scene(name, quick)
    ldtrefl.render(scene, "tessellation", samples=1, levels=1)  # compiles what is timed
    return scene, ldtrefl.render(scene, "bvh", samples=1, max_bounces=1)


@functools.cache
def picture(name: str, quick: bool, threshold: float, levels: int, crack_free: bool = False) -> Picture:
    """A scene of ``scenes/`` by ``tessellation``."""
    scene, truth = _scene_and_truth(name, quick)
    frame = ldtrefl.render(scene, "tessellation", samples=1, threshold=threshold, levels=levels, crack_free=crack_free)
    ssim = metrics.ssim(frame.image, truth.image, truth.reflector_mask)
    seconds = frame.stats.seconds["virtual"]
    return Picture(ssim, frame.stats.counters["vertices"], 1000.0 * seconds, holes(frame, truth))


def holes(frame: Frame, truth: Frame) -> int:
    """Pixels of a mirror that show what is behind an object in its place, while on both sides it is shown."""
    assert frame.hits is not None and truth.hits is not None
    found, right = frame.hits.object, truth.hits.object
    around = np.pad(found, 1, constant_values=-1)
    beside = (around[1:-1, :-2] == right) & (around[1:-1, 2:] == right)
    beside |= (around[:-2, 1:-1] == right) & (around[2:, 1:-1] == right)
    is_behind = (found < 0) | (frame.hits.distance > FARTHER * truth.hits.distance)
    return int(((right >= 0) & (found != right) & beside & is_behind).sum())
