"""What is single-sided is not there from behind, in closed forms: for the camera, for rays, and not for light."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.compare.metrics.structural_similarity import ssim
from ldtrefl.device import launch
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene
from ldtrefl.scene.gltf.to_scene import scene_parts
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.surface_material import SurfaceMaterial
from ldtrefl.world.device_scene import DeviceScene
from tests.frame_scenes import assert_as_fresh
from tests.scene.gltf.writer import Written
from tests.square import CORNERS, FACES, square

METHODS = ["ldt", "bvh"]
DARK = Environment(sky=(0, 0, 0), ground=(0, 0, 0))
WHITE = Lighting(ambient=(1, 1, 1))
RED = SurfaceMaterial(name="red", base_color=(1, 0, 0), double_sided=False)
GREEN = Material(albedo=(0, 1, 0))
SHEET = Object(mesh=square(RED))
FRONT, BEHIND = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]
"""What is seen of a red sheet with a green wall behind it."""


def along_z(*objects: Object, height: float = 10.0, size: int = 1, **scene: object) -> Scene:
    """A camera that looks along z at the middle, 0.02 wide, with green walls far behind it and ahead of it."""
    camera = Camera(eye=(0, 0, height), look_at=(0, 0, 0), up=(0, 1, 0), width=size, height=size, fov_y=0.1)
    walls = [Object(shape="plane", scale=3, translate=(0, 0, z), material=GREEN) for z in (-20, 20)]
    given = {"environment": DARK, "lighting": WHITE, **scene}
    return Scene(camera=camera, objects=(*objects, *walls), **given)


def seen(*objects: Object, method: str = "bvh", **scene: object) -> np.ndarray:
    """(3,) what its only pixel sees."""
    return ldtrefl.render(along_z(*objects, **scene), method).image[0, 0]


def with_material(shape: str, material: SurfaceMaterial, **params: object) -> Mesh:
    mesh = shapes.make(shape, params)
    return Mesh(mesh.vertices, mesh.faces, mesh.normals, mesh.uvs, (Part(0, material),))


def file(folder: Path, material: dict[str, object] | None, scale: list[float]) -> Path:
    """A glTF file of a red square that faces +z, in a node of this scale."""
    made = Written()
    red = {"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}, "extensions": {"KHR_materials_unlit": {}}}
    made.tree["materials"] = [red | (material or {})]
    given = {"material": 0} if material is not None else {}
    faces = made.accessor(FACES.reshape(-1).astype(np.uint16))
    made.mesh({"POSITION": made.accessor(CORNERS.astype(np.float32))}, indices=faces, **given)
    made.tree["nodes"][0]["scale"] = scale
    return made.save(folder)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("scale", "faces_up"), [([1, 1, 1], True), ([-1, 1, 1], True), ([1, 1, -1], False), ([-1, -1, -1], False)]
)
def test_the_front_of_a_node_is_the_file_s_whatever_mirrors_it(
    tmp_path: Path, scale: list[float], faces_up: bool, method: str
) -> None:
    """By the winding in the mesh: a matrix that turns space inside out carries fronts along."""
    path = file(tmp_path, {}, scale)
    for thing in (Object(mesh=str(path)), *scene_parts(path, up="y").objects):
        np.testing.assert_allclose(seen(thing, method=method), FRONT if faces_up else BEHIND, atol=1e-6)
        np.testing.assert_allclose(seen(thing, height=-10.0, method=method), BEHIND if faces_up else FRONT, atol=1e-6)


def test_what_a_file_calls_double_sided_is_and_what_has_no_material_is_not(tmp_path: Path) -> None:
    both = Object(mesh=str(file(tmp_path, {"doubleSided": True}, [1, 1, 1])))
    np.testing.assert_allclose(seen(both, height=-10.0), FRONT, atol=1e-6)
    (tmp_path / "plain").mkdir()
    plain = Object(mesh=str(file(tmp_path / "plain", None, [1, 1, 1])))
    np.testing.assert_allclose(seen(plain), 0.8, rtol=1e-6)
    np.testing.assert_allclose(seen(plain, height=-10.0), BEHIND, atol=1e-6)


@pytest.mark.parametrize("matrix", [np.diag([-1.0, 1.0, 1.0]), np.diag([2.0, 1.0, -1.0])], ids=["x", "z"])
def test_an_object_s_matrix_carries_fronts_along(matrix: np.ndarray) -> None:
    rows = tuple((*row, 0.0) for row in matrix.tolist())
    thing, faces_up = replace(SHEET, matrix=rows), matrix[2, 2] > 0.0
    np.testing.assert_allclose(seen(thing), FRONT if faces_up else BEHIND, atol=1e-6)
    np.testing.assert_allclose(seen(thing, height=-10.0), BEHIND if faces_up else FRONT, atol=1e-6)


def test_only_pixels_that_see_backs_send_rays() -> None:
    for height, count in ((10.0, 0), (-10.0, 64)):
        frame = ldtrefl.render(along_z(SHEET, height=height, size=8), "bvh")
        assert frame.reflector_mask.sum() == count == frame.stats.counters["rays"]


@pytest.mark.parametrize("method", METHODS)
def test_a_mirror_shows_what_is_behind_a_back(method: str) -> None:
    """The camera sees a mirror from beside, and in it a sheet from below, with a ceiling over it."""
    camera = Camera(eye=(3, 0, 3), look_at=(0, 0, 0), width=1, height=1, fov_y=0.1)
    mirror = Object(shape="plane", scale=0.5, material=Material(mirror=1.0))
    ceiling = Object(shape="plane", translate=(-2, 0, 2), scale=0.5, material=GREEN)
    for turn, expected in ((0, BEHIND), (180, FRONT)):
        above = replace(SHEET, translate=(-1, 0, 1), scale=0.5, rotate=(1, 0, 0, turn))
        scene = Scene(camera=camera, environment=DARK, lighting=WHITE, objects=(mirror, above, ceiling))
        np.testing.assert_allclose(ldtrefl.render(scene, method).image[0, 0], expected, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_mirror_on_a_front_mirrors_and_its_back_is_not_there(method: str) -> None:
    """A metal of a file: the wall behind the camera is red."""
    metal = SurfaceMaterial(name="metal", metallic=1.0, roughness=0.0, double_sided=False)
    red = Object(shape="plane", translate=(0, 0, 15), material=Material(albedo=(1, 0, 0)))
    np.testing.assert_allclose(seen(Object(mesh=square(metal)), red, method=method), [1, 0, 0], atol=2e-3)
    turned = Object(mesh=square(metal), rotate=(1, 0, 0, 180))
    np.testing.assert_allclose(seen(turned, red, method=method), [0, 1, 0], atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("turn", [0, 180])
def test_both_sides_keep_light_away(method: str, turn: float) -> None:
    """A sheet between a light and the floor, which the camera sees from beside."""
    camera = Camera(eye=(0, -3, 0.3), look_at=(0, 0, 0), width=1, height=1, fov_y=0.1)
    light = Light(kind="directional", direction=(0, 0, -1), radiance=(1, 1, 1))
    lit = Lighting(ambient=(0.25, 0.25, 0.25), shadows=True)
    floor = Object(shape="plane", scale=5.0, material=Material(albedo=1.0))
    above = replace(SHEET, translate=(0, 0, 1), rotate=(1, 0, 0, turn))
    scene = Scene(camera=camera, environment=DARK, lighting=lit, lights=(light,), objects=(floor, above))
    np.testing.assert_allclose(ldtrefl.render(scene, method).image[0, 0], 0.25, rtol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_backs_in_a_row_are_all_passed(method: str) -> None:
    """Three sheets that are one mesh: the ray goes on from its own object to its own object."""
    vertices = np.concatenate([CORNERS + np.array([0, 0, z]) for z in range(3)])
    faces = np.concatenate([FACES + 4 * k for k in range(3)])
    sheets = Object(mesh=Mesh(vertices, faces, parts=(Part(0, RED),)))
    np.testing.assert_allclose(seen(sheets, height=-10.0, method=method), BEHIND, atol=1e-6)
    front_last = faces.copy()
    front_last[4:] = front_last[4:, ::-1]
    turned = Object(mesh=Mesh(vertices, front_last, parts=(Part(0, RED),)))
    np.testing.assert_allclose(seen(turned, height=-10.0, method=method), FRONT, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("height", [10.0, -10.0])
def test_a_sheet_that_is_modelled_twice_is_seen_from_both_sides(method: str, height: float) -> None:
    """Whichever of the two triangles in one place a ray meets."""
    for faces in (np.concatenate([FACES, FACES[:, ::-1]]), np.concatenate([FACES[:, [2, 1, 0]], FACES[:, [1, 2, 0]]])):
        for corners, numbers in (
            (CORNERS, faces),
            (np.concatenate([CORNERS] * 2), faces + np.repeat([0, 4], len(FACES))[:, None]),
        ):
            thing = Object(mesh=Mesh(corners, numbers, parts=(Part(0, RED),)))
            image = ldtrefl.render(along_z(thing, height=height, size=4), method).image
            np.testing.assert_allclose(image, np.broadcast_to(FRONT, (4, 4, 3)), atol=1e-6)


def test_solids_have_the_bits_of_double_sided_ones_and_send_no_rays() -> None:
    knot = {"shape": "torus_knot", "segments": [60, 12]}
    camera = Camera(eye=(0, -4, 1), look_at=(0, 0, 0), width=48, height=32)
    images = []
    for material in (RED, replace(RED, double_sided=True)):
        thing = Object(mesh=with_material(material=material, **knot))
        scene = Scene(camera=camera, lighting=WHITE, objects=(thing,))
        assert not DeviceScene(scene, launch.resolve_device("cpu")).is_reflector.any()
        images.append(ldtrefl.render(scene, "ldt").image)
    assert (images[0] == FRONT).all(axis=2).mean() > 0.1, "the knot is seen"
    np.testing.assert_array_equal(*images)


@pytest.mark.parametrize("method", METHODS)
def test_the_far_wall_of_what_is_seen_through_is_not_there(method: str) -> None:
    """A closed box of a quarter of alpha: of its two walls along the ray only the near one is seen."""
    clear = replace(RED, alpha=0.25, alpha_mode="blend")
    image = seen(Object(mesh=with_material("box", clear)), method=method)
    np.testing.assert_allclose(image, [0.25, 0.75, 0.0], atol=1e-6)


def test_a_room_is_looked_into_through_its_walls_and_a_solid_shows_its_inside() -> None:
    """Fronts of the room's walls are inside; a camera within a solid is where nothing is meant to be."""
    room, solid = Object(mesh=with_material("room", RED)), Object(mesh=with_material("box", RED))
    for height, thing in ((10.0, room), (0.5, room), (0.5, solid)):
        np.testing.assert_allclose(seen(thing, height=height), FRONT, atol=1e-6)
    frame = ldtrefl.render(along_z(room, size=4), "bvh")
    assert frame.reflector_mask.all(), "the near wall is passed, the far one is seen"


