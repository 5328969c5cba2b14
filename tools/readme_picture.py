"""Renders the README's pictures: those of the gallery, a scene with the ray-traced truth inset, a mesh on every stage,
mirrors that see themselves and one another, and peeled layers.

    python tools/readme_picture.py             # some minutes; writes five pictures into docs/
    python tools/readme_picture.py FOLDER      # the same into another folder

The scenes are those of ``scenes/``, of which two of the gallery need meshes in LDTREFL_MESH_PATH; the mesh on the
stages is the shape ``teapot``, and the layers those of the shape ``genus3``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import ldtrefl
from ldtrefl.compare.layer_picture import draw_layers
from ldtrefl.files.srgb import linear_from_srgb
from ldtrefl.files.tone_mapping import shown
from ldtrefl.scene import shapes
from ldtrefl.scene.composed import composed

ROOT = Path(__file__).parent.parent
CROP = (slice(182, 342), slice(288, 528))
"""Rows and columns of the ray-traced picture that the inset shows: the reflections in the ball."""

FRAME = 3
"""Width of the inset's white frame, pixels."""

GALLERY = (("photograph", "cluttered_room", "bowl"), ("hall_of_mirrors", "chrome_statue", "chair"))
"""Names of the scenes that the README begins with, as their pictures stand in rows."""

GALLERY_SAMPLES = 16
"""Of a pixel, at most: as pictures that are kept are rendered."""

MIRRORS = (
    ("facing_balls", "linked_mirrors", "thousand_pearls"),
    ("inside_bowl", "hall_of_mirrors", "mirror_room"),
)
"""Names of the scenes of mirrors in mirrors, as their pictures stand in rows."""

STAGES = ("mirror-ball", "mirror-floor", "chrome")
"""Stages of which there is a picture."""

STAGE_SIZE = (768, 512)
"""Width and height of their pictures, before they are halved."""

GAP = 8
"""Width of the white lines between those pictures, pixels."""

MAP_RESOLUTION = 192
"""Texels along a side of the layers' picture: it shall not be larger than the README is wide."""


def main() -> None:
    """Write the pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT / "docs", help="where the pictures go")
    folder = parser.parse_args().folder
    ldtrefl.save_image(folder / "teapot.png", picture_with_inset())
    ldtrefl.save_image(folder / "gallery.png", picture_of_gallery())
    ldtrefl.save_image(folder / "stages.png", picture_of_stages())
    ldtrefl.save_image(folder / "mirrors.png", picture_of_mirrors())
    shape = shapes.make("genus3")
    maps = ldtrefl.peel(shape.vertices, shape.faces, resolution=MAP_RESOLUTION)
    ldtrefl.save_image(folder / "layers.png", draw_layers(maps))


def picture_with_inset() -> np.ndarray:
    """(h, w, 3) float32: the teapot's scene, with a part of the ray-traced picture in its upper right corner."""
    scene = ldtrefl.load_scene(ROOT / "scenes" / "teapot.toml")
    picture = ldtrefl.render(scene, "ldt").image.copy()
    inset = ldtrefl.render(scene, "bvh").image[CROP]
    height, width = inset.shape[:2]
    framed = np.ones((height + 2 * FRAME, width + 2 * FRAME, 3), np.float32)
    framed[FRAME:-FRAME, FRAME:-FRAME] = inset
    picture[: framed.shape[0], -framed.shape[1] :] = framed
    return picture


def picture_of_gallery() -> np.ndarray:
    """(h, w, 3) float32: the scenes of ``GALLERY`` at half their size."""
    return _in_rows(tuple(tuple(f"gallery/{name}" for name in names) for names in GALLERY), GALLERY_SAMPLES)


def picture_of_stages() -> np.ndarray:
    """(h, w, 3) float32: the teapot on all of ``STAGES``, at half their size."""
    teapot = ldtrefl.Object(name="teapot", shape="teapot", material=ldtrefl.Material(albedo=(0.6, 0.16, 0.1)))
    pictures = [halved(as_shown(composed((teapot,), on, size=STAGE_SIZE))) for on in STAGES]
    return _side_by_side(pictures, axis=1)


def picture_of_mirrors() -> np.ndarray:
    """(h, w, 3) float32: the scenes of ``MIRRORS`` at half their size, so that each pixel is the mean of four."""
    return _in_rows(MIRRORS)


def rendered(name: str, samples: int = 4) -> np.ndarray:
    """(h, w, 3) float32: a shipped scene."""
    return as_shown(ldtrefl.load_scene(ROOT / "scenes" / f"{name}.toml"), samples)


def as_shown(scene: ldtrefl.Scene, samples: int = 4) -> np.ndarray:
    """(h, w, 3) float32: a scene as the screen shows it, by its exposure and tone mapping, in linear light."""
    image, picture = ldtrefl.render(scene, "ldt", samples=samples).image, scene.picture
    return linear_from_srgb(shown(image, picture.exposure, picture.tone_mapping))


def halved(picture: np.ndarray) -> np.ndarray:
    """A picture of half the height and width, both even: the mean of every 2 x 2 pixels."""
    height, width, channels = picture.shape
    return picture.reshape(height // 2, 2, width // 2, 2, channels).mean(axis=(1, 3))


def _in_rows(rows: tuple[tuple[str, ...], ...], samples: int = 4) -> np.ndarray:
    """(h, w, 3) float32: shipped scenes at half their size, row by row."""
    made = [[halved(rendered(name, samples)) for name in names] for names in rows]
    return _side_by_side([_side_by_side(pictures, axis=1) for pictures in made], axis=0)


def _side_by_side(pictures: list[np.ndarray], axis: int) -> np.ndarray:
    """Pictures of one size along an axis, with white lines in between."""
    shape = list(pictures[0].shape)
    shape[axis] = GAP
    parts = [part for picture in pictures for part in (np.ones(shape, np.float32), picture)]
    return np.concatenate(parts[1:], axis=axis)


if __name__ == "__main__":
    main()
