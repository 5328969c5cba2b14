"""The tool that renders the README's pictures: an inset with a white frame in the corner, and the rest as rendered; and
pictures in rows, with white lines in between."""

import numpy as np
import pytest
import readme_picture

import ldtrefl
from ldtrefl.scene.stages import STAGES


def test_the_inset_is_the_ray_traced_picture() -> None:
    scene = ldtrefl.load_scene(readme_picture.ROOT / "scenes" / "teapot.toml")
    picture, truth = readme_picture.picture_with_inset(), ldtrefl.render(scene, "bvh").image[readme_picture.CROP]
    frame = readme_picture.FRAME
    height, width = truth.shape[0] + 2 * frame, truth.shape[1] + 2 * frame
    corner = picture[:height, -width:]
    np.testing.assert_array_equal(corner[frame:-frame, frame:-frame], truth)
    assert (corner[:frame] == 1.0).all() and (corner[:, -frame:] == 1.0).all()
    np.testing.assert_array_equal(picture[height:], ldtrefl.render(scene, "ldt").image[height:])


def test_pictures_of_mirrors_stand_in_rows_at_half_their_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stand-ins for the rendered pictures: the mean of 0, 1, 2 and 3 quarters is 0.375 of the brightness."""
    quarters = np.tile(np.array([[0.0, 0.25], [0.5, 0.75]], np.float32), (3, 2))[..., None].repeat(3, axis=2)
    brightness = {name: k / 6 for k, name in enumerate(sum(readme_picture.MIRRORS, ()))}
    monkeypatch.setattr(readme_picture, "rendered", lambda name, samples: quarters * np.float32(brightness[name]))
    picture, gap = readme_picture.picture_of_mirrors(), readme_picture.GAP
    assert picture.shape == (3 + gap + 3, 2 + gap + 2 + gap + 2, 3)
    for k in range(6):
        top, left = (3 + gap) * (k // 3), (2 + gap) * (k % 3)
        np.testing.assert_allclose(picture[top : top + 3, left : left + 2], 0.375 * k / 6, rtol=1e-6)
    assert (picture[3 : 3 + gap] == 1.0).all() and (picture[:, 2 : 2 + gap] == 1.0).all()
    for name in brightness:
        assert (readme_picture.ROOT / "scenes" / f"{name}.toml").is_file()


def test_pictures_of_stages_stand_in_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is that of its stage, rendered at twice its size."""
    monkeypatch.setattr(readme_picture, "STAGE_SIZE", (24, 16))
    picture, gap = readme_picture.picture_of_stages(), readme_picture.GAP
    assert picture.shape == (8, 3 * 12 + 2 * gap, 3)
    assert set(readme_picture.STAGES) < set(STAGES)
    pictures = [picture[:, left : left + 12] for left in (0, 12 + gap, 24 + 2 * gap)]
    assert (picture[:, 12 : 12 + gap] == 1.0).all() and all((one <= 1.0).all() and one.mean() < 0.6 for one in pictures)
    assert len({one.tobytes() for one in pictures}) == 3
