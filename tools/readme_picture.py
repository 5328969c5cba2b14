"""Renders the README's pictures: a scene by layered depth textures with the ray-traced truth inset, and peeled layers.

python tools/readme_picture.py [FOLDER]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import ldtrefl
from ldtrefl.compare.layer_picture import draw_layers
from ldtrefl.scene import shapes

ROOT = Path(__file__).parent.parent
CROP = (slice(182, 342), slice(288, 528))
"""Rows and columns of the truth that the inset shows: the ball's reflections."""
FRAME = 3
"""Pixels of the inset's white frame."""


def main() -> None:
    """Write teapot.png and layers.png."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs"
    scene = ldtrefl.load_scene(ROOT / "scenes" / "teapot.toml")
    picture = ldtrefl.render(scene, "ldt").image.copy()
    inset = ldtrefl.render(scene, "bvh").image[CROP]
    height, width = inset.shape[:2]
    framed = np.ones((height + 2 * FRAME, width + 2 * FRAME, 3), np.float32)
    framed[FRAME:-FRAME, FRAME:-FRAME] = inset
    picture[: framed.shape[0], -framed.shape[1] :] = framed
    ldtrefl.save_image(folder / "teapot.png", picture)
    shape = shapes.make("genus3")
    ldtrefl.save_image(folder / "layers.png", draw_layers(ldtrefl.peel(shape.vertices, shape.faces, resolution=192)))


if __name__ == "__main__":
    main()