def test_what_the_scene_says_counts() -> None:
    """A mirror takes the place of the file's material; a colour does not."""
    red = Object(shape="plane", translate=(0, 0, -15), material=Material(albedo=(1, 0, 0), double_sided=True))
    for own, expected in (
        (Material(albedo=0.5), BEHIND),
        (Material(albedo=0.5, double_sided=True), [0.5, 0.0, 0.0]),
        (Material(mirror=1.0), [1.0, 0.0, 0.0]),
        (Material(mirror=1.0, double_sided=False), BEHIND),
    ):
        np.testing.assert_allclose(seen(replace(SHEET, material=own), red, height=-10.0), expected, atol=1e-6)
        by_part = replace(SHEET, parts={"red": own})
        np.testing.assert_allclose(seen(by_part, red, height=-10.0), expected, atol=1e-6)
    plane = Object(shape="plane", material=Material(albedo=(1, 0, 0), double_sided=False))
    np.testing.assert_allclose(seen(plane), FRONT, atol=1e-6)
    np.testing.assert_allclose(seen(plane, height=-10.0), BEHIND, atol=1e-6)


def bowls(*, shadows: bool) -> Scene:
    """Single-sided sheets that are open and bent, matt and polished, before a mirror ball."""
    polished = SurfaceMaterial(name="polished", metallic=1.0, roughness=0.1, double_sided=False)
    open_bowl = {"shape": "bowl", "closed": False, "segments": [48, 16]}
    tilted = {"scale": 0.7, "rotate": (1.0, 0.0, 0.0, 70.0)}
    things = (
        Object(name="matt", mesh=with_material(material=RED, **open_bowl), translate=(-0.9, -0.6, 0), **tilted),
        Object(name="metal", mesh=with_material(material=polished, **open_bowl), translate=(0.9, -0.6, 0), **tilted),
        Object(name="ball", shape="sphere", scale=0.6, translate=(0, 1.2, 0.3), material=Material(mirror=0.9)),
        Object(shape="plane", scale=4.0, translate=(0, 0, -1), material=Material(albedo=0.4)),
    )
    light = Light(kind="point", position=(-2.0, -3.0, 5.0), intensity=(25.0, 25.0, 25.0))
    camera = Camera(eye=(0.5, -4.5, 1.8), look_at=(0, 0, 0.1), width=128, height=96, fov_y=40)
    return Scene(camera=camera, lighting=Lighting(ambient=(0.2,) * 3, shadows=shadows), lights=(light,), objects=things)


