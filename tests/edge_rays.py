"""Rays beside edges and vertices and what may be answered to them, made once for all tests that use them."""

import functools

from stress_cases import edges
from stress_cases.edge_truth import Right

RAYS = 1000
"""Of each of seven kinds at each mesh: some 50,000 in all."""

SMALL = [name for name in edges.made() if "rod" not in name]
ROD = "rod of triangles 10,000 : 1"
"""Meshes of ``edges.made``."""


@functools.cache
def rays_at(name: str) -> list[tuple[str, edges.Rays, Right]]:
    """The rays at a mesh of ``edges.made`` and what they may be answered."""
    return list(edges.rays_at(edges.made()[name], RAYS))
