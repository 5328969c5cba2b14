"""Frames in which the camera's rays are searched for in some objects: a new renderer's bits, and the drawn pictures."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl.frame import search_choice, visibility
from ldtrefl.scene.description import Camera, Lighting, Object
from tests.documents import ROOT
from tests.frame_scenes import assert_as_fresh, scene

LIGHT = ldtrefl.Light(kind="directional", direction=(0.3, 0.4, -1), radiance=(1, 1, 1))
SEARCHED = {"ball": 0, "knot": 2, "torus": 3}


def force(monkeypatch: pytest.MonkeyPatch, *, search: bool) -> None:
    """Search for the camera's rays wherever that is allowed, or nowhere."""
    monkeypatch.setattr(search_choice, "FEWEST_TRIANGLES", 500 if search else 10**9)
    monkeypatch.setattr(search_choice, "PIXEL_NANOSECONDS", 0.0)


def searched(renderer: ldtrefl.Renderer) -> list[int]:
    return search_choice.objects_to_search(renderer._device_scene, renderer.scene.camera).tolist()


@pytest.mark.parametrize("name", ["two_balls", "teapot", "genus3_knot", "linked_mirrors"])
def test_shipped_scenes_look_as_if_drawn(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    given = ldtrefl.load_scene(ROOT / f"scenes/{name}.toml")
    given = given.with_camera(dataclasses.replace(given.camera, width=240, height=160))
    frames, seen = [], []
    for search in (False, True):
        force(monkeypatch, search=search)
        renderer = ldtrefl.Renderer(given, "ldt")
        assert bool(searched(renderer)) == search
        frames.append(renderer.render())
        assert renderer.gbuffer is not None
        seen.append(renderer.gbuffer)
    assert (seen[0].triangles != seen[1].triangles).mean() < 1e-3
    assert (np.abs(frames[0].image - frames[1].image).max(axis=2) > 1e-3).mean() < 1e-3


@pytest.mark.parametrize("shadows", [False, True])
def test_moved_and_deformed_objects_give_the_bits_of_a_new_renderer(
    shadows: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    force(monkeypatch, search=True)
    given = scene(lights=(LIGHT,), lighting=Lighting(shadows=shadows))
    renderer = ldtrefl.Renderer(given, "ldt")
    renderer.render()
    assert searched(renderer) == list(SEARCHED.values())
    for step in range(3):
        renderer.move("torus", translate=(-1.2 + 0.05 * step, -1.0, 0.2))
        assert_as_fresh(renderer, renderer.render(), "ldt")
    renderer.move("box", translate=(0.1, -1.6, -0.5))
    assert_as_fresh(renderer, renderer.render(), "ldt")
    vertices = renderer.scene.objects[SEARCHED["knot"]].geometry.vertices
    for step in range(2):
        renderer.update_vertices("knot", vertices * (1.0 + 0.1 * np.sin(3.0 * vertices[:, [1, 2, 0]] + step)))
        assert_as_fresh(renderer, renderer.render(), "ldt")
    renderer.move("knot", translate=(1.2, -1, 0.1))
    assert_as_fresh(renderer, renderer.render(), "ldt")


def test_an_object_that_comes_too_near_is_drawn_from_then_on(monkeypatch: pytest.MonkeyPatch) -> None:
    force(monkeypatch, search=True)
    renderer = ldtrefl.Renderer(scene(), "ldt")
    for place, among in (((-1.4, -1.2, 0.2), True), ((-0.4, -4.6, 1.3), False), ((-1.2, -1.2, 0.2), True)):
        renderer.move("torus", translate=place)
        for height in (0.0, 0.05):
            renderer.move("box", translate=(0, -1.6, -0.6 + height))
            assert_as_fresh(renderer, renderer.render(), "ldt")
            assert (SEARCHED["torus"] in searched(renderer)) == among


def test_what_stands_still_may_be_drawn_after_it_was_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    """Many objects of one mesh are drawn as instances. When one is deformed the others are searched."""
    force(monkeypatch, search=True)
    monkeypatch.setattr(search_choice, "MANY", 3)
    knots = [
        Object(name=f"{k}", shape="torus_knot", params={"segments": [60, 20]}, scale=0.4, translate=(k - 1.0, 0, 1.2))
        for k in range(3)
    ]
    given = scene()
    given = dataclasses.replace(given, objects=(*given.objects, *knots))
    renderer = ldtrefl.Renderer(given, "ldt")
    renderer.render()
    before = searched(renderer)
    for step in range(3):
        renderer.move("0", translate=(-1.0, 0, 1.2 + 0.05 * step))
        renderer.render()
    vertices = knots[0].geometry.vertices
    assert renderer._history._still is not None and renderer._history._still.searched == set(before)
    for step in range(3):
        renderer.update_vertices("0", vertices * (1.0 + 0.1 * np.sin(3.0 * vertices[:, [1, 2, 0]] + step)))
        assert_as_fresh(renderer, renderer.render(), "ldt")
        assert searched(renderer) == [*before, 5, 6, 7]
        assert renderer._history._still.searched == {*before, 6, 7}


def test_large_images_are_searched_in_bands(monkeypatch: pytest.MonkeyPatch) -> None:
    force(monkeypatch, search=True)
    whole = ldtrefl.Renderer(scene(), "ldt").render()
    monkeypatch.setattr("ldtrefl.renderer.LARGEST_WHOLE", 1)
    monkeypatch.setattr(visibility, "BAND_PIXELS", 24 * 160)
    renderer = ldtrefl.Renderer(scene(), "ldt")
    np.testing.assert_array_equal(renderer.render().image, whole.image)
    seen = renderer.gbuffer
    monkeypatch.undo()
    force(monkeypatch, search=True)
    again = ldtrefl.Renderer(scene(), "ldt")
    again.render()
    assert seen is not None and again.gbuffer is not None
    np.testing.assert_array_equal(seen.triangles, again.gbuffer.triangles)


@pytest.mark.parametrize("options", [{"search": "linear"}, {"error": 1.0}], ids=str)
def test_the_papers_search_and_chosen_maps_leave_drawing_as_it_is(
    options: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    force(monkeypatch, search=False)
    drawn = ldtrefl.render(scene(), "ldt", **options)
    force(monkeypatch, search=True)
    np.testing.assert_array_equal(ldtrefl.render(scene(), "ldt", **options).image, drawn.image)


def test_one_tree_serves_the_camera_and_the_reflections(monkeypatch: pytest.MonkeyPatch) -> None:
    force(monkeypatch, search=True)
    dense = Object(name="knot", shape="torus_knot", params={"segments": [2400, 60]}, scale=0.5, translate=(1.5, -1, 0))
    given = scene()
    given = dataclasses.replace(given, objects=(given.objects[0], dense))
    for quality in ("balanced", "fast"):
        renderer = ldtrefl.Renderer(given, "ldt", quality=quality, resolution=32)
        assert renderer.render().stats.counters["objects_peeled"] == 2
        keys = list(renderer._tracer._maps)
        assert [key.quality for key in keys] == ["exact", "exact"]
        # Seen from within, it is drawn, and its reflections are searched for in patches.
        near = Camera(eye=(1.5, -1, 0), look_at=(0, 0, 0), width=64, height=48, fov_y=60)
        seen = renderer.render(near)
        np.testing.assert_array_equal(
            seen.image, ldtrefl.Renderer(given, "ldt", quality=quality, resolution=32).render(near).image
        )
        assert {key.quality for key in renderer._tracer._maps} == {"exact", quality}


def test_rays_of_the_last_frame_serve_again_only_if_the_maps_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ball behind the camera is seen in the mirror alone. It is searched in patches, until another object of its mesh
    comes into the view."""
    force(monkeypatch, search=True)
    fine = {"shape": "sphere", "params": {"segments": [500, 250]}}
    behind = Object(name="behind", scale=1.5, translate=(0.5, -7.5, 2.5), **fine)
    beside = Object(name="beside", scale=0.3, translate=(1.8, -5.0, 0.0), **fine)
    given = scene()
    given = dataclasses.replace(given, objects=(given.objects[0], behind, beside))
    options = {"quality": "fast", "resolution": 64}
    renderer = ldtrefl.Renderer(given, "ldt", **options)
    for height in (0.1, 0.2):
        renderer.move("beside", translate=(1.8, -5.0, height))
        frame = renderer.render()
    assert searched(renderer) == [0] and frame.stats.counters["rays_kept"] > 1000
    assert frame.hits is not None and (frame.hits.object == 1).sum() > 20
    assert [maps.tree.patches for maps in renderer._tracer._maps.values()].count(True) == 1
    renderer.move("beside", translate=(1.5, -1, 0))
    assert_as_fresh(renderer, renderer.render(), "ldt", **options)
    assert searched(renderer) == [0, 2]
