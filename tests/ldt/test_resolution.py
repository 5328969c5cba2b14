"""Resolution as needed: what is chosen for an error in pixels, and what comes of it."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl.compare.metrics import reprojection_errors
from ldtrefl.renderer import Renderer
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Material, Object, Scene


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


def chosen(renderer: Renderer) -> int:
    """The resolution of the one object that is peeled, as the last frame used it."""
    *_, maps = renderer._method.tracer._maps.values()  # those used last stand last
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
