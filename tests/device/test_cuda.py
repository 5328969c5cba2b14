"""Every kernel compiles for CUDA; no GPU is needed for that. None has constants that a compiler must warn of."""

import re
from pathlib import Path

import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.bounces import shade_hits_kernel
from ldtrefl.frame.camera_shading import shade_pixels_kernel, shade_reflectors_kernel
from ldtrefl.frame.searched_pixels import search_pixels_kernel
from ldtrefl.frame.seen_surfaces import describe_kernel
from ldtrefl.ldt.searches import TRACERS
from ldtrefl.methods import all_methods
from ldtrefl.methods.virtual import reflection_point  # noqa: F401  (for its kernels)
from ldtrefl.methods.virtual.bisector_places import texel_towards
from ldtrefl.methods.virtual.fermat_places import surface_towards
from ldtrefl.methods.virtual.radius_map import RadiusMap
from ldtrefl.methods.virtual.reflector_texture import ReflectorTexture
from ldtrefl.methods.virtual.subdivision import edge_errors_kernel
from ldtrefl.renderer import Renderer  # noqa: F401  (with the methods, imports every module that defines kernels)
from ldtrefl.tracing.batch import batch_kernel
from ldtrefl.tracing.bvh import BVH
from ldtrefl.tracing.closest_hits import closest_hits_kernel
from ldtrefl.tracing.nothing import NOTHING
from ldtrefl.world.shading_features import ShadingFeatures

LITTLE = 1
"""Level of optimization. The code is not run, and NVRTC takes a third of the time that it takes for its best; level 0
has a fault in some versions."""


SHADOWS = ShadingFeatures(shadows=True)
EVERYTHING = ShadingFeatures(*[True] * 4, probes=16, footprints=True)
SHADED = (
    (NOTHING, ShadingFeatures()),
    (NOTHING, ShadingFeatures(looks=True)),
    (NOTHING, ShadingFeatures(soft_light=True)),
    (NOTHING, ShadingFeatures(probes=16, footprints=True)),
    *((tracer, SHADOWS) for tracer in (BVH, *TRACERS.values())),
    (TRACERS["exact"], ShadingFeatures(looks=True, shadows=True, dimmed_shadows=True)),
    (BVH, EVERYTHING),
)
"""What answers shadow rays, and what scenes have: each feature, each tracer, and all features together. All kernels
that shade call the same functions, so not each of them is built for each of these."""


def all_kernels() -> list[wp.Kernel]:
    all_methods()
    edge_errors_kernel(ReflectorTexture, texel_towards)
    edge_errors_kernel(RadiusMap, surface_towards)
    for tracer in (BVH, *TRACERS.values()):
        batch_kernel(tracer, 1)
        batch_kernel(tracer, 1, True)
        closest_hits_kernel(tracer, 1)
        search_pixels_kernel(tracer, 1)
    for has_looks in (False, True):
        describe_kernel(has_looks)
    for tracer, features in SHADED:
        shade_hits_kernel(tracer, features)
    for tracer, features in ((NOTHING, EVERYTHING.without_rays()), (BVH, SHADOWS)):
        shade_pixels_kernel(tracer, features)
        shade_reflectors_kernel(tracer, True, features)
    shade_reflectors_kernel(NOTHING, False, ShadingFeatures())
    return [kernel for kernel in launch.KERNELS if kernel.func.__module__.startswith("ldtrefl.")]


def test_kernels_are_found() -> None:
    assert len({kernel.module.name for kernel in all_kernels()}) >= 40


@pytest.mark.parametrize("kernel", all_kernels(), ids=lambda kernel: kernel.module.name)
def test_kernel_compiles_to_ptx(kernel: wp.Kernel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    launch.resolve_device(None)
    monkeypatch.setattr(wp.config, "optimization_level", LITTLE)
    wp.compile_aot_module(kernel.module, arch=86, module_dir=tmp_path, use_ptx=True)
    made = list(tmp_path.rglob("*.ptx"))
    assert made and all(b".entry" in path.read_bytes() for path in made)
    (source,) = tmp_path.rglob("*.cu")
    numbers = re.findall(r"wp::int32 \w+ = (-?\d+);", source.read_text())
    assert all(-(2**31) <= int(number) < 2**31 for number in numbers), numbers
