"""Objects that are deformed from frame to frame: the bits of a new renderer, and no earlier frame's things are kept."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.files.map_cache import SUFFIX, MapCache
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Lighting, Material, Object, Scene
from tests.frame_scenes import assert_as_fresh


def scene(**changes: object) -> Scene:
    """A mirror ball and two knots of one mesh, of which one mirrors."""
    knot = {"mesh": shapes.make("torus_knot", {"segments": [200, 24]}), "scale": 0.5}
    given: dict[str, object] = {
        "camera": Camera(eye=(0, -5, 1.5), look_at=(0, 0, 0), width=120, height=80, fov_y=40),
        "objects": (
            Object(name="ball", shape="sphere", material=Material(mirror=0.9)),
            Object(name="knot", **knot, translate=(1.5, -1, 0)),
            Object(name="other", **knot, translate=(-1.6, -1, 0.2), material=Material(mirror=0.6)),
        ),
    }
    return Scene(**{**given, **changes})


def bent(vertices: np.ndarray, step: int) -> np.ndarray:
    """Vertices of a shape that writhes."""
    return vertices * (1.0 + 0.15 * np.sin(3.0 * vertices[:, [1, 2, 0]] + 0.4 * step))


@pytest.mark.parametrize(
    ("method", "options"),
    [("ldt", {}), ("ldt", {"search": "linear"}), ("ldt", {"error": 1.0}), ("bvh", {}), ("envmap", {})],
    ids=str,
)
def test_a_deformed_object_gives_the_bits_of_a_new_renderer(method: str, options: dict) -> None:
    renderer = ldtrefl.Renderer(scene(lighting=Lighting(shadows=method != "ldt")), method, **options)
    before, vertices = renderer.render().image, renderer.scene.objects[1].geometry.vertices
    for step in range(1, 3):
        renderer.update_vertices("knot", bent(vertices, step))
        frame = renderer.render()
        assert (np.abs(frame.image - before).max(axis=2) > 0.01).sum() > 50
        if method == "envmap":
            np.testing.assert_array_equal(frame.image, ldtrefl.render(renderer.scene, method, **options).image)
        else:
            assert_as_fresh(renderer, frame, method, **options)
    renderer.move("knot", translate=(1.4, -1.1, 0.1))
    renderer.update_vertices("other", bent(vertices, 5))
    np.testing.assert_array_equal(renderer.render().image, ldtrefl.render(renderer.scene, method, **options).image)
    np.testing.assert_array_equal(renderer.scene.objects[1].geometry.vertices, bent(vertices, 2))


@pytest.mark.parametrize(
    ("method", "options"), [("ldt", {}), ("ldt", {"search": "linear"}), ("bvh", {}), ("envmap", {})], ids=str
)
def test_an_object_that_takes_the_shape_of_another_is_seen_in_it(method: str, options: dict) -> None:
    """The scene's meshes stay the same then; which object has which does not."""
    box = shapes.make("box")
    box = ldtrefl.Mesh(box.vertices, box.faces)
    tall = box.with_vertices(box.vertices * [1, 1, 3])
    mirror = Object(name="mirror", mesh=box, scale=(8, 0.2, 6), translate=(0, 2, 0), material=Material(mirror=0.9))
    others = [Object(name=name, mesh=mesh, translate=(x, 0, 0)) for name, mesh, x in (("a", tall, -2), ("b", box, 2))]
    renderer = ldtrefl.Renderer(scene(objects=(mirror, *others)), method, **options)
    before = renderer.render().reflection
    renderer.update_vertices("b", tall.vertices)
    frame = renderer.render()
    np.testing.assert_array_equal(frame.image, ldtrefl.render(renderer.scene, method, **options).image)
    assert (np.abs(frame.reflection - before).max(axis=2) > 0.01).sum() > 50