@pytest.mark.parametrize("shadows", [False, True])
def test_both_methods_agree(shadows: bool) -> None:
    found, truth = (ldtrefl.render(bowls(shadows=shadows), method) for method in METHODS)
    assert truth.reflector_mask.mean() > 0.1
    assert ssim(found.image, truth.image, np.ones(truth.image.shape[:2], bool)) >= 0.999


@pytest.mark.parametrize("method", METHODS)
def test_frames_with_history_are_those_of_a_new_renderer(method: str) -> None:
    renderer = ldtrefl.Renderer(bowls(shadows=False), method)
    renderer.render()
    for name, place in (("matt", (-0.7, -0.6, 0.1)), ("ball", (0.1, 1.1, 0.3))):
        renderer.move(name, translate=place)
        assert_as_fresh(renderer, renderer.render(), method)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("size", [(1.0, 1.0, 1.0), (1.0, 2e-3, 40.0)], ids=str)
def test_no_pixel_falls_between_the_sides(method: str, size: tuple[float, float, float]) -> None:
    """Slivers that are seen edge on, squeezed: whichever side rounding sees, white glows or lets white be seen."""
    rng = np.random.default_rng(3)
    corners = rng.uniform(-1, 1, (1500, 1, 3)) + 0.5 * rng.normal(size=(1500, 3, 3))
    corners[:, 2] = corners[:, 1] + 10.0 ** rng.uniform(-7, 0, (1500, 1)) * (corners[:, 2] - corners[:, 1])
    corners[::2] = corners[::2] - corners[::2, :1] * np.array([1.0, 0.0, 0.0])  # planes through the eye
    faces = np.arange(4500, dtype=np.int32).reshape(-1, 3)
    glow = SurfaceMaterial(name="glow", base_color=(1, 1, 1), is_unlit=True, double_sided=False)
    thing = Object(mesh=Mesh(corners.reshape(-1, 3), faces, parts=(Part(0, glow),)), scale=size)
    distance = 6.0 * max(size[0], size[1])
    camera = Camera(eye=(0, -distance, 0), look_at=(0, 0, 0), width=96, height=96, fov_y=40)
    white = Environment(sky=(1, 1, 1), ground=(1, 1, 1))
    frame = ldtrefl.render(Scene(camera=camera, environment=white, lighting=WHITE, objects=(thing,)), method)
    assert 0.1 < frame.reflector_mask.mean() < 0.9
    np.testing.assert_allclose(frame.image, 1.0, rtol=1e-6)
