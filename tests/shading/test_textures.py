"""Textures against bilinear interpolation by hand, and means over what pixels cover against closed forms."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.description import Camera, Lighting, Material, Object, Scene
from tests.shading.facets import SIZES, TURNS, Facet


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_textures_are_bilinear_between_texel_centres(tmp_path: Path, turn: tuple, size: object) -> None:
    """A row of texels 0, 1, 0, 0 on a plane: the middle lies half-way between the second and the third."""
    picture = np.zeros((1, 4, 3), np.float32)
    picture[0, 1] = [1.0, 0.5, 0.25]
    ldtrefl.save_image(tmp_path / "row.exr", picture)
    material = Material(albedo=(1, 1, 0.5), texture=str(tmp_path / "row.exr"))
    image = Facet(turn, size, 20.0, up_the=1).seen(material, lighting=Lighting(ambient=(1, 1, 1)))
    np.testing.assert_allclose(image, [0.5, 0.25, 0.0625], rtol=1e-6)  # the camera looks at the middle itself


def seen_from_afar(picture: np.ndarray, distance: float, path: Path, **options: object) -> np.ndarray:
    """(h, w, 3) a plane of sides 2 with a picture, seen from above through an image whose middle pixel sees (0, 0)."""
    ldtrefl.save_image(path / "picture.exr", picture.astype(np.float32))
    material = Material(albedo=1.0, texture=str(path / "picture.exr"))
    camera = Camera(eye=(0, 0, distance), look_at=(0, 0, 0), up=(0, 1, 0), width=9, height=9, fov_y=10.0)
    scene = Scene(
        camera=camera,
        objects=(Object(shape="plane", material=material),),
        lighting=Lighting(ambient=(1, 1, 1)),
    )
    return ldtrefl.render(scene, "bvh", filter_textures=True, samples=1, **options).image


def test_a_pixel_that_covers_the_whole_checker_is_its_mean(tmp_path: Path) -> None:
    checker = (np.indices((24, 40)).sum(axis=0) % 2)[..., None] * [1.0, 0.5, 0.25]
    image = seen_from_afar(checker, 400.0, tmp_path)
    np.testing.assert_allclose(image[4, 4], [0.5, 0.25, 0.125], rtol=1e-5)


@pytest.mark.parametrize("anisotropy", [1, 16])
def test_a_ramp_is_itself_however_it_is_filtered(tmp_path: Path, anisotropy: int) -> None:
    """Means over what lies evenly about a point of a ramp are the ramp there; far from the ramp's ends."""
    texels = 256
    ramp = ((np.arange(texels) + 0.5) / texels)[None, :, None] * np.ones((texels, 1, 3))
    distance = 3.0
    image = seen_from_afar(ramp, distance, tmp_path, anisotropy=anisotropy)
    pixel = 2.0 * distance * np.tan(np.radians(5.0)) / 9
    assert pixel * texels / 2 > 4.0, "pixels cover several texels"
    expected = 0.5 + (np.arange(9) - 4) * pixel / 2
    np.testing.assert_allclose(image[:, :, 0], np.broadcast_to(expected, (9, 9)), atol=2e-6)


def test_a_texture_that_is_near_is_not_blurred(tmp_path: Path) -> None:
    checker = (np.indices((8, 8)).sum(axis=0) % 2)[..., None] * np.ones(3)
    near = seen_from_afar(checker, 0.2, tmp_path)
    scene = Scene(
        camera=Camera(eye=(0, 0, 0.2), look_at=(0, 0, 0), up=(0, 1, 0), width=9, height=9, fov_y=10.0),
        objects=(Object(shape="plane", material=Material(albedo=1.0, texture=str(tmp_path / "picture.exr"))),),
        lighting=Lighting(ambient=(1, 1, 1)),
    )
    np.testing.assert_allclose(near, ldtrefl.render(scene, "bvh", samples=1).image, atol=2e-6)


def test_a_filter_that_is_long_one_way_stays_short_the_other(tmp_path: Path) -> None:
    """Stripes that run away from a grazing camera are seen sharp by many probes, and blurred by one."""
    stripes = ((np.arange(256) // 16) % 2)[None, :, None] * np.ones((256, 1, 3))
    ldtrefl.save_image(tmp_path / "stripes.exr", stripes.astype(np.float32))
    material = Material(albedo=1.0, texture=str(tmp_path / "stripes.exr"))
    camera = Camera(eye=(0, -0.9, 0.012), look_at=(0, 0, 0), width=64, height=1, fov_y=0.5)
    scene = Scene(
        camera=camera,
        objects=(Object(shape="plane", material=material),),
        lighting=Lighting(ambient=(1, 1, 1)),
    )
    spread = [
        np.ptp(ldtrefl.render(scene, "bvh", filter_textures=True, samples=1, anisotropy=n).image) for n in (1, 16)
    ]
    assert spread[0] < 0.2 and spread[1] > 0.95, spread
