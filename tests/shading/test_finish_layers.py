"""How surfaces with a look reflect: the white furnace, Fresnel's reflectance, rays and what stands in their place."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import ldtrefl
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Reflection, Scene
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.surface_material import SurfaceMaterial, Texture
from ldtrefl.world.reflectance_table import COLUMNS, ROWS, reflectance_table
from tests.shading.facets import Facet
from tests.square import seen, square

WHITE = Environment(sky=(1, 1, 1), ground=(1, 1, 1))
GLTF = SurfaceMaterial(name="of a file", specular=1.0)
TURN = (1, -2, 3, 77)


@pytest.mark.parametrize("method", ["ldt", "bvh"])
@pytest.mark.parametrize("clearcoat", [0.0, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 0.4, 1.0])
def test_a_white_furnace_shows_one(metallic: float, clearcoat: float, method: str) -> None:
    """Light of 1 from everywhere, and a white surface: it is not to be told from what is around it."""
    ball = shapes.make("sphere", {"segments": [48, 24]})
    camera = Camera(eye=(0, -4, 0), look_at=(0, 0, 0), width=24, height=24, fov_y=32)
    for roughness, coat_roughness in itertools.product((0.0, 0.12, 0.25, 0.4, 0.7, 1.0), (0.0, 0.6)):
        varnish = {"clearcoat": clearcoat, "clearcoat_roughness": coat_roughness}
        material = replace(GLTF, metallic=metallic, roughness=roughness, **varnish)
        thing = Object(mesh=Mesh(ball.vertices, ball.faces, ball.normals, None, (Part(0, material),)))
        lit = Lighting(ambient=(1, 1, 1))
        image = ldtrefl.render(Scene(camera=camera, environment=WHITE, lighting=lit, objects=(thing,)), method).image
        np.testing.assert_allclose(image, 1.0, atol=0.02, err_msg=f"roughness {roughness}, {varnish}")


def schlick(low: np.ndarray, degrees: float) -> np.ndarray:
    return low + (1.0 - low) * (1.0 - np.cos(np.radians(degrees))) ** 5


@pytest.mark.parametrize("degrees", [0.0, 50.0, 80.0])
@pytest.mark.parametrize("method", ["ldt", "bvh"])
def test_smooth_metals_and_dielectrics_reflect_as_fresnel_says(degrees: float, method: str) -> None:
    """By rays where they reflect enough, and without where not: the environment is the same."""
    facet, base = Facet(TURN, 1.0, degrees), np.array([0.9, 0.5, 0.1])
    metal = facet.seen(Material(albedo=tuple(base), metallic=1.0), method, environment=WHITE)
    np.testing.assert_allclose(metal, schlick(base, degrees), rtol=1e-5)
    for ior in (1.0, 1.5, 2.4):
        glass = facet.seen(Material(albedo=0.0, ior=ior), method, environment=WHITE)
        low = np.full(3, ((ior - 1.0) / (ior + 1.0)) ** 2)
        np.testing.assert_allclose(glass, schlick(low, degrees), rtol=1e-5, atol=1e-7)
    half = facet.seen(Material(albedo=0.0, ior=1.5), method, environment=WHITE)
    mirror = facet.seen(Material(mirror=0.04, fresnel=True), method, environment=WHITE)
    np.testing.assert_allclose(half, mirror, rtol=1e-5)


def test_specular_of_a_file_scales_and_tints_the_dielectric() -> None:
    tint = np.array([1.0, 0.5, 0.25])
    mesh = square(replace(GLTF, base_color=(0, 0, 0), roughness=0.0, specular=0.5, specular_color=tuple(tint)))
    image = seen(mesh, environment=WHITE)
    np.testing.assert_allclose(image[4, 4], 0.5 * 0.04 * tint, rtol=1e-3)


def test_a_varnish_reflects_and_takes_away_what_is_beneath() -> None:
    mesh = square(replace(GLTF, specular=0.0, clearcoat=1.0, emission=(1.0, 1.0, 1.0), base_color=(0, 0, 0)))
    image = seen(mesh, environment=Environment(sky=(3, 3, 3), ground=(3, 3, 3)))
    np.testing.assert_allclose(image[4, 4], 0.04 * 3.0 + 0.96, rtol=1e-4)


def test_roughness_and_metallic_are_green_and_blue_of_their_texture() -> None:
    """A quarter rough and half metallic in the texture, times the numbers beside it."""
    both = Texture(StoredPicture(np.array([[[0, 128, 51]]], np.uint8)), is_data=True)
    given = replace(GLTF, base_color=(0.5, 0.5, 0.5), metallic=0.5, roughness=1.0)
    by_texture = seen(square(replace(given, metallic_roughness_texture=both)), environment=WHITE)
    plain = seen(square(replace(given, metallic=0.5 * 0.2, roughness=128 / 255)), environment=WHITE)
    np.testing.assert_allclose(by_texture, plain, rtol=1e-5)
    overridden = seen(
        square(replace(given, metallic_roughness_texture=both)), Material(metallic=1.0), environment=WHITE
    )
    plain = seen(square(replace(given, metallic=1.0, roughness=128 / 255)), environment=WHITE)
    np.testing.assert_allclose(overridden, plain, rtol=1e-5)


def before_a_wall(material: Material, degrees: float, **reflection: float) -> np.ndarray:
    """What a floor shows of a glowing wall that fills all that can be mirrored, seen at an angle to the normal."""
    angle = np.radians(degrees)
    camera = Camera(
        eye=(0.0, -np.sin(angle), np.cos(angle)), look_at=(0, 0, 0), up=(1, 0, 0), width=3, height=3, fov_y=0.5
    )
    glow = Object(shape="room", scale=20.0, material=Material(albedo=0.0, emission=(1.0, 0.0, 0.0)))
    floor = Object(shape="plane", material=material)
    scene = Scene(
        camera=camera,
        environment=Environment(sky=(0, 1, 0), ground=(0, 1, 0)),
        lighting=Lighting(ambient=(0, 0, 0)),
        objects=(floor, glow),
        reflection=Reflection(**reflection),
    )
    return ldtrefl.render(scene, "bvh").image[1, 1]


def test_rays_are_sent_where_much_is_reflected_sharply() -> None:
    """The wall is red, and the environment that stands in place of rays is green."""
    plastic, low = Material(albedo=0.0, ior=1.5), np.full(3, 0.04)
    np.testing.assert_allclose(before_a_wall(plastic, 10.0), schlick(low, 10.0) * [0, 1, 0], rtol=1e-4)
    np.testing.assert_allclose(before_a_wall(plastic, 75.0), schlick(low, 75.0) * [1, 0, 0], rtol=1e-4)
    np.testing.assert_allclose(before_a_wall(plastic, 10.0, threshold=0.01), schlick(low, 10.0) * [1, 0, 0], rtol=1e-4)
    np.testing.assert_allclose(before_a_wall(plastic, 75.0, threshold=0.9), schlick(low, 75.0) * [0, 1, 0], rtol=1e-4)
    sharp, rough = (before_a_wall(Material(metallic=1.0, roughness=r), 10.0) for r in (0.25, 0.3))
    assert sharp[0] > 0.5 and sharp[1] == 0.0 and rough[0] == 0.0 and rough[1] > 0.5
    assert before_a_wall(Material(metallic=1.0, roughness=0.3), 10.0, rough_limit=0.5)[0] > 0.5
    assert before_a_wall(Material(mirror=0.01, roughness=0.1), 10.0)[0] > 0.0, "a mirror of the scene always does"


@pytest.mark.parametrize("roughness", [0.3, 0.5, 1.0])
def test_rough_metals_blur_the_environment(roughness: float) -> None:
    """Two colours by their closed form, and the same as a picture."""
    row = reflectance_table().reshape(ROWS, COLUMNS, 3)[:, -1]
    sky, ground = np.array([1.0, 0.5, 0.0]), np.array([0.0, 0.5, 2.0])
    at = roughness * (ROWS - 1)
    cosine = np.interp(at, np.arange(ROWS), row[:, 2])
    blend = 0.5 + 0.5 * cosine
    facet = Facet((0, 0, 1, 0), 1.0, 0.0)
    given = Environment(sky=tuple(sky), ground=tuple(ground))
    material = Material(albedo=1.0, metallic=1.0, roughness=roughness)
    # Up is y there, and the facet looks along z: across the sky, where both count alike.
    np.testing.assert_allclose(facet.seen(material, environment=given), 0.5 * (sky + ground), rtol=1e-4)
    camera = Camera(eye=(0, -0.01, 2), look_at=(0, 0, 0), up=(0, 0, 1), width=1, height=1, fov_y=0.1)
    floor = Object(shape="plane", material=material)
    scene = Scene(camera=camera, environment=given, lighting=Lighting(ambient=(0, 0, 0)), objects=(floor,))
    image = ldtrefl.render(scene, "bvh").image[0, 0]
    np.testing.assert_allclose(image, blend * sky + (1.0 - blend) * ground, rtol=1e-3)
    pictured = Environment(image="any")
    z = np.cos((np.arange(256) + 0.5) / 256 * np.pi)[:, None, None]
    pixels = np.broadcast_to((0.5 + 0.5 * z) * sky + (0.5 - 0.5 * z) * ground, (256, 512, 3)).astype(np.float32)
    pictured.__dict__["picture"] = StoredPicture(np.ascontiguousarray(pixels))  # as if it had been read
    image = ldtrefl.render(replace(scene, environment=pictured), "bvh").image[0, 0]
    np.testing.assert_allclose(image, blend * sky + (1.0 - blend) * ground, rtol=0.02, atol=5e-3)
