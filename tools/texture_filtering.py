"""Measures how textures are filtered (``ldtrefl/shading/textures.py``): a checkered floor in a mirror ball, from above
and grazing, turning by half a degree a frame, against frames of 256 samples a pixel that filter nothing.

Images are blended from one sample a pixel, or from several on a grid within it, by a Gaussian of 0.375 pixels; or by
the renderer itself, from samples where pixels differ. What is printed is of what the ball shows:

- *fine*: the share of the picture's energy in what is finer than four pixels (half of the Nyquist frequency), and
  *finest* in what is finer than two and two thirds; both over the reference's. Above 1 is aliasing, below 1 blur.
- *flicker*: the root mean square of the change from a frame to the next, over the reference's.
- *error*: the root mean square of the difference from the reference.
- the milliseconds of a frame, over those of an unfiltered one; timed in turn, medians.

    python tools/texture_filtering.py -o FOLDER    # ten minutes; the pictures of the first frame are put there
    python tools/texture_filtering.py --quick      # half a minute: a small picture, 16 samples
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import itertools
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import ndimage
from timing import timed_in_turn

import ldtrefl
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene
from ldtrefl.world import camera as cameras

SIDE, QUICK_SIDE = 160, 48
"""Pixels."""

FRAMES, DEGREES = 4, 0.5
"""Frames, and by how much the floor turns from one to the next."""

GRID, QUICK_GRID = 16, 4
"""Samples of the reference along each axis of a pixel."""

VIEWS = {"above": ((0.0, -2.0, 9.0), 20.0), "grazing": ((0.0, -8.0, 1.0), 18.0)}
"""Eye, and field of view in degrees."""

DARK, LIGHT, GREY = 0.05, 0.8, 0.425
"""Of the floor; the environment is as the floor is in the mean, so that its end is no edge."""

SQUARES, TEXELS = 128, 16
"""Squares along the floor, and texels along each of them."""

DEVIATION, RADIUS = 0.375, 1.5
"""Of the filter that blends samples, in pixels."""

SOFT = 6.0
"""Pixels within which what the ball shows is faded out towards its edge."""

ROUNDS = 5

MIRROR = Material(mirror=(1.0, 1.0, 1.0))


@dataclass(frozen=True)
class Way:
    """A way to render."""

    samples: int
    """Along each axis of a pixel."""
    filters: bool = False
    anisotropy: int = 16
    adaptive: int = 1
    """The most samples of a pixel that the renderer itself takes where pixels differ, and blends."""

    def renderer(self, scene: Scene, skip: str = "all") -> ldtrefl.Renderer:
        """A renderer that renders so."""
        filters, probes = self.filters, self.anisotropy
        return ldtrefl.Renderer(
            scene, "ldt", skip=skip, samples=self.adaptive, filter_textures=filters, anisotropy=probes
        )


WAYS = {
    "1 sample": Way(1),
    "1 sample, filtered": Way(1, filters=True),
    "1 sample, trilinear": Way(1, filters=True, anisotropy=1),
    "4 samples": Way(2),
    "4 samples, filtered": Way(2, filters=True),
    "4, adaptive": Way(1, filters=True, adaptive=4),
    "16, adaptive": Way(1, filters=True, adaptive=16),
}


def scene_of(view: str, texture: Path, side: int) -> Scene:
    """The ball on the floor."""
    eye, fov = VIEWS[view]
    camera = Camera(eye=eye, look_at=(0.0, 0.0, 0.9), fov_y=fov, width=side, height=side)
    floor = Material(albedo=(1.0, 1.0, 1.0), texture=str(texture))
    objects = (
        Object(name="floor", shape="plane", scale=(30.0, 30.0, 1.0), material=floor),
        Object(shape="sphere", params={"segments": [1024, 512]}, translate=(0, 0, 1), material=MIRROR),
    )
    sky = Environment(sky=(GREY,) * 3, ground=(GREY,) * 3)
    return Scene(camera=camera, objects=objects, environment=sky, lighting=Lighting(ambient=(1.0, 1.0, 1.0)))


def checker() -> np.ndarray:
    """The floor's picture."""
    squares = np.indices((SQUARES, SQUARES)).sum(axis=0) % 2
    picture = np.where(squares, LIGHT, DARK).repeat(TEXELS, axis=0).repeat(TEXELS, axis=1)
    return np.repeat(picture[..., None], 3, axis=2).astype(np.float32)


def blended(image: np.ndarray, grid: int) -> np.ndarray:
    """(h, w, 3) pixels of an image with ``grid`` x ``grid`` samples for each."""
    if grid == 1:
        return image
    offset = (np.arange(3 * grid) + 0.5) / grid - RADIUS
    weights = np.exp(-0.5 * (offset / DEVIATION) ** 2) - np.exp(-0.5 * (RADIUS / DEVIATION) ** 2)
    weights /= weights.sum()
    for axis in (0, 1):
        padded = np.pad(image, [(grid, grid) if k == axis else (0, 0) for k in range(3)], mode="edge")
        rows = np.moveaxis(padded, axis, 0)
        count = image.shape[axis] // grid
        image = np.moveaxis(sum(w * rows[k : k + count * grid : grid] for k, w in enumerate(weights)), 0, axis)
    return image


