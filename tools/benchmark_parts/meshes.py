"""The same rays by layered depth textures, Warp's BVH and Embree, mesh by mesh: time, error, build time and bytes."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from timing import timed_in_turn

import ldtrefl
from ldtrefl import launch
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.items import Quality
from ldtrefl.ldt import peel_mesh
from ldtrefl.march import TRACERS
from ldtrefl.raycast import BVH, Raycaster

from .common import Batch, load, mirror_rays

ERROR_TEXELS = 128
"""Distances are given in texels of a map of this resolution, whatever the map's."""


def embree_scene(mesh: ldtrefl.Mesh) -> rtcore_scene.EmbreeScene:
    """An Embree scene; its tree is built at the first ray."""
    scene = rtcore_scene.EmbreeScene(robust=True)
    TriangleMesh(scene, mesh.unit_vertices, mesh.faces)
    scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
    return scene


def grown_by(make: Callable[[], Any]) -> int:
    """Bytes by which this process grows when something is made whose size cannot be asked for; to a few pages."""
    pages = [0, 0]
    for i, job in enumerate((lambda: None, make)):
        made = job()
        pages[i] = int(Path("/proc/self/statm").read_text().split()[1])
        del made
    return max(pages[1] - pages[0], 0) * os.sysconf("SC_PAGE_SIZE")


def errors_of(batch: Batch, truth_t: np.ndarray, truth_triangle: np.ndarray, sure: np.ndarray) -> dict[str, float]:
    """Wrong hits and misses in percent of true hits, distances in texels, same triangle in percent of common hits."""
    hit, true_hit = (batch.triangle.numpy() >= 0) & sure, (truth_triangle >= 0) & sure
    both, hits = hit & true_hit, max(int(true_hit.sum()), 1)
    distance = np.abs(batch.t.numpy()[both].astype(float) - truth_t[both]) * ERROR_TEXELS / 2
    p50, p99, p999 = np.percentile(distance, [50, 99, 99.9]) if both.any() else (0.0, 0.0, 0.0)
    return {
        "wrong_hits": 100.0 * float((hit & ~true_hit).sum()) / hits,
        "wrong_misses": 100.0 * float((true_hit & ~hit).sum()) / hits,
        "median": float(p50),
        "p99": float(p99),
        "p999": float(p999),
        "same_triangle": 100.0 * float((batch.triangle.numpy() == truth_triangle)[both].mean())
        if both.any()
        else 100.0,
    }


def rays_on_meshes(names: list[str], width: int, height: int, rounds: int) -> list[dict[str, Any]]:
    """Per mesh: time, error, build time and bytes of every tracer, one thread."""
    ldtrefl.set_threads(1)
    rays = mirror_rays(width, height)
    rows = []
    for name in names:
        mesh = load(name)
        if mesh is None:
            print(f"{name}: not in LDTREFL_MESH_PATH, left out", file=sys.stderr)
            continue
        rows.append(rays_on_mesh(name, ldtrefl.Mesh(mesh.unit_vertices, mesh.faces), *rays, rounds))
        print(_mesh_line(rows[-1]), flush=True)
    return rows


def rays_on_mesh(name: str, mesh: ldtrefl.Mesh, o: np.ndarray, d: np.ndarray, rounds: int) -> dict[str, Any]:
    """One row of :func:`rays_on_meshes`."""
    device = launch.resolve_device(None)
    origins, directions = (wp.array(x, dtype=wp.vec3, device=device) for x in (o, d))
    geometry = DeviceMesh(mesh, device)
    embree, caster = embree_scene(mesh), Raycaster.of(geometry)
    qualities: tuple[Quality, ...] = ("exact", "balanced", "fast")
    maps = {quality: peel_mesh(geometry, quality=quality) for quality in qualities}
    linear = peel_mesh(geometry, search="linear")
    batches = {"bvh": Batch(BVH, caster.view(), origins, directions)}
    batches |= {f"ldt {q}": Batch(TRACERS["exact"], m.view(), origins, directions) for q, m in maps.items()}
    batches["ldt linear"] = Batch(TRACERS["linear"], linear.view("linear"), origins, directions)
    times = timed_in_turn({**batches, "embree": functools.partial(embree.run, o, d)}, rounds)

    # The truth is the BVH's answer where Embree gives the same.
    answer = embree.run(o, d, output=1)
    truth_t, truth_triangle = batches["bvh"].t.numpy(), batches["bvh"].triangle.numpy()
    hit = truth_triangle >= 0
    sure = hit == (answer["primID"] >= 0)
    agreed = hit & sure
    sure[agreed] = np.abs(truth_t[agreed] - answer["tfar"][agreed]) < 2e-4

    makers: dict[str, Callable[[], Any]] = {"bvh": functools.partial(Raycaster.of, geometry)}
    makers["embree"] = functools.partial(embree_scene, mesh)
    makers |= {f"ldt {q}": functools.partial(peel_mesh, geometry, quality=q) for q in qualities}
    makers["ldt linear"] = functools.partial(peel_mesh, geometry, search="linear")
    builds = timed_in_turn(makers, max(1, rounds // 2))
    return {
        "mesh": name,
        "triangles": len(mesh.faces),
        "rays": len(o),
        "hits": int(hit.sum()),
        "unsure": int((~sure).sum()),
        "milliseconds": times,
        "build_milliseconds": builds,
        "bytes": {
            "bvh": grown_by(makers["bvh"]),
            "embree": grown_by(makers["embree"]),
            **{f"ldt {quality}": made.nbytes for quality, made in maps.items()},
            "ldt linear": linear.nbytes,
        },
        "errors": {n: errors_of(b, truth_t, truth_triangle, sure) for n, b in batches.items() if n != "bvh"},
    }


def _mesh_line(row: dict[str, Any]) -> str:
    time_of = {name: entry["median"] for name, entry in row["milliseconds"].items()}
    exact, default = row["errors"]["ldt exact"], row["errors"]["ldt balanced"]
    return (
        f"{row['mesh']:22s} {row['triangles']:8d}  bvh {time_of['bvh']:5.1f}  embree {time_of['embree']:5.1f}  "
        f"exact {time_of['ldt exact']:5.1f} ({exact['wrong_hits'] + exact['wrong_misses']:.3f}%)  "
        f"default {time_of['ldt balanced']:5.1f} ({default['wrong_hits']:.3f}% {default['wrong_misses']:.3f}% "
        f"p99 {default['p99']:.3f})  fast {time_of['ldt fast']:5.1f}  linear {time_of['ldt linear']:6.1f} ms"
    )
