"""Spheres, rectangles and spot lights by ``bvh`` and by Mitsuba 3: matt things, soft shadows, direct light alone.

    python tools/light_comparison.py                       # a minute; the table on the screen
    python tools/light_comparison.py --quick               # small pictures, fewer samples

What Mitsuba needs stands at the head of ``mitsuba_comparison.py``. Exit status 1 if a mean is off by more than 1%.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from typing import Any

import numpy as np
from mitsuba_parts.mitsuba_scene import camera_place, mitsuba

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene

MOST_OFF = 0.01
"""Of a mean."""
SAMPLES = 1024
QUICK_SAMPLES = 64
QUICK_SIZE = 96, 64
MITSUBA_SHAPES = {"plane": "rectangle", "box": "cube"}
"""Our shapes -> Mitsuba's of the same size."""

LIGHTS = {
    "sphere": (Light(kind="sphere", position=(-1.5, -1.0, 3.5), radius=0.4, radiance=(20.0, 20.0, 18.0)),),
    "large sphere, low": (Light(kind="sphere", position=(-3.0, 1.0, 0.6), radius=1.0, radiance=(3.0, 3.0, 3.0)),),
    "rectangle": (
        Light(
            kind="rectangle",
            position=(2.0, -1.0, 3.0),
            direction=(-0.5, 0.3, -1.0),
            width=1.0,
            height=2.0,
            radiance=(8.0, 8.0, 8.0),
        ),
    ),
    "rectangle beside things": (
        Light(
            kind="rectangle",
            position=(-1.4, 0.0, 0.6),
            direction=(1.0, 0.0, 0.0),
            width=3.0,
            height=1.2,
            radiance=(2.0, 2.0, 2.0),
        ),
    ),
    "spot": (
        Light(
            kind="spot",
            position=(0.5, -1.0, 4.0),
            direction=(0.0, 0.3, -1.0),
            intensity=(20.0, 20.0, 20.0),
            inner_angle=19.8,
            outer_angle=20.0,
        ),
    ),
}
"""Lights of each scene. None is in view."""
BLACK = (0.0, 0.0, 0.0)


def lit_things(lights: tuple[Light, ...]) -> Scene:
    """Matt boxes on a floor, in these lights."""

    def box(scale: float, x: float, y: float, turn: float) -> Object:
        material = Material(albedo=(0.8, 0.5, 0.3))
        rotate = (0.0, 0.0, 1.0, turn)
        return Object(shape="box", smooth=False, scale=scale, translate=(x, y, scale), rotate=rotate, material=material)

    floor = Object(shape="plane", scale=20.0, material=Material(albedo=(0.7, 0.7, 0.7)))
    return Scene(
        camera=Camera(eye=(0.0, -7.0, 4.0), look_at=(0.2, 0.0, 0.0), width=384, height=256, fov_y=28.0),
        environment=Environment(sky=BLACK, ground=BLACK),
        lighting=Lighting(ambient=BLACK, shadows=True),
        lights=lights,
        objects=(floor, box(0.5, 0.0, 0.0, 20.0), box(0.3, 1.1, -0.6, 50.0)),
    )


def by_mitsuba(scene: Scene, samples: int) -> np.ndarray:
    """(h, w, 3) the scene by Mitsuba's direct illumination, light sampled alone."""
    mi = mitsuba()
    camera = scene.camera
    film = {"type": "hdrfilm", "width": camera.width, "height": camera.height, "rfilter": {"type": "box"}}
    made: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
        "sensor": {
            "type": "perspective",
            "fov": camera.fov_y,
            "fov_axis": "y",
            "to_world": camera_place(mi, camera),
            "film": {**film, "pixel_format": "rgb", "component_format": "float32"},
            "sampler": {"type": "independent"},
        },
    }
    for number, entry in enumerate(scene.objects):
        shape = MITSUBA_SHAPES[str(entry.shape)]
        bsdf = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": _rgb(entry.material.albedo)}}
        made[f"object_{number}"] = {"type": shape, "to_world": _matrix(mi, entry.world_from_object()), "bsdf": bsdf}
    for number, light in enumerate(scene.lights):
        made[f"light_{number}"] = _light(mi, light)
    return np.array(mi.render(mi.load_dict(made), spp=samples, seed=1))


