"""Rays against a dense mesh and about any, and how the exact search differs from the ray caster."""

import numpy as np
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.ldt.texture import LayeredDepthTexture

DENSE_KNOT = {"segments": [2000, 125]}
"""A torus knot of 500,000 triangles, which patches stand for."""


def differences(mesh: ldtrefl.Mesh, maps: LayeredDepthTexture, count: int, seed: int) -> dict[str, float]:
    """How ``count`` random rays differ from the ray caster's.

    Wrong hits and misses are in percent of true hits, the same triangle in percent of common hits; the 99th and 99.9th
    percentile of the distance are in texels of 128.
    """
    origins, directions = rays_about(mesh, count, seed)
    hits = maps.trace(origins, directions)
    truth = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, directions)
    hit, true_hit = hits.triangle >= 0, truth.triangle >= 0
    both = hit & true_hit
    texel = (mesh.bounds[1] - mesh.bounds[0]).max() / 128
    return {
        "wrong_hits": 100.0 * (hit & ~true_hit).sum() / true_hit.sum(),
        "wrong_misses": 100.0 * (true_hit & ~hit).sum() / true_hit.sum(),
        "same": 100.0 * (hits.triangle == truth.triangle)[both].mean(),
        "p99": float(np.percentile(np.abs(hits.t[both] - truth.t[both]), 99)) / texel,
        "p999": float(np.percentile(np.abs(hits.t[both] - truth.t[both]), 99.9)) / texel,
    }


def rays_from_outside(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from a sphere about the unit cube through it."""
    rng = np.random.default_rng(seed)
    origins = rng.normal(size=(count, 3))
    origins *= 3 / np.linalg.norm(origins, axis=1, keepdims=True)
    return origins.astype(np.float32), (rng.uniform(-1, 1, (count, 3)) - origins).astype(np.float32)