def test_the_scene_with_the_deformed_mesh_is_what_is_shown() -> None:
    """The same vertices given at once, with device space as it was laid out by the first."""
    given = scene()
    vertices = bent(given.objects[1].geometry.vertices, 3)
    renderer = ldtrefl.Renderer(given, "bvh")
    renderer.update_vertices("knot", vertices)
    knot = given.objects[1]
    whole = Scene(
        camera=given.camera,
        objects=(
            given.objects[0],
            Object(mesh=ldtrefl.Mesh(vertices, knot.geometry.faces), scale=0.5, translate=(1.5, -1, 0)),
            given.objects[2],
        ),
    )
    difference = np.abs(renderer.render().image - ldtrefl.render(whole, "bvh").image).max(axis=2)
    assert (difference > 1e-3).sum() <= 3


def test_fit_places_a_deformed_mesh_as_before() -> None:
    """A box that is stretched to twice its height grows upwards and downwards; fit does not shrink it again."""
    box = shapes.make("box")
    given = scene(objects=(Object(name="box", mesh=box, fit=1.0, translate=(0, 0, 2)),))
    stretched = given.with_vertices("box", box.vertices * [1, 1, 2] + [0, 0, 3])
    placed = stretched.objects[0].world_from_object()
    np.testing.assert_allclose(placed, given.objects[0].world_from_object())
    corners = box.vertices * [1, 1, 2] + [0, 0, 3]
    np.testing.assert_allclose((corners @ placed[:3, :3].T + placed[:3, 3]).max(axis=0), [0.5, 0.5, 2 + 2.5])
    twice = stretched.with_vertices("box", box.vertices).with_object("box", scale=2.0)
    np.testing.assert_allclose(twice.objects[0].world_from_object()[:3, :3], np.eye(3))


def test_uvs_and_parts_stay_and_normals_are_those_of_the_new_faces() -> None:
    mesh = shapes.make("sphere", {"segments": [24, 12]})
    tall = mesh.with_vertices(mesh.vertices * [1, 1, 3])
    assert tall.uvs is not None and tall.faces is mesh.faces and tall.parts == mesh.parts
    np.testing.assert_array_equal(tall.uvs, mesh.uvs)
    expected = ldtrefl.Mesh(tall.vertices, tall.faces).normals
    np.testing.assert_array_equal(tall.normals, expected)
    assert np.abs(tall.normals - mesh.normals).max() > 0.1


@pytest.mark.parametrize(
    ("name", "vertices", "message"),
    [
        ("kont", np.zeros((3, 3)), "unknown object 'kont'.*knot"),
        ("knot", np.zeros((3, 3)), "^object 'knot': 3 vertices in place of 5025$"),
        ("knot", np.full((5025, 3), np.nan), "^object 'knot': vertex 0 is not finite"),
        ("knot", np.zeros((5025, 2)), r"^object 'knot': vertices must have shape \(n, 3\)"),
        ("knot", "vertices", "^object 'knot': vertices must be numbers"),
    ],
)
def test_wrong_vertices_are_refused_and_change_nothing(name: str, vertices: np.ndarray, message: str) -> None:
    renderer = ldtrefl.Renderer(scene(), "bvh")
    before = renderer.scene
    with pytest.raises(ldtrefl.InputError, match=message):
        renderer.update_vertices(name, vertices)
    assert renderer.scene is before


def test_nothing_of_earlier_frames_is_kept(cache: MapCache) -> None:
    """Maps, trees and meshes of the last frame alone; and what is made of a deformed mesh is not kept on disk."""
    fine = shapes.make("torus_knot", {"segments": [300, 20]})  # 12,000 triangles: enough for the disk
    given = scene()
    given = Scene(
        camera=given.camera,
        objects=(
            Object(name="ball", shape="sphere", params={"segments": [60, 30]}, material=Material(mirror=0.9)),
            Object(name="knot", mesh=fine, scale=0.5, translate=(1.5, -1, 0)),
        ),
    )
    for method in ("ldt", "bvh"):
        renderer = ldtrefl.Renderer(given, method)
        renderer.render()
        for step in range(3):
            renderer.update_vertices("knot", bent(fine.vertices, step))
            renderer.render()
        kept = renderer._tracer._maps if method == "ldt" else renderer._tracer._trees
        assert len(kept) <= 2 and len(renderer.scene.layout.meshes) == 2
    assert len(list(cache.folder.glob(f"*{SUFFIX}"))) == 1, "the mesh as it was laid out"