def _rgb(color: object) -> dict[str, object]:
    return {"type": "rgb", "value": list(np.asarray(color, float))}


def _matrix(mi: Any, matrix: np.ndarray) -> Any:
    return mi.ScalarTransform4f(np.ascontiguousarray(matrix))


def _light(mi: Any, light: Light) -> dict[str, object]:
    """A light of Mitsuba's. Its spot light falls off in another way, but for angles that are all but equal."""
    position = np.asarray(light.position, float)
    if light.kind == "spot":
        assert light.direction is not None
        target = position + light.direction
        up = [0.0, 1.0, 0.0]
        to_world = mi.ScalarTransform4f().look_at(origin=position.tolist(), target=target.tolist(), up=up)
        # Ours is over pi: what leaves a white surface.
        intensity = _rgb(np.pi * np.asarray(light.intensity))
        angles = {"cutoff_angle": light.outer_angle, "beam_width": light.inner_angle}
        return {"type": "spot", "to_world": to_world, "intensity": intensity, **angles}
    emitter = {"type": "area", "radiance": _rgb(light.radiance)}
    if light.kind == "sphere":
        return {"type": "sphere", "center": position.tolist(), "radius": light.radius, "emitter": emitter}
    right, up, axis = light.axes
    assert light.width is not None and light.height is not None
    to_world = np.eye(4)
    to_world[:3] = np.stack([0.5 * light.width * right, 0.5 * light.height * up, axis, position], axis=1)
    return {"type": "rectangle", "to_world": _matrix(mi, to_world), "emitter": emitter}


@dataclasses.dataclass(frozen=True)
class Means:
    """How far ours are off: means over pixels, relative."""

    name: str
    all: float
    penumbra: float
    """Of pixels that see a part of the light."""
    penumbra_pixels: int
    spread: float
    """Root of the mean squared difference, over the mean, in the penumbra: grain of both."""

    @property
    def passed(self) -> bool:
        """Whether both are within the limit."""
        return max(abs(self.all), abs(self.penumbra)) <= MOST_OFF


def compared(name: str, scene: Scene, samples: int) -> Means:
    """Render a scene by both, edges of pixels left to chance in Mitsuba's."""
    ours = ldtrefl.render(scene, "bvh").image
    open_ = ldtrefl.render(dataclasses.replace(scene, lighting=Lighting(ambient=BLACK)), "bvh").image
    theirs = by_mitsuba(scene, samples)
    share = ours[..., 0] / np.maximum(open_[..., 0], 1e-30)
    partly = (share > 0.02) & (share < 0.98)
    spread = np.sqrt(((ours - theirs)[partly] ** 2).mean()) / theirs[partly].mean() if partly.any() else 0.0
    return Means(name, _off(ours, theirs), _off(ours[partly], theirs[partly]), int(partly.sum()), float(spread))


def _off(ours: np.ndarray, theirs: np.ndarray) -> float:
    return float(ours.mean(dtype=float) / theirs.mean(dtype=float) - 1.0) if ours.size else 0.0


def main() -> int:
    """Compare all scenes, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small pictures, fewer samples")
    quick = parser.parse_args().quick
    found = []
    print(f"| lights | mean, % | in the penumbra, % | its pixels | its grain |\n|{'---|' * 5}")
    for name, lights in LIGHTS.items():
        scene = lit_things(lights)
        if quick:
            width, height = QUICK_SIZE
            scene = scene.with_camera(dataclasses.replace(scene.camera, width=width, height=height))
        found.append(compared(name, scene, QUICK_SAMPLES if quick else SAMPLES))
        last = found[-1]
        cells = [last.name, f"{100 * last.all:+.2f}", f"{100 * last.penumbra:+.2f}", last.penumbra_pixels]
        print(f"| {' | '.join(map(str, cells))} | {last.spread:.3f} |", flush=True)
    return 0 if all(means.passed for means in found) else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except InputError as error:
        sys.exit(f"light_comparison.py: {error}")
