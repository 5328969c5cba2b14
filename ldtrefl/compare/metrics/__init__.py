"""Metrics: how far a frame is from the true one. They are found by scanning this folder: delete a file and its metrics
are gone.

Image metrics take linear radiance ``(h, w, 3)`` and a mask ``(h, w)``, and average over the mask. SSIM, PSNR and FLIP
are taken of what is shown: sRGB, clipped to 0..1. Metrics of hits compare where the first reflected rays end.

Imports ``files``, ``tracing`` and ``frame``. Start with ``base.py``, the contract. The names below are for calling
metrics directly; a metric need not be among them.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil

from ldtrefl.compare.metrics.base import Metric
from ldtrefl.compare.metrics.flip_error import flip
from ldtrefl.compare.metrics.hits import HitErrors, hit_errors
from ldtrefl.compare.metrics.reprojection import reprojection_errors
from ldtrefl.compare.metrics.signal_to_noise import psnr
from ldtrefl.compare.metrics.squared_error import relmse
from ldtrefl.compare.metrics.structural_similarity import ssim

__all__ = ["HitErrors", "all_metrics", "flip", "hit_errors", "psnr", "relmse", "reprojection_errors", "ssim"]


@functools.cache
def all_metrics() -> tuple[Metric[...], ...]:
    """Every metric, in the order of the table's columns."""
    modules = [importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    found = {value.name: value for module in modules for value in vars(module).values() if isinstance(value, Metric)}
    return tuple(sorted(found.values(), key=lambda metric: (metric.place, metric.name)))
