"""How far an image is from the truth: masked image metrics, and errors of the hits behind them.

Image metrics take linear radiance ``(h, w, 3)`` and a mask ``(h, w)``, and average over the mask. SSIM, PSNR and FLIP
are taken of what is shown: sRGB, clipped to 0..1.
"""

from __future__ import annotations

from dataclasses import dataclass

import flip_evaluator
import numpy as np
from skimage.metrics import structural_similarity

from ldtrefl.files.srgb import srgb_from_linear
from ldtrefl.frame.first_hits import FirstHits
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.tracing.ray_buffers import distance_across

SSIM_WINDOW = 11
"""Pixels along a side of SSIM's Gaussian window (sigma 1.5; Wang et al. 2004)."""

RELMSE_FLOOR = 1e-2
"""Added to the squared reference in relMSE, so that black pixels do not divide by zero."""


def ssim(image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> float:
    """Structural similarity (Wang et al. 2004), averaged over the mask; 1 is equal. NaN for an empty mask."""
    if not mask.any():
        return float("nan")
    short = [max(0, SSIM_WINDOW - side) for side in mask.shape]
    padding = ((0, short[0]), (0, short[1]), (0, 0))
    shown, truth = (np.pad(srgb_from_linear(x), padding, mode="edge") for x in (image, reference))
    _, values = structural_similarity(
        truth,
        shown,
        channel_axis=2,
        data_range=1.0,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        full=True,
    )
    return float(values[: mask.shape[0], : mask.shape[1]].mean(axis=2)[mask].mean())


def psnr(image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> float:
    """Peak signal-to-noise ratio in dB; infinite if equal, NaN for an empty mask."""
    if not mask.any():
        return float("nan")
    error = float(((srgb_from_linear(image) - srgb_from_linear(reference))[mask].astype(float) ** 2).mean())
    return float("inf") if error == 0.0 else -10.0 * float(np.log10(error))


def flip(image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> float:
    """LDR-FLIP (Andersson et al. 2020) at 67 pixels per degree, averaged over the mask; 0 is equal."""
    if not mask.any():
        return float("nan")
    shown, truth = srgb_from_linear(image), srgb_from_linear(reference)
    errors, _, _ = flip_evaluator.evaluate(truth, shown, "LDR", applyMagma=False, computeMeanError=False)
    return float(np.asarray(errors).reshape(mask.shape)[mask].mean())


def relmse(image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> float:
    """Relative mean squared error of linear radiance (Rousselle et al. 2011)."""
    if not mask.any():
        return float("nan")
    a, b = image[mask].astype(float), reference[mask].astype(float)
    return float(((a - b) ** 2 / (b**2 + RELMSE_FLOOR)).mean())


@dataclass(frozen=True)
class HitErrors:
    """How a method's first hits differ from the truth's."""

    wrong_hits: float
    """Rays that hit something where the truth hits nothing, in percent of true hits."""
    wrong_misses: float
    """Rays that hit nothing where the truth hits, in percent of true hits."""
    wrong_objects: float
    """Rays that hit another object than the truth's, in percent of true hits."""
    median: float
    """Median distance error along the ray where both hit, whatever they hit, in texels of the truth's object. A
    distance that is no number counts as infinite."""
    p99: float
    """99th percentile of the same."""


def hit_errors(hits: FirstHits, truth: FirstHits, texel_sizes: np.ndarray, mask: np.ndarray) -> HitErrors:
    """Compare first hits on the mask; ``texel_sizes`` (objects,) is the length of a texel of each object in the world.

    Where the truth hits nothing at all, any hit makes infinitely many wrong ones.
    """
    hit, true_hit = (hits.object >= 0) & mask, (truth.object >= 0) & mask
    true_hits = int(true_hit.sum())
    if true_hits == 0:
        wrong = 0.0 if not hit.any() else float("inf")
        return HitErrors(wrong, 0.0, 0.0, float("nan"), float("nan"))
    both = hit & true_hit
    errors = np.abs(hits.distance[both].astype(float) - truth.distance[both]) / texel_sizes[truth.object[both]]
    errors[np.isnan(errors)] = np.inf
    # Nearest ranks: between a number and infinity there is nothing to interpolate.
    median, p99 = np.percentile(errors, [50, 99], method="inverted_cdf") if errors.size else (np.nan, np.nan)
    return HitErrors(
        100.0 * float((hit & ~true_hit).sum()) / true_hits,
        100.0 * float((true_hit & ~hit).sum()) / true_hits,
        100.0 * float((hits.object != truth.object)[both].sum()) / true_hits,
        float(median),
        float(p99),
    )


def reprojection_errors(hits: FirstHits, truth: FirstHits, gbuffer: GBuffer) -> np.ndarray:
    """(n,) how many pixels away a point is seen from where it should be, for rays that both end on an object.

    A hit in front of the surface or behind it shows what lies beside the true point: sideways to the ray by the
    distance along it times sine and cosine of its angle with the surface. Compared with the distance between
    neighbouring pixels' rays there, the geometric mean of the one to the right and the one below.

    Left out are rays whose right or lower neighbour sees another mirror or none, and those of the last row and column:
    they have no such distance. A ray that ends on another object than the truth's is measured like any other, by how
    far along the ray it is off; ``hit_errors`` counts it. A distance that is no number counts as infinite, and so does
    any error where neighbouring rays meet in one point.
    """
    scene, shape = gbuffer.scene, truth.shape
    pixel = truth.rays.pixel.numpy()
    origin, direction = (np.full((*shape, 3), np.nan) for _ in range(2))
    source = np.full(shape, -1)
    at = np.unravel_index(pixel, shape)
    origin[at], direction[at] = truth.rays.origin.numpy(), truth.rays.direction.numpy()
    source[at] = truth.rays.source.numpy()
    both = (hits.object >= 0) & (truth.object >= 0)
    both[:, -1] = both[-1] = False
    both[:-1, :-1] &= (source[:-1, :-1] == source[:-1, 1:]) & (source[:-1, :-1] == source[1:, :-1])
    y, x = np.nonzero(both)  # with both neighbours on the same mirror
    o, d = origin[y, x], direction[y, x]
    t = truth.distance[y, x].astype(float) * scene.device_units_per_world_unit
    footprint = np.ones(len(y))
    for dy, dx in ((0, 1), (1, 0)):
        beside = origin[y + dy, x + dx], direction[y + dy, x + dx]
        footprint *= np.sqrt(distance_across(o, d, *beside, t))
    errors = np.abs(hits.distance[y, x].astype(float) - truth.distance[y, x]) * scene.device_units_per_world_unit
    index, triangle = truth.object[y, x], truth.triangle[y, x]
    for entry in scene.objects:
        here = index == entry.index
        corners = entry.geometry.mesh.unit_vertices[entry.geometry.mesh.faces[triangle[here]]].astype(float)
        a, b, c = np.moveaxis(corners @ (scene.device_from_world @ entry.world_from_unit)[:3, :3].T, 1, 0)
        normal = np.cross(b - a, c - a)
        length = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
        cosine = np.clip(np.abs((normal * d[here]).sum(axis=1)) / length, 0.0, 1.0)
        errors[here] *= cosine * np.sqrt(1.0 - cosine**2)
    errors[np.isnan(errors)] = np.inf
    # Where neighbouring rays meet, no error is none, and any is without measure.
    return np.divide(errors, footprint, out=np.where(errors > 0.0, np.inf, 0.0), where=footprint > 0.0)
