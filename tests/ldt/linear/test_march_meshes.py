"""The paper's search on every shape and real mesh, against the ray caster."""

from collections.abc import Callable

import numpy as np
import pytest
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.scene import shapes
from tests.conftest import REAL_MESHES

SHAPES = tuple(name for name in shapes.names())

# Wrong hits and wrong misses allowed to the paper's search at 256 with 512 samples, in percent of true hits. Wires are
# thinner than a texel, where a block of a texel is no approximation at all.
LIMITS = dict.fromkeys([*SHAPES, *REAL_MESHES], (2.5, 0.1)) | {"wires": (25.0, 1.0)}

# The same with one sample for each texel passed: the dish's wall is a texel thick, and some rays step over it.
LIMITS_BY_TEXEL = LIMITS | {"dish_with_olives.glb": (2.5, 0.6)}


@pytest.mark.parametrize(("linear_steps", "limits"), [(512, LIMITS), ("texel", LIMITS_BY_TEXEL)])
@pytest.mark.parametrize("name", [*SHAPES, *REAL_MESHES])
def test_linear_search_agrees_with_the_raycaster(
    mesh_or_shape: Callable, name: str, linear_steps: int | str, limits: dict[str, tuple[float, float]]
) -> None:
    mesh = mesh_or_shape(name)
    origins, directions = rays_about(mesh, 20_000, seed=2)
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, search="linear")
    hits = maps.trace(origins, directions, search="linear", linear_steps=linear_steps)
    truth = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, directions)
    hit, true_hit = hits.triangle >= 0, truth.triangle >= 0
    wrong_hits, wrong_misses = (100.0 * x.sum() / true_hit.sum() for x in (hit & ~true_hit, true_hit & ~hit))
    errors = np.abs(hits.t[hit & true_hit] - truth.t[hit & true_hit])
    texel = (mesh.bounds[1] - mesh.bounds[0]).max() / 256
    median = np.median(errors) / texel
    found = f"{name}: wrong hits {wrong_hits:.2f}%, wrong misses {wrong_misses:.2f}%, median {median:.3f} texels"
    assert wrong_hits <= limits[name][0] and wrong_misses <= limits[name][1] and median <= 0.75, found
