"""What looks make of surfaces, against closed forms: pictures as they are laid, colours of vertices, normal maps."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from ldtrefl.files.srgb import linear_from_srgb
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.description import Environment, Light, Lighting, Material
from ldtrefl.scene.surface_material import SurfaceMaterial, Texture, Wrap
from tests.square import UVS, places, seen, square

WRAPS: tuple[Wrap, ...] = ("repeat", "clamp", "mirror")
TURNED = (1.7, 0.6, -0.9, -0.5, 2.1, 0.35)
"""A picture that is turned, scaled and moved, and goes round more than once."""

GLTF = SurfaceMaterial(metallic=0.0, roughness=1.0)


def picture(height: int = 3, width: int = 5, seed: int = 1) -> StoredPicture:
    return StoredPicture(np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8))


def wrapped(i: np.ndarray, count: int, wrap: Wrap) -> np.ndarray:
    """glTF's samplers, by OpenGL's definitions."""
    if wrap == "clamp":
        return np.clip(i, 0, count - 1)
    if wrap == "repeat":
        return i % count
    period = i % (2 * count)
    return np.where(period < count, period, 2 * count - 1 - period)


def sampled(pixels: np.ndarray, texture: Texture, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(h, w, 3) linear pixels where a texture reads them; v = 0 at the top row."""
    a, b, c, d, e, f = texture.transform
    height, width = pixels.shape[:2]
    x, y = (a * u + b * v + c) * width, (d * u + e * v + f) * height

    def at(column: np.ndarray, row: np.ndarray) -> np.ndarray:
        rows = wrapped(row.astype(int), height, texture.wrap[1])
        return pixels[rows, wrapped(column.astype(int), width, texture.wrap[0])]

    if texture.is_nearest:
        return at(np.floor(x), np.floor(y))
    left, top = np.floor(x - 0.5), np.floor(y - 0.5)
    right, low = (x - 0.5 - left)[..., None], (y - 0.5 - top)[..., None]
    upper = (1 - right) * at(left, top) + right * at(left + 1, top)
    lower = (1 - right) * at(left, top + 1) + right * at(left + 1, top + 1)
    return (1 - low) * upper + low * lower


@pytest.mark.parametrize("wrap", list(itertools.product(WRAPS, WRAPS)), ids="-".join)
@pytest.mark.parametrize("is_nearest", [False, True], ids=["blended", "nearest"])
def test_pictures_are_laid_as_their_textures_say(wrap: tuple[Wrap, Wrap], is_nearest: bool) -> None:
    stored = picture()
    texture = Texture(stored, wrap=wrap, is_nearest=is_nearest, transform=TURNED)
    x, y = places()
    expected = sampled(linear_from_srgb(stored.pixels / 255.0), texture, (x + 1) / 2, (1 - y) / 2)
    image = seen(square(replace(GLTF, base_texture=texture)))
    np.testing.assert_allclose(image, expected, atol=2e-3)  # rays are parallel to a thousandth


def test_second_uvs_and_bytes_that_are_fractions() -> None:
    stored, second = picture(), 1.5 * UVS[:, ::-1] + 0.2
    texture = Texture(stored, uv_set=1, is_data=True)
    x, y = places()
    expected = sampled(stored.pixels / 255.0, texture, 1.5 * (y + 1) / 2 + 0.2, 1.0 - (1.5 * (x + 1) / 2 + 0.2))
    image = seen(square(replace(GLTF, base_texture=texture), second_uvs=second))
    np.testing.assert_allclose(image, expected, atol=2e-3)


def test_colours_of_vertices_are_interpolated_and_multiply() -> None:
    colors = np.array([[0.0, 0.0, 1.0, 1], [1.0, 0.0, 0.5, 1], [1.0, 1.0, 0.0, 1], [0.0, 1.0, 0.5, 1]])
    x, y = places()
    u, v = (x + 1) / 2, (y + 1) / 2
    expected = np.stack([u, v, (2 - u - v) / 2], axis=-1) * [0.5, 1.0, 0.25]
    image = seen(square(SurfaceMaterial(base_color=(0.5, 1.0, 0.25)), None, colors=colors))
    np.testing.assert_allclose(image, expected, atol=1e-3)


def test_emission_and_what_is_unlit() -> None:
    grey = Texture(StoredPicture(np.full((1, 1, 3), 0.5, np.float32)))
    glowing = replace(GLTF, base_color=(0.2, 0.2, 0.2), emission=(4.0, 2.0, 1.0), emission_texture=grey)
    np.testing.assert_allclose(seen(square(glowing))[0, 0], [2.2, 1.2, 0.7], rtol=1e-5)
    unlit = replace(GLTF, base_color=(0.1, 0.2, 0.3), is_unlit=True, emission=(1.0, 1.0, 1.0))
    light = Light(kind="directional", direction=(0, 0, -1), radiance=(5, 5, 5))
    np.testing.assert_allclose(seen(square(unlit), lights=(light,))[0, 0], [0.1, 0.2, 0.3], rtol=1e-5)
    # What the scene says counts: its emission is added, and a mirror or a metal is no longer unlit.
    glowing = seen(square(unlit), Material(emission=(1.0, 0.0, 2.0)), lights=(light,))
    np.testing.assert_allclose(glowing[0, 0], [1.1, 0.2, 2.3], rtol=1e-5)
    around = Environment(sky=(0.4, 0.4, 0.4), ground=(0.4, 0.4, 0.4))
    mirrored = seen(square(unlit), Material(mirror=0.5), environment=around)
    np.testing.assert_allclose(mirrored[0, 0], [0.2] * 3, rtol=1e-5)
    metal = seen(square(unlit), Material(metallic=1.0, roughness=0.0), environment=around)
    np.testing.assert_allclose(metal[0, 0], [0.04, 0.08, 0.12], rtol=2e-2)