@contextlib.contextmanager
def as_samples(grid: int) -> Iterator[None]:
    """Have an image of ``grid`` times as many pixels each way stand for one of as many samples: its rays' footprints
    are as wide as theirs."""
    usual = cameras.ray_spacing
    cameras.ray_spacing = lambda samples: grid * usual(samples * grid**2)
    try:
        yield
    finally:
        cameras.ray_spacing = usual


def frames_of(scene: Scene, way: Way, count: int) -> list[np.ndarray]:
    """(h, w, 3) frames of a scene whose floor turns."""
    side = scene.camera.width * way.samples
    camera = dataclasses.replace(scene.camera, width=side, height=side)
    renderer, made = way.renderer(scene.with_camera(camera)), []
    with as_samples(way.samples):
        for number in range(count):
            renderer.move("floor", rotate=(0.0, 0.0, 1.0, DEGREES * number))
            made.append(blended(renderer.render().image, way.samples))
    return made


def energy(image: np.ndarray, window: np.ndarray, pixels_a_cycle: float) -> float:
    """The share of energy in what is finer."""
    grey = image[..., 1]
    spectrum = np.abs(np.fft.fft2((grey - (grey * window).sum() / window.sum()) * window)) ** 2
    frequency = np.hypot(*np.meshgrid(*map(np.fft.fftfreq, grey.shape), indexing="ij"))
    return float(spectrum[frequency > 1.0 / pixels_a_cycle].sum() / spectrum.sum())


def flicker(frames: list[np.ndarray], inside: np.ndarray) -> float:
    """The root mean square of the change from a frame to the next."""
    changes = [(after - before)[inside] for before, after in itertools.pairwise(frames)]
    return float(np.sqrt(np.mean(np.square(changes))))


def milliseconds(scene: Scene, rounds: int) -> dict[str, float]:
    """Of a frame in each way in which frames are as large as the picture."""
    renderers = {
        name: way.renderer(scene, "reflection,regions,maps,bounds,attributes")
        for name, way in WAYS.items()
        if way.samples == 1
    }
    jobs = {name: renderer.render for name, renderer in renderers.items()}
    return {name: spent["median"] for name, spent in timed_in_turn(jobs, rounds).items()}


def measured(view: str, texture: Path, side: int, grid: int, pictures: Path | None) -> list[str]:
    """A line for each way to render a view."""
    scene = scene_of(view, texture, side)
    reflector = ldtrefl.render(scene, "ldt", samples=1).reflector_mask
    depth = ndimage.distance_transform_edt(reflector)
    window, inside = np.clip((depth - 2.0) / SOFT, 0.0, 1.0), depth > 3.0
    truth = frames_of(scene, Way(grid), FRAMES)
    times, lines, shown = milliseconds(scene, ROUNDS), [], [truth[0]]
    for name, way in WAYS.items():
        frames = frames_of(scene, way, FRAMES)
        fine, finest = (
            np.mean([energy(frame, window, cut) for frame in frames])
            / np.mean([energy(frame, window, cut) for frame in truth])
            for cut in (4.0, 8.0 / 3.0)
        )
        error = np.sqrt(np.mean([np.square(a - b)[inside].mean() for a, b in zip(frames, truth, strict=True)]))
        spent = f"{times[name] / times['1 sample']:.2f}" if name in times else "-"
        change = flicker(frames, inside) / flicker(truth, inside)
        lines.append(f"{view:8} {name:20} {fine:6.3f} {finest:7.3f} {change:8.3f} {error:7.4f} {spent:>5}")
        shown.append(frames[0])
    if pictures is not None:
        ldtrefl.save_image(pictures / f"texture_filtering_{view}.png", np.concatenate(shown, axis=1))
    return lines


def main() -> None:
    """Measure both views."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a small picture and few samples")
    parser.add_argument("-o", dest="pictures", type=Path, help="a folder for pictures of the reference and all ways")
    asked = parser.parse_args()
    side, grid = (QUICK_SIDE, QUICK_GRID) if asked.quick else (SIDE, GRID)
    print(f"{'view':8} {'way':20} {'fine':>6} {'finest':>7} {'flicker':>8} {'error':>7} {'time':>5}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        texture = Path(folder) / "checker.exr"
        ldtrefl.save_image(texture, checker())
        for view in VIEWS:
            print("\n".join(measured(view, texture, side, grid, asked.pictures)), flush=True)


if __name__ == "__main__":
    main()
