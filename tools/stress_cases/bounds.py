"""Case 14: kernels that check every index, run over shapes, materials, pictures, lights and skips.

Data that a skip leaves out must not be read. The kernels are compiled in Warp's debug mode, in which an index outside
its array ends the process. So the case runs in a process of its own; and with few pixels, as that mode is slow.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

import ldtrefl
from ldtrefl.frame.skip_options import skip_names
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene

from .outcomes import Outcome

NAME = "14 bounds"
Params = dict[str, int | list[int]]
SMALL: dict[str, Params] = {
    "sphere": {"segments": [12, 6]},
    "torus": {"segments": [12, 6]},
    "torus_knot": {"segments": [24, 6]},
}
SMALL |= {"bowl": {"segments": [12, 4]}, "genus3": {"grid": 16}, "gyroid": {"grid": 16}, "teapot": {"segments": 2}}
DENSE: Params = {"segments": [260, 120]}
"""Parameters of a sphere that is so fine that patches stand for its triangles in maps of ``COARSE`` texels."""
COARSE = 64
"""Texels along a side of most maps: few, so that so few triangles are enough for patches, as this mode is slow."""

OPTIONS: list[tuple[str, dict[str, Any]]] = [
    ("ldt", {}),
    ("ldt", {"skip": "none", "resolution": COARSE}),
    ("ldt", {"quality": "exact", "max_bounces": 3, "resolution": COARSE}),
    ("ldt", {"quality": "fast", "resolution": COARSE}),
    ("ldt", {"search": "linear", "resolution": 32, "linear_steps": 64, "max_bounces": 2}),
    ("ldt", {"error": 1.0}),
    ("ldt", {"cull": "flat", "resolution": COARSE}),
    *[("ldt", {"skip": [name for name in skip_names() if name != off], "resolution": COARSE}) for off in skip_names()],
    ("bvh", {"max_bounces": 2}),
    *[
        ("envmap", {"resolution": 16, "projection": name})
        for name in ("infinite", "sphere", "box", "distance", "layered")
    ],
]

SECONDS = 3600
"""After which the process is given up."""

SHOWN = 2000
"""Characters from the end of its standard error that are shown if it fails."""


def run(rays: int, pictures: int) -> list[Outcome]:
    """One in ``pictures`` variants of every shape, under every option."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "stress_cases.bounds", str(pictures)]
    folder = Path(__file__).parent.parent
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=SECONDS, cwd=folder)
    words = done.stdout.split()
    outcome = Outcome(NAME, "every index in its array", "all", tried=int(words[-1]) if words else 0)
    outcome.limit = "no index outside its array, all pixels finite"
    outcome.defects = int(done.returncode != 0)
    outcome.passed = done.returncode == 0 and outcome.tried == 4 * len(OPTIONS)
    outcome.seconds = time.perf_counter() - start
    if not outcome.passed:
        print(done.stderr[-SHOWN:])
    return [outcome]


def variants(shape: str, params: Params, picture: str) -> Iterator[dict[str, Any]]:
    """A shape smooth and flat, lit, glowing, mirroring and black, with a picture and without."""
    pictures = (None, picture) if shapes.make(shape, params).uvs is not None else (None,)
    for albedo, emission, mirror in ((0.8, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.9), (0.0, 0.0, 0.0)):
        for smooth in (True, False):
            for texture in pictures:
                material = Material(
                    albedo=(albedo,) * 3,
                    emission=(emission,) * 3,
                    mirror=(mirror,) * 3,
                    texture=texture,
                    fresnel=smooth,
                )
                yield {"shape": shape, "params": params, "smooth": smooth, "material": material}


def scenes(step: int, folder: Path) -> list[Scene]:
    """Four scenes: with all objects, with shadows and a picture of the sky, without mirrors, and empty."""
    texture, sky = str(folder / "texture.png"), str(folder / "sky.exr")
    ldtrefl.save_image(texture, np.random.default_rng(0).random((5, 7, 3)).astype(np.float32))
    ldtrefl.save_image(sky, np.random.default_rng(1).random((6, 12, 3)).astype(np.float32))
    things = [thing for shape in shapes.names() for thing in variants(shape, SMALL.get(shape, {}), texture)][::step]
    things += list(variants("sphere", DENSE, texture))[:: max(step, 3)]
    far = [[1e5, 0, 0], [1e5, 1, 0], [1e5, 0, 1]]
    outlier = ldtrefl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]] * 40 + far, np.arange(123).reshape(-1, 3))
    things.append({"mesh": outlier, "smooth": False})
    rng = np.random.default_rng(2)
    objects = tuple(
        Object(**thing, fit=0.6, translate=tuple(rng.uniform(-2, 2, 3).tolist()), rotate=(1, 2, 3, 17.0 * k))
        for k, thing in enumerate(things)
    )
    camera = Camera(eye=(0, -7, 2), look_at=(0, 0, 0), width=24, height=16)
    lights = (
        Light(kind="directional", direction=(1, 1, -1), radiance=(1, 1, 1)),
        Light(kind="point", position=(1, -3, 2), intensity=(2, 2, 2)),
    )
    shadowed, image = Lighting(shadows=True), Environment(image=sky)
    return [
        Scene(camera=camera, objects=objects, lights=lights),
        Scene(camera=camera, objects=objects, lights=lights, lighting=shadowed, environment=image),
        Scene(camera=camera, objects=tuple(entry for entry in objects if not entry.is_reflector)),
        Scene(camera=camera),
    ]


def main() -> None:
    """Render all scenes under all options; print how many pictures that were."""
    wp.config.mode = "debug"
    ldtrefl.set_threads(1)
    done = 0
    with tempfile.TemporaryDirectory() as folder:
        for scene in scenes(int(sys.argv[1]), Path(folder)):
            for method, options in OPTIONS:
                assert np.isfinite(ldtrefl.render(scene, method, **options, samples=1).image).all(), (method, options)
                done += 1
    print(done)


if __name__ == "__main__":
    main()