def test_occlusion_dims_ambient_light_alone() -> None:
    half = Texture(StoredPicture(np.full((1, 1, 3), 51, np.uint8)), is_data=True)
    material = replace(GLTF, occlusion_texture=half, occlusion_strength=0.5)
    light = Light(kind="directional", direction=(0, 0, -1), radiance=(0.25, 0.25, 0.25))
    image = seen(square(material), lights=(light,))
    np.testing.assert_allclose(image[0, 0], 1.0 + 0.5 * (0.2 - 1.0) + 0.25, rtol=1e-5)


def tilted(x: float, y: float) -> Texture:
    """A normal map of one normal, as floats that are fractions."""
    z = np.sqrt(1.0 - x * x - y * y)
    encoded = (np.array([x, y, z]) + 1.0) / 2.0
    return Texture(StoredPicture(linear_from_srgb(encoded[None, None])), is_data=True)


LAID = [
    ("upright", UVS, {}, (1, 0, 0), (0, 1, 0)),
    ("mirrored", UVS * [-1, 1], {}, (-1, 0, 0), (0, 1, 0)),
    ("a quarter turn", UVS[:, ::-1] * [-1, 1], {}, (0, -1, 0), (1, 0, 0)),
    ("tangents", UVS, {"tangents": np.tile([0.0, 1.0, 0.0, 1.0], (4, 1))}, (0, 1, 0), (-1, 0, 0)),
    ("tangents, mirrored", UVS, {"tangents": np.tile([0.0, 1.0, 0.0, -1.0], (4, 1))}, (0, 1, 0), (1, 0, 0)),
]
"""Texture coordinates, and the ways in which their pictures run to the right and up."""


@pytest.mark.parametrize(("uvs", "more", "right", "up"), [row[1:] for row in LAID], ids=[row[0] for row in LAID])
@pytest.mark.parametrize("from_below", [False, True])
def test_normal_maps_tilt_to_the_right_and_up(
    uvs: np.ndarray, more: dict, right: tuple, up: tuple, from_below: bool
) -> None:
    """Light shows the cosine with ``x right + y up + z normal``; from behind all of that is turned around."""
    x, y = 0.5, 0.3
    normal = x * np.array(right) + y * np.array(up) + np.sqrt(1 - x * x - y * y) * np.array([0, 0, 1])
    side = -1.0 if from_below else 1.0
    mesh = square(replace(GLTF, normal_texture=tilted(x, y)), uvs, **more)
    for towards in ([0, 0, 1], [0.6, 0, 0.8], [0, 0.6, 0.8]):
        light = Light(kind="directional", direction=tuple(-side * np.array(towards, float)), radiance=(1, 1, 1))
        image = seen(mesh, from_below=from_below, lights=(light,), lighting=Lighting(ambient=(0, 0, 0)))
        np.testing.assert_allclose(image, max(0.0, float(normal @ towards)), atol=1e-4)


def test_a_mapped_normal_stays_on_the_facets_side() -> None:
    """A map that tilts beyond the horizon leaves the surface lit from just above it."""
    encoded = np.array([[[1.0, 0.5, 0.0]]])  # (1, 0, -1): below
    below = Texture(StoredPicture(linear_from_srgb(encoded)), is_data=True)
    light = Light(kind="directional", direction=(0, 0, -1), radiance=(1, 1, 1))
    mesh = square(replace(GLTF, normal_texture=below))
    image = seen(mesh, lights=(light,), lighting=Lighting(ambient=(0, 0, 0)))
    assert (image > 0.0).all() and (image < 0.05).all()


def test_the_scale_of_a_normal_map_tilts_less() -> None:
    x = 0.6
    tangent = 0.5 * x / 0.8
    mesh = square(replace(GLTF, normal_texture=tilted(x, 0.0), normal_scale=0.5))
    light = Light(kind="directional", direction=(0, 0, -1), radiance=(1, 1, 1))
    image = seen(mesh, lights=(light,), lighting=Lighting(ambient=(0, 0, 0)))
    np.testing.assert_allclose(image, 1.0 / np.sqrt(1.0 + tangent * tangent), atol=1e-4)


def test_albedo_is_times_what_the_file_says() -> None:
    stored = picture()
    material = replace(GLTF, base_texture=Texture(stored, wrap=("mirror", "clamp"), transform=TURNED))
    np.testing.assert_allclose(seen(square(material), Material(albedo=0.5)), 0.5 * seen(square(material)), atol=1e-6)
