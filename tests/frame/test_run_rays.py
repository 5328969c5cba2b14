"""The rays of a run against spheres, eight at once, against float64: none is lost, and few are kept that miss."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.run_rays import ROWS, lay_side_by_side, rays_near
from ldtrefl.tracing.object_sets import RUN
from ldtrefl.tracing.ray_buffers import RayBuffer, empty_rays


@launch.kernel
def meet_spheres(
    first: int,
    # In:
    rays: RayBuffer,
    middle: wp.vec3d,
    reach: float,
    centres: wp.array(dtype=wp.vec3d),
    radii: wp.array(dtype=float),
    asked: wp.uint64,
    # Out:
    met_out: wp.array(dtype=wp.uint64),
):
    """Find the rays of one run that may meet one sphere."""
    k = first + wp.tid()
    memory = wp.zeros(shape=ROWS, dtype=wp.float32)
    rows = wp.array(ptr=memory.ptr, shape=(ROWS,), dtype=wp.float32)
    lay_side_by_side(rays, 0, rays.pixel.shape[0], middle, rows)
    met_out[k] = rays_near(rows, middle, reach, centres[k], radii[k], asked)


def made(count: int, seed: int, spread: float, far: float) -> tuple[np.ndarray, ...]:
    """Rays that start within ``spread`` of a middle, and spheres up to ``far`` away: starts, directions, centres and
    radii."""
    rng = np.random.default_rng(seed)
    starts = spread * rng.uniform(-1, 1, (count, 3)) + [3.0, -2.0, 7.0]
    ways = rng.normal(size=(count, 3)) + np.array([2.0, 0.0, 0.0])
    ways = (ways / np.linalg.norm(ways, axis=1, keepdims=True)).astype(np.float32)
    distances = 10.0 ** rng.uniform(-3, np.log10(far), (4000, 1))
    centres = [3.0, -2.0, 7.0] + distances * (rng.normal(size=(4000, 3)) * 0.5 + [1.0, 0, 0])
    return starts, ways, centres, (distances[:, 0] * 10.0 ** rng.uniform(-5, 0, 4000)).astype(np.float32)


@pytest.mark.parametrize("count", [int(RUN), 13])
@pytest.mark.parametrize(("spread", "far"), [(0.01, 10.0), (1.0, 1e3), (1e-6, 1e6), (1e-3, 1e30)])
def test_no_ray_is_lost_and_few_are_kept_that_miss(count: int, spread: float, far: float) -> None:
    starts, ways, centres, radii = made(count, count, spread, far)
    device, middle = launch.resolve_device(None), starts.mean(axis=0)
    rays = empty_rays(count, device)
    rays.origin, rays.direction = (wp.array(starts, dtype=wp.vec3d, device=device), wp.array(ways, dtype=wp.vec3))
    asked = np.uint64(0xF0F0F0F0F0F0F0F5) & (np.uint64(2**count - 1) if count < 64 else ~np.uint64(0))
    reach = float(np.linalg.norm(starts - middle, axis=1).max())
    met = wp.empty(len(centres), dtype=wp.uint64, device=device)
    given = [wp.array(centres, dtype=wp.vec3d, device=device), wp.array(radii, dtype=float, device=device)]
    launch.launch(
        meet_spheres, len(centres), [rays, wp.vec3d(*middle), reach, *given, wp.uint64(int(asked)), met], device
    )
    found = met.numpy()[:, None] >> np.arange(count, dtype=np.uint64) & np.uint64(1) != 0
    is_asked = asked >> np.arange(count, dtype=np.uint64) & np.uint64(1) != 0
    assert not found[:, ~is_asked].any() and not (met.numpy() & ~asked).any()

    offset, way = centres[:, None] - starts, ways.astype(float)
    along, apart = (offset * way).sum(axis=2), (offset**2).sum(axis=2)
    aside, wide = np.linalg.norm(np.cross(offset, way), axis=2), radii.astype(float)[:, None]
    truth = (aside <= wide * np.linalg.norm(way, axis=1)) & ((along >= 0) | (apart <= wide**2))
    assert 0.01 < truth.mean() < 0.9
    assert not (truth & ~found & is_asked).any()
    # Squares of what is farther away than float32 reaches are infinite, and such spheres are kept.
    nearly = (aside <= wide + 1e-5 * (np.sqrt(apart) + reach)) | (aside > 1e15)
    assert (found & ~nearly).sum() == 0
