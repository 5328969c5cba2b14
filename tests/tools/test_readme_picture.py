"""The tool that renders the README's pictures: an inset with a white frame in the corner, and the rest as rendered."""

import numpy as np
import readme_picture

import ldtrefl


def test_the_inset_is_the_ray_traced_picture() -> None:
    scene = ldtrefl.load_scene(readme_picture.ROOT / "scenes" / "teapot.toml")
    picture, truth = readme_picture.picture_with_inset(), ldtrefl.render(scene, "bvh").image[readme_picture.CROP]
    frame = readme_picture.FRAME
    height, width = truth.shape[0] + 2 * frame, truth.shape[1] + 2 * frame
    corner = picture[:height, -width:]
    np.testing.assert_array_equal(corner[frame:-frame, frame:-frame], truth)
    assert (corner[:frame] == 1.0).all() and (corner[:, -frame:] == 1.0).all()
    np.testing.assert_array_equal(picture[height:], ldtrefl.render(scene, "ldt").image[height:])
