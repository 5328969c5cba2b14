"""Which objects have a look, and what the scene overrides of it."""

from dataclasses import replace

import numpy as np
import pytest

from ldtrefl.base.errors import InputError
from ldtrefl.device import launch
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.description import Camera, Material, Object, Reflection, Scene
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.surface_material import PLAIN, SurfaceMaterial, Texture
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.looks import has_material, is_mirror, mesh_needs_look, overridden
from tests.square import CORNERS, FACES, seen, square

PICTURE = StoredPicture(np.full((1, 1, 3), 128, np.uint8))
GLTF = SurfaceMaterial(name="of a file", base_color=(0.5, 0.25, 1.0), emission=(1.0, 2.0, 3.0))


@pytest.mark.parametrize(
    ("material", "needs"),
    [
        (PLAIN, False),
        (SurfaceMaterial(base_color=(0.1, 0.2, 0.3), double_sided=False, alpha=0.5), False),
        (SurfaceMaterial(base_texture=Texture(PICTURE)), False),
        (SurfaceMaterial(base_texture=Texture(PICTURE, wrap=("clamp", "repeat"))), True),
        (SurfaceMaterial(base_texture=Texture(PICTURE, is_nearest=True)), True),
        (SurfaceMaterial(emission=(0.0, 0.1, 0.0)), True),
        (SurfaceMaterial(is_unlit=True), True),
        (SurfaceMaterial(normal_texture=Texture(PICTURE, is_data=True)), True),
    ],
)
def test_only_what_is_more_than_colours_needs_a_look(material: SurfaceMaterial, needs: bool) -> None:
    assert mesh_needs_look(square(material)) == needs


def test_colours_of_vertices_are_a_look() -> None:
    mesh = square(PLAIN, colors=np.ones((4, 4)))
    assert mesh_needs_look(mesh) and has_material(mesh) and not has_material(square(PLAIN))


def test_albedo_is_one_for_a_files_material_and_less_without_any() -> None:
    """0.8 for things without a material, and what is given times the file's base colour."""
    diffuse, more = SurfaceMaterial(base_color=(0.5, 0.25, 1.0)), replace(GLTF, emission=(0.0, 0.0, 0.0))
    for material in (diffuse, replace(more, is_unlit=True), more):
        np.testing.assert_allclose(seen(square(material))[0, 0], [0.5, 0.25, 1.0], rtol=1e-6)
        np.testing.assert_allclose(seen(square(material), Material(albedo=0.5))[0, 0], [0.25, 0.125, 0.5], rtol=1e-6)
    np.testing.assert_allclose(seen(square(PLAIN))[0, 0], [0.8, 0.8, 0.8], rtol=1e-6)


def test_what_is_given_overrides_all_parts_and_what_is_not_leaves_them() -> None:
    assert overridden(GLTF, Material(), is_of_file=True).emission == GLTF.emission
    assert overridden(GLTF, Material(emission=0.0), is_of_file=True).emission == (0.0, 0.0, 0.0)
    other = Texture(PICTURE, is_nearest=True)
    made = overridden(
        replace(GLTF, base_texture=other, emission_texture=other), Material(emission=7.0), is_of_file=True
    )
    assert made.emission == (7.0, 7.0, 7.0) and made.emission_texture is None and made.base_texture is other
    assert overridden(GLTF, Material(mirror=0.5), is_of_file=True).base_color == (0.0, 0.0, 0.0), "as mirrors are"


def test_each_part_has_its_own_material() -> None:
    parts = (Part(0, GLTF), Part(1, replace(GLTF, base_color=(0.0, 1.0, 0.0), emission=(0.0, 0.0, 0.0))))
    image = seen(Mesh(CORNERS, FACES, parts=parts))
    np.testing.assert_allclose(image[-1, -1], [1.5, 2.25, 4.0], rtol=1e-6)  # the lower right is the first triangle
    np.testing.assert_allclose(image[0, 0], [0.0, 1.0, 0.0], rtol=1e-6)


def test_what_is_said_of_a_part_counts_in_its_place() -> None:
    red = SurfaceMaterial(name="red paint", base_color=(1.0, 0.0, 0.0))
    parts = (Part(0, red), Part(1, SurfaceMaterial(name="chrome", base_color=(0.0, 1.0, 0.0))))
    told = {"c*": Material(albedo=(0.0, 0.5, 0.0), emission=(0.0, 0.0, 2.0)), "*": Material(albedo=0.0)}
    for names, upper, lower in (
        (("c*",), [0.0, 0.5, 2.0], [1.0, 0.0, 0.0]),
        (("c*", "*"), [0.0, 0.5, 2.0], [0.0, 0.0, 0.0]),
        ((), [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]),
    ):
        image = seen(Mesh(CORNERS, FACES, parts=parts), parts={name: told[name] for name in names})
        np.testing.assert_allclose(image[0, 0], upper, atol=1e-6)
        np.testing.assert_allclose(image[-1, -1], lower, atol=1e-6)


def test_a_texture_of_the_scene_needs_texture_coordinates_and_one_of_a_file_does_without() -> None:
    textured = replace(GLTF, base_texture=Texture(PICTURE))
    np.testing.assert_allclose(seen(square(textured, None))[0, 0], [1.5, 2.25, 4.0], rtol=1e-6)
    given = Material(texture="any.png")
    given.__dict__["picture"] = PICTURE  # as if it had been read
    with pytest.raises(InputError, match="no texture coordinates"):
        seen(square(GLTF, None), given)


@pytest.mark.parametrize(
    ("material", "own", "expected"),
    [
        (PLAIN, Material(), False),
        (PLAIN, Material(mirror=0.5), True),
        (PLAIN, Material(metallic=1.0), True),
        (PLAIN, Material(metallic=1.0, roughness=0.5), False),
        (replace(GLTF, metallic=1.0, roughness=0.1), Material(), True),
        (replace(GLTF, metallic=1.0, roughness=0.1, is_unlit=True), Material(), False),
        (replace(GLTF, metallic=1.0, roughness=1.0), Material(), False),
        (replace(GLTF, metallic=1.0, roughness=1.0), Material(roughness=0.0), True),
        (replace(GLTF, clearcoat=1.0), Material(), True),
        (replace(GLTF, alpha_mode="blend", alpha=0.5), Material(), False),
    ],
)
def test_mirrors_are_known_by_scene_and_file(material: SurfaceMaterial, own: Material, expected: bool) -> None:
    """As rays are sent from it: those that go straight on through what blends are not mirrored."""
    entry = Object(mesh=square(material), material=own)
    assert is_mirror(entry, Reflection()) is expected
    scene = Scene(camera=Camera(eye=(0, 0, 5), look_at=(0, 0, 0), up=(0, 1, 0)), objects=(entry,))
    (sends_rays,) = DeviceScene(scene, launch.resolve_device(None)).is_reflector.tolist()
    assert sends_rays is (expected or material.alpha_mode == "blend")


def test_parts_that_a_mesh_does_not_have_make_no_mirror_of_it() -> None:
    for name, expected in (("of*", True), ("glass", False)):
        entry = Object(mesh=square(GLTF), parts={name: Material(mirror=0.9)})
        assert is_mirror(entry, Reflection()) is expected and entry.is_reflector is expected
