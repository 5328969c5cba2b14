"""What is cut out and what is seen through, in closed forms: for the camera, for rays, and for light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ldtrefl
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Reflection, Scene
from ldtrefl.scene.surface_material import SurfaceMaterial, Texture
from tests.square import CORNERS, FACES, UVS, square

METHODS = ["ldt", "bvh"]
DARK = Environment(sky=(0, 0, 0), ground=(0, 0, 0))
WHITE = Lighting(ambient=(1, 1, 1))
RED = SurfaceMaterial(name="red", base_color=(1, 0, 0), alpha=0.25, alpha_mode="blend")
GREEN, BLUE = Material(albedo=(0, 1, 0)), Material(albedo=(0, 0, 1))
EMPTY = Environment(sky=(0.2, 0.2, 0.2), ground=(0.2, 0.2, 0.2))


def seen_from_above(*objects: Object, size: int = 1, method: str = "bvh", **scene: object) -> np.ndarray:
    """(h, w, 3) what a camera sees that looks down along z at the middle, 0.02 wide."""
    camera = Camera(eye=(0, 0, 10), look_at=(0, 0, 0), up=(0, 1, 0), width=size, height=size, fov_y=0.1)
    given = {"environment": EMPTY, "lighting": WHITE, **scene}
    return ldtrefl.render(Scene(camera=camera, objects=objects, **given), method).image


def sheet(material: SurfaceMaterial, z: float, own: Material | None = None, **more: np.ndarray) -> Object:
    return Object(mesh=square(material, **more), translate=(0, 0, z), material=Material() if own is None else own)


@pytest.mark.parametrize("method", METHODS)
def test_sheets_blend_in_their_order(method: str) -> None:
    """Each takes its share of what the ones before it let through, whatever the order of the objects."""
    floor, blue = Object(shape="plane", material=GREEN), replace(RED, base_color=(0, 0, 1), alpha=0.5)
    expected = np.array([0.25, 0.75 * 0.5, 0.75 * 0.5])
    for objects in ((floor, sheet(RED, 2.0), sheet(blue, 1.0)), (sheet(blue, 1.0), sheet(RED, 2.0), floor)):
        np.testing.assert_allclose(seen_from_above(*objects, method=method)[0, 0], expected, rtol=1e-5)
    behind = seen_from_above(sheet(RED, 2.0), sheet(blue, 1.0), method=method)
    np.testing.assert_allclose(behind[0, 0], np.array([0.25, 0, 0.75 * 0.5]) + 0.75 * 0.5 * 0.2, rtol=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_both_sides_of_a_closed_object_are_passed(method: str) -> None:
    """The rear wall is met from inside, through the object's own front."""
    box = ldtrefl.scene.shapes.make("box", {})
    mesh = ldtrefl.Mesh(box.vertices, box.faces, None, None, (ldtrefl.scene.mesh.Part(0, RED),))
    image = seen_from_above(Object(mesh=mesh), Object(shape="plane", scale=3, translate=(0, 0, -2), material=GREEN))
    np.testing.assert_allclose(image[0, 0], [0.25 + 0.75 * 0.25, 0.75 * 0.75, 0.0], rtol=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_what_is_cut_out_is_not_there(method: str) -> None:
    """Left of the middle alpha is 0, right of it 1; the texture's nearest texel says so."""
    alpha = Texture(StoredPicture(np.full((1, 2, 3), 255, np.uint8), np.array([[0, 255]], np.uint8)), is_nearest=True)
    cut = replace(RED, alpha=1.0, alpha_mode="mask", base_texture=alpha)
    image = seen_from_above(sheet(cut, 1.0), Object(shape="plane", material=GREEN), size=2, method=method)
    np.testing.assert_allclose(image[:, 0], [[0, 1, 0]] * 2, rtol=1e-5)
    np.testing.assert_allclose(image[:, 1], [[1, 0, 0]] * 2, rtol=1e-5)
    for cutoff, red in ((0.24, 1.0), (0.26, 0.0)):
        masked = sheet(replace(RED, alpha_mode="mask", alpha_cutoff=cutoff), 1.0)
        image = seen_from_above(masked, Object(shape="plane", material=GREEN), method=method)
        np.testing.assert_allclose(image[0, 0], [red, 1.0 - red, 0.0], rtol=1e-5)


def test_alpha_of_vertices_multiplies() -> None:
    colors = np.array([[1, 1, 1, 0.5]] * 4)
    image = seen_from_above(sheet(RED, 1.0, colors=colors), Object(shape="plane", material=GREEN))
    np.testing.assert_allclose(image[0, 0], [0.125, 0.875, 0.0], rtol=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_reflected_rays_go_on_behind(method: str) -> None:
    """A mirror shows the sheet above it, and through that the ceiling. The camera sees the mirror from beside."""
    camera = Camera(eye=(3, 0, 3), look_at=(0, 0, 0), width=1, height=1, fov_y=0.1)
    mirror = Object(shape="plane", scale=0.5, material=Material(mirror=1.0))
    above = Object(mesh=square(RED), translate=(-1, 0, 1), scale=0.5)
    ceiling = Object(shape="plane", translate=(-2, 0, 2), scale=0.5, material=GREEN)
    scene = Scene(camera=camera, environment=DARK, lighting=WHITE, objects=(mirror, above, ceiling))
    np.testing.assert_allclose(ldtrefl.render(scene, method).image[0, 0], [0.25, 0.75, 0], rtol=1e-5)
    one = replace(scene, reflection=Reflection(max_bounces=1), environment=EMPTY)
    np.testing.assert_allclose(ldtrefl.render(one, method).image[0, 0], [0.25 + 0.15, 0.15, 0.15], rtol=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_light_passes_what_is_cut_out_and_is_dimmed_by_what_blends(method: str) -> None:
    """Two sheets between a light and the floor; the camera sees the floor beneath them from the side."""
    camera = Camera(eye=(0, -3, 0.3), look_at=(0, 0, 0), width=1, height=1, fov_y=0.1)
    light = Light(kind="directional", direction=(0, 0, -1), radiance=(1, 1, 1))
    lit = Lighting(ambient=(0, 0, 0), shadows=True)
    floor = Object(shape="plane", scale=5.0, material=Material(albedo=1.0))
    cut = replace(RED, alpha_mode="mask")
    for sheets, share in (
        ((sheet(RED, 1.0), sheet(replace(RED, alpha=0.5), 2.0)), 0.75 * 0.5),
        ((sheet(cut, 1.0), sheet(RED, 2.0)), 0.75),
        ((sheet(replace(cut, alpha_cutoff=0.1), 1.0),), 0.0),
        ((sheet(RED, 1.0), Object(shape="plane", translate=(0, 0, 2))), 0.0),
    ):
        scene = Scene(camera=camera, environment=DARK, lighting=lit, lights=(light,), objects=(floor, *sheets))
        np.testing.assert_allclose(ldtrefl.render(scene, method).image[0, 0], share, rtol=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_light_passes_all_layers_of_one_object(method: str) -> None:
    """Four sheets that are one mesh, the lowest of which is seen itself from above."""
    heights = np.arange(4.0)
    vertices = np.concatenate([CORNERS + np.array([0, 0, z]) for z in heights])
    faces = np.concatenate([FACES + 4 * k for k in range(4)])
    mesh = ldtrefl.Mesh(vertices, faces, None, np.tile(UVS, (4, 1)), (ldtrefl.scene.mesh.Part(0, RED),))
    light = Light(kind="directional", direction=(0, 0, -1), radiance=(1, 1, 1))
    lit = Lighting(ambient=(0, 0, 0), shadows=True)
    image = seen_from_above(Object(mesh=mesh), method=method, lights=(light,), lighting=lit, environment=DARK)
    # Each shows its quarter, through those above it, of the light that those above it leave.
    expected = sum(0.25 * 0.75**k * 0.75**k for k in range(4))
    np.testing.assert_allclose(image[0, 0], [expected, 0, 0], rtol=1e-5)


def test_a_ray_takes_the_heavier_of_two_ways_and_the_environment_stands_for_the_other() -> None:
    """A mirror of 0.8 that covers a half lets more through than it mirrors; one that covers 0.9 mirrors more."""
    half = SurfaceMaterial(name="half", alpha=0.5, alpha_mode="blend")
    floor = Object(shape="plane", scale=2.0, material=GREEN)
    above = Object(shape="plane", scale=2.0, translate=(0, 0, 20), rotate=(1, 0, 0, 180), material=BLUE)
    own = Material(mirror=0.8)
    image = seen_from_above(sheet(half, 1.0, own), floor, above)
    np.testing.assert_allclose(image[0, 0], [0.08, 0.5 + 0.08, 0.08], rtol=1e-4)
    image = seen_from_above(sheet(replace(half, alpha=0.9), 1.0, own), floor, above)
    np.testing.assert_allclose(image[0, 0], [0.02, 0.02, 0.72 + 0.02], rtol=1e-4)
