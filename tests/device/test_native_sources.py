"""The C++ of native functions: files compile alone, with vectors and without, answer alike, leave no macro behind."""

import dataclasses
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import warp as wp
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.device import cpu_threads, native_sources, warp_abi
from ldtrefl.frame import contrast, instances, run_rays
from ldtrefl.ldt.exact import walk, wide_tree
from ldtrefl.ldt.exact.tree import TreeView
from ldtrefl.ldt.exact.walk import CONSTANTS, FILES, SEARCH, TREE
from ldtrefl.ldt.linear import march
from ldtrefl.scene import shapes
from ldtrefl.shading import finish, highlights, ray_footprint, surfaces, textures
from ldtrefl.tracing import bvh_walk
from ldtrefl.tracing.batch import trace_batch
from ldtrefl.tracing.hit import Hit
from ldtrefl.tracing.tracer import Query, array_of_views

SHIM = (
    """
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#define CUDA_CALLABLE
#define BVH_QUERY_STACK_SIZE (32)
namespace wp {
template <int N> struct launch_bounds_t { uint32_t shape[N]; size_t size, coord_mult; };
struct BVHPackedNodeHalf { float x, y, z; unsigned int i : 31; unsigned int b : 1; };
struct BVH { BVHPackedNodeHalf *node_lowers, *node_uppers; int *primitive_indices, *root; };
inline BVHPackedNodeHalf bvh_load_node(const BVHPackedNodeHalf* nodes, int index) { return nodes[index]; }
}
"""
    + warp_abi.CALL_KERNEL
    + warp_abi.READ_BVH
)
"""What Warp's headers give native functions, and what ``warp_abi.py`` puts before the threads' and the ray caster's."""

SOURCES = {
    "device/cpu_threads.h": (cpu_threads.CONSTANTS, ()),
    "device/vectors.h": ({}, ()),
    "frame/backdrop.h": ({}, ("device/vectors.h",)),
    "frame/contrast.h": (contrast.CONSTANTS, ("device/vectors.h",)),
    "frame/smooth.h": ({}, ("device/vectors.h",)),
    "shading/finish.h": (finish.CONSTANTS | {"MOST_PROBES": 16}, finish.FILES[:-1]),
    "shading/pictures.h": (textures.PICTURE_CONSTANTS | {"MOST_PROBES": 16}, ()),
    "shading/highlights.h": (highlights.CONSTANTS, ()),
    "shading/surfaces.h": (surfaces.CONSTANTS, ("device/vectors.h",)),
    "shading/ray_footprint.h": (ray_footprint.CONSTANTS, ray_footprint.FILES[:-1]),
    "frame/run_rays.h": (run_rays.CONSTANTS, ("device/vectors.h",)),
    "tracing/ray_query.h": ({}, ("device/vectors.h",)),
    "tracing/ray_batch.h": ({}, ("device/vectors.h", "tracing/ray_query.h")),
    "tracing/triangle_test.h": ({}, ("device/vectors.h",)),
    "tracing/bvh_walk.h": (bvh_walk.CONSTANTS, bvh_walk.FILES[:-1]),
    **{
        name: (module.CONSTANTS, module.FILES[:number])
        for module in (march, wide_tree, walk, instances)
        for number, name in enumerate(module.FILES)
        if name.startswith(("ldt", "frame"))
    },
}


def test_every_file_is_here() -> None:
    assert {str(path.relative_to(native_sources.PACKAGE)) for path in native_sources.PACKAGE.rglob("*.h")} == set(
        SOURCES
    )


@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++ on this machine")
@pytest.mark.parametrize("plain", [False, True])
@pytest.mark.parametrize("name", SOURCES)
def test_a_file_compiles_after_what_it_is_derived_from(name: str, plain: bool, tmp_path: Path) -> None:
    """In a function, as it will stand; ``plain`` is what compilers without vectors see."""
    constants, before = SOURCES[name]
    body = native_sources.native_body(constants, (*before, name), "")
    program = SHIM + "#define PLAIN_VECTORS\n" * plain + "void function() {\n" + body + "\n}\n"
    (tmp_path / "program.cpp").write_text(program)
    command = ["g++", "-std=c++17", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-Wno-unused", "-Wno-psabi"]
    command += ["-Wno-unknown-pragmas", str(tmp_path / "program.cpp")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_macros_end_with_the_body() -> None:
    body = native_sources.native_body(walk.CONSTANTS, walk.FILES, "")
    defined, undefined = (re.findall(rf"^ *#{word} (\w+)", body, re.MULTILINE) for word in ("define", "undef"))
    assert set(defined) == set(undefined) and {"SHARED", "FUSED"} <= set(defined)


@wp.func_native("\n#define PLAIN_VECTORS\n" + native_sources.native_body(CONSTANTS, FILES, TREE + SEARCH))
def search_without_vectors(
    views: wp.array(dtype=TreeView), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
): ...


@wp.func
def closest_hits_without_vectors(
    views: wp.array(dtype=TreeView), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
):
    search_without_vectors(views, index, queries, count, hits)


def test_without_vectors_the_answers_are_the_same() -> None:
    """What CUDA runs, on this processor."""
    mesh = shapes.make("genus3", {"grid": 32})
    maps = ldtrefl.peel(mesh.vertices, mesh.faces)
    origins, directions = rays_about(mesh, 20_000)
    expected = maps.trace(origins, directions)
    plain = dataclasses.replace(walk.EXACT, name="plain", closest_hits=closest_hits_without_vectors)
    views = array_of_views([maps.tree.view], TreeView, maps.geometry.vertices.device)
    found = trace_batch(plain, views, maps.geometry, origins, directions)
    assert (found.triangle >= 0).mean() > 0.3
    np.testing.assert_array_equal(found.triangle, expected.triangle)
    np.testing.assert_array_equal(found.t, expected.t)
