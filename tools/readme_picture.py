"""Renders the README's pictures: a scene by layered depth textures with the ray-traced truth inset, and peeled layers.

    python tools/readme_picture.py             # a few seconds; writes docs/teapot.png and docs/layers.png
    python tools/readme_picture.py FOLDER      # the same into another folder

The scene is ``scenes/teapot.toml``, and the layers are those of the shape ``genus3``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import ldtrefl
from ldtrefl.compare.layer_picture import draw_layers
from ldtrefl.scene import shapes

ROOT = Path(__file__).parent.parent
CROP = (slice(182, 342), slice(288, 528))
"""Rows and columns of the ray-traced picture that the inset shows: the reflections in the ball."""

FRAME = 3
"""Width of the inset's white frame, pixels."""

MAP_RESOLUTION = 192
"""Texels along a side of the layers' picture: it shall not be larger than the README is wide."""


def main() -> None:
    """Write both pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT / "docs", help="where the pictures go")
    folder = parser.parse_args().folder
    ldtrefl.save_image(folder / "teapot.png", picture_with_inset())
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


if __name__ == "__main__":
    main()
