"""Resolution as needed: what is chosen for an error in pixels, and what comes of it."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl.compare.metrics import reprojection_errors
from ldtrefl.device import launch
from ldtrefl.ldt.options import FEWEST_TEXELS, MOST_TEXELS
from ldtrefl.ldt.resolution import TEXEL, resolutions_for
from ldtrefl.renderer import Renderer
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.world.device_scene import DeviceScene


def scene(distance: float) -> Scene:
    """A mirror ball and a rough ball of 57,600 triangles at a distance from it."""
    rough = shapes.make("sphere", {"segments": [240, 120]})
    place, number = np.unique(rough.vertices.round(9), axis=0, return_inverse=True)
    rises = 1.0 + 0.002 * np.random.default_rng(5).normal(size=(len(place), 1))
    mesh = ldtrefl.Mesh(rough.vertices * rises[number.ravel()], rough.faces)
    return Scene(
        camera=Camera(eye=(0, -4, 0), look_at=(0, 0, 0), width=384, height=384, fov_y=32),
        objects=(
            Object(name="mirror", shape="sphere", material=Material(mirror=(1, 1, 1))),
            Object(name="rough", mesh=mesh, translate=(0.6 * distance, -0.8 * distance, 0.0)),
        ),
    )


def boxes() -> DeviceScene:
    """Two boxes of one mesh, with sides of 2 and 6, and a ball; device space is not the world."""
    camera = Camera(eye=(0, -50, 0), look_at=(0, 0, 0), width=4, height=4)
    made = (
        Object(shape="box"),
        Object(shape="box", scale=3.0, translate=(9, 0, 0)),
        Object(shape="sphere", translate=(-9, 0, 0)),
    )
    return DeviceScene(Scene(camera=camera, objects=made), launch.resolve_device(None))


@pytest.mark.parametrize("search", ["exact", "linear"])
@pytest.mark.parametrize("error", [0.5, 3.0])
@pytest.mark.parametrize(
    ("texels", "expected"),
    [(90.0, 91), (91.0, 128), (127.9, 128), (129.0, 181), (3.0, FEWEST_TEXELS), (1e6, MOST_TEXELS)],
)
def test_texels_are_a_fixed_part_of_the_footprint(search: str, error: float, texels: float, expected: int) -> None:
    """As many as fit along the longest side, rounded up to 2^(k/2): 64, 90.5, 128, 181.0, ..."""
    scene = boxes()
    assert scene.device_units_per_world_unit != 1.0
    footprint = 2.0 * scene.device_units_per_world_unit / (TEXEL[search] * error * texels)
    assert resolutions_for(error, search, scene, {0: footprint}) == {scene.objects[0].geometry: expected}


def test_a_mesh_gets_the_finest_that_its_objects_need() -> None:
    scene = boxes()
    box, ball = scene.objects[0].geometry, scene.objects[2].geometry
    unit = scene.device_units_per_world_unit / TEXEL["exact"]
    # 2 / 0.02 = 100 and 6 / 0.03 = 200 texels; of the ball nothing is known.
    footprints = {0: 0.02 * unit, 1: 0.03 * unit, 2: None}
    assert resolutions_for(1.0, "exact", scene, footprints) == {box: 256, ball: FEWEST_TEXELS}
    assert resolutions_for(1.0, "exact", scene, {1: None, 0: 0.02 * unit}) == {box: 128}
    assert resolutions_for(1.0, "exact", scene, {0: 0.0}) == {box: FEWEST_TEXELS}


def chosen(renderer: Renderer) -> int:
    """The resolution of the one object that is peeled, as the last frame used it."""
    *_, maps = vars(renderer._tracer)["_maps"].values()
    return int(maps.resolution)


def test_what_looks_small_gets_small_maps() -> None:
    near, far = (Renderer(scene(distance), "ldt", error=2.0) for distance in (2.2, 12.0))
    frames = [renderer.render() for renderer in (near, far)]
    assert chosen(far) < chosen(near) / 2
    usual = ldtrefl.render(scene(12.0), "ldt")
    assert frames[1].stats.counters["map_bytes"] < 0.1 * usual.stats.counters["map_bytes"]


@pytest.mark.parametrize(("search", "error"), [("exact", 1.0), ("exact", 2.0), ("linear", 0.5)])
def test_the_error_is_kept(search: str, error: float) -> None:
    distance = {1.0: 20.0, 2.0: 12.0, 0.5: 2.5}[error]
    renderer, truth = (
        Renderer(scene(distance), "ldt", error=error, search=search),
        ldtrefl.render(scene(distance), "bvh"),
    )
    frame = renderer.render()
    assert frame.hits is not None and truth.hits is not None and renderer.gbuffer is not None
    p99 = float(np.percentile(reprojection_errors(frame.hits, truth.hits, renderer.gbuffer), 99))
    assert 0.05 * error < p99 <= 1.2 * error, f"{search}: p99 {p99:.3f} px of {error}, {chosen(renderer)} texels"


def test_a_resolution_by_hand_wins() -> None:
    renderer = Renderer(scene(12.0), "ldt", error=2.0, resolution=64)
    renderer.render()
    assert chosen(renderer) == 64


def test_a_camera_that_comes_near_gets_finer_maps() -> None:
    given = scene(12.0)
    renderer = Renderer(given, "ldt", error=2.0)
    renderer.render()
    before = chosen(renderer)
    renderer.render(camera=dataclasses.replace(given.camera, eye=(0.3, -1.8, 0)))
    after = chosen(renderer)
    assert after > before
    back = renderer.render()
    assert chosen(renderer) == before, "a frame is rendered at what it asks for, whatever finer maps there are"
    assert "objects_peeled" not in back.stats.counters, "its maps have been kept"
    np.testing.assert_array_equal(back.image, ldtrefl.render(given, "ldt", error=2.0).image)
