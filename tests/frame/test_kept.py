"""Frames after frames: what is kept changes no bit, and what moved is done again."""

import dataclasses
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stress_cases.histories import (
    OPTIONS,
    THREADS,
    difference,
    history,
    in_threads,
    sky,
    wrong_frames,
)

import ldtrefl
from ldtrefl import renderer as renderer_module
from ldtrefl.base import budget
from ldtrefl.compare.metrics import reprojection_errors
from ldtrefl.device import launch
from ldtrefl.frame import gbuffer
from ldtrefl.renderer import Frame
from ldtrefl.scene import description as scene_module
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Lighting, Material, Object, Scene

MIRROR = Material(mirror=(0.9, 0.9, 0.9))


def scene(**changes: object) -> Scene:
    """A mirror ball between a knot, a torus and a box, on a large plate that device space is made for."""
    given = Scene(
        camera=Camera(eye=(0, -5, 1.5), look_at=(0, 0, 0), width=160, height=112, fov_y=40),
        objects=(
            Object(name="ball", shape="sphere", material=MIRROR),
            Object(name="plate", shape="plane", scale=4.0, translate=(0, 0, -1.1)),
            Object(name="knot", shape="torus_knot", params={"segments": [300, 40]}, scale=0.5, translate=(1.5, -1, 0)),
            Object(name="torus", shape="torus", scale=0.4, translate=(-1.4, -1.2, 0.2)),
            Object(name="box", shape="box", scale=0.2, translate=(0, -1.6, -0.6)),
        ),
    )
    return dataclasses.replace(given, **changes)


def assert_as_fresh(renderer: ldtrefl.Renderer, frame: Frame, method: str = "ldt", **options: object) -> None:
    """A frame is, to the bit, what a new renderer makes of the same scene."""
    fresh = ldtrefl.render(renderer.scene, method, **options)
    np.testing.assert_array_equal(frame.image, fresh.image)
    np.testing.assert_array_equal(frame.reflection, fresh.reflection)
    assert frame.hits is not None and fresh.hits is not None
    for name in ("distance", "object", "triangle"):
        np.testing.assert_array_equal(getattr(frame.hits, name), getattr(fresh.hits, name))


def test_a_still_frame_is_not_made_again() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    first, second = renderer.render(), renderer.render()
    np.testing.assert_array_equal(first.image, second.image)
    assert second.stats.counters["frames_kept"] == 1 and second.stats.counters["rays"] == 0
    assert {stage for stage, seconds in second.stats.seconds.items() if seconds > 0.0} == {"composite"}
    assert set(second.stats.seconds) == set(first.stats.seconds)
    third = renderer.render(camera=dataclasses.replace(renderer.scene.camera, eye=(0.5, -5, 1.5)))
    assert "frames_kept" not in third.stats.counters and third.stats.counters["rays"] > 0


def test_only_what_a_move_touches_is_done_again() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    first = renderer.render()
    before = first.image.copy()
    renderer.move("torus", translate=(-1.5, -1.1, 0.1))
    second = renderer.render()
    assert_as_fresh(renderer, second)
    counters = second.stats.counters
    assert 0 < counters["rays"] < 0.5 * first.stats.counters["rays"]
    assert counters["rays"] + counters["rays_kept"] == counters["reflector_pixels"]
    assert "objects_peeled" not in counters
    np.testing.assert_array_equal(first.image, before)  # what was handed out stays as it was
    renderer.move("torus", rotate=(1, 1, 0, 50), scale=0.3)
    assert_as_fresh(renderer, renderer.render())


def test_moves_of_several_objects_in_turn() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    renderer.render()
    for name, place in (("torus", (-1, -1.5, 0)), ("knot", (1.2, -1.4, 0.3)), ("torus", (-1, -1.5, 0.3))):
        renderer.move(name, translate=place)
        assert_as_fresh(renderer, renderer.render())
    renderer.move("box", translate=(0.1, -1.7, -0.5))
    renderer.move("knot", translate=(1.3, -1.4, 0.3))
    assert_as_fresh(renderer, renderer.render())


@pytest.mark.parametrize(
    ("name", "place"),
    [("ball", (0.2, 0.1, 0.1)), ("plate", (1.0, 0, -1.2)), ("box", (0, 0, 30)), ("torus", (0, -3, 0.9))],
    ids=["the mirror", "device space", "far away", "before the mirror"],
)
def test_moves_that_change_everything(name: str, place: tuple[float, float, float]) -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    renderer.render()
    renderer.move(name, translate=place)
    assert_as_fresh(renderer, renderer.render())


@pytest.mark.parametrize(
    ("method", "options"),
    [
        ("ldt", {"max_bounces": 3}),
        ("ldt", {"skip": "none"}),
        ("ldt", {"search": "linear"}),
        ("ldt", {"cull": "flat"}),
        ("bvh", {}),
    ],
)
def test_moves_with_every_option(method: str, options: dict[str, object]) -> None:
    renderer = ldtrefl.Renderer(scene(), method, **options)
    renderer.render()
    renderer.move("torus", translate=(-1.2, -1.4, 0))
    assert_as_fresh(renderer, renderer.render(), method, **options)


def test_a_moved_object_moves_its_shadow() -> None:
    light = ldtrefl.Light(kind="directional", direction=(0.3, 0.2, -1), radiance=(2, 2, 2))
    renderer = ldtrefl.Renderer(scene(lights=(light,), lighting=Lighting(shadows=True)), "ldt")
    renderer.render()
    renderer.move("torus", translate=(-1.2, -1.4, 0.4))
    assert_as_fresh(renderer, renderer.render())


def test_environment_maps_follow_a_move() -> None:
    renderer = ldtrefl.Renderer(scene(), "envmap")
    renderer.render()
    renderer.move("torus", translate=(-1.2, -1.4, 0.4))
    np.testing.assert_array_equal(renderer.render().image, ldtrefl.render(renderer.scene, "envmap").image)


def test_a_move_that_cannot_be_is_refused() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    with pytest.raises(ldtrefl.InputError, match=r"unknown object 'toros'; did you mean 'torus'\?"):
        renderer.move("toros", scale=2.0)
    with pytest.raises(ldtrefl.InputError, match=r"scale: should be from 1e-15 to 1e\+15, got -1"):
        renderer.move("torus", scale=-1.0)
    with pytest.raises(ldtrefl.InputError, match=r"rotate: the axis must not be the zero vector"):
        renderer.move("torus", rotate=(0, 0, 0, 10))


# Any history.


@pytest.fixture(scope="module")
def picture(tmp_path_factory: pytest.TempPathFactory) -> str:
    return sky(tmp_path_factory.mktemp("sky"))


@pytest.mark.parametrize("by", OPTIONS)
def test_any_history_gives_the_bits_of_a_new_renderer(by: str, picture: str) -> None:
    @settings(max_examples=3, deadline=None, derandomize=True, database=None)
    @given(st.data())
    def try_one(data: st.DataObject) -> None:
        pick = lambda values: data.draw(st.sampled_from(values))  # noqa: E731
        for done, frame, new in history(pick, by, picture, 7):
            assert difference(frame, new) == "", done

    try_one()


def test_environment_maps_turn_with_the_camera() -> None:
    given_scene = scene()
    renderer = ldtrefl.Renderer(given_scene, "envmap", resolution=64)
    renderer.render()
    turned = dataclasses.replace(given_scene.camera, up=(1.0, 0.0, 0.5))
    assert (
        difference(renderer.render(turned), ldtrefl.Renderer(given_scene, "envmap", resolution=64).render(turned)) == ""
    )


def test_finer_maps_of_frames_before_change_nothing() -> None:
    near = dataclasses.replace(scene().camera, eye=(0.2, -1.6, 0.3), fov_y=20.0)
    renderer = ldtrefl.Renderer(scene(), "ldt", error=2.0)
    first, close = renderer.render(), renderer.render(near)
    assert close.stats.counters["objects_peeled"] > 0, "the near camera needs finer maps"
    assert difference(renderer.render(), first) == ""


def test_with_shadows_maps_are_as_fine_as_what_is_seen() -> None:
    """A far camera sees neither reflections nor shadows finer than its pixels."""
    light = ldtrefl.Light(kind="directional", direction=(0.3, 0.2, -1), radiance=(2, 2, 2))
    lit = scene(lights=(light,), lighting=Lighting(shadows=True))
    far = dataclasses.replace(lit.camera, eye=(0, -60, 20), fov_y=10.0)
    small = ldtrefl.Renderer(lit, "ldt", error=4.0).render(far)
    usual = ldtrefl.Renderer(lit, "ldt").render(far)
    meshes = len(lit.objects)
    assert small.stats.counters["objects_peeled"] == usual.stats.counters["objects_peeled"] == meshes, "each once"
    assert small.stats.counters["map_bytes"] < 0.5 * usual.stats.counters["map_bytes"]
    finest = ldtrefl.Renderer(lit, "ldt", error=0.01).render(far)
    np.testing.assert_array_equal(finest.image, usual.image)


@pytest.mark.parametrize("options", [{"error": 1.0}, {"error": 1.0, "max_bounces": 3}], ids=str)
@pytest.mark.parametrize("skip", ["bounds", "bounds,maps", "bounds,regions,attributes"])
def test_resolutions_do_not_depend_on_what_is_skipped(skip: str, options: dict[str, Any]) -> None:
    whole = scene(
        objects=(
            *scene().objects,
            Object(name="ring", shape="torus", scale=0.4, translate=(0.8, -2.0, 0.5), material=MIRROR),
        )
    )
    assert difference(ldtrefl.render(whole, "ldt", skip=skip, **options), ldtrefl.render(whole, "ldt", **options)) == ""


# Arrays that are handed out.


def scribble(values: Any) -> None:
    """Write into every array there is."""
    for array in values:
        array[...] = 1 if array.dtype == bool else 77


def arrays_of(frame: Frame, drawn: Any) -> list[np.ndarray]:
    assert frame.hits is not None
    hits = [frame.hits.distance, frame.hits.object, frame.hits.triangle]
    seen = [drawn.objects, drawn.triangles, drawn.reflector_mask]
    surfaces = [array.numpy() for array in drawn.surfaces]
    return [frame.image, frame.reflection, frame.reflector_mask, *hits, *seen, *surfaces]


def test_arrays_that_are_handed_out_are_the_callers() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    truth = ldtrefl.render(scene(), "ldt")
    for _ in range(3):
        frame = renderer.render()
        assert renderer.gbuffer is not None and difference(frame, truth) == ""
        scribble(arrays_of(frame, renderer.gbuffer))
        frame = renderer.render()
        assert difference(frame, truth) == ""
    scribble(arrays_of(frame, renderer.gbuffer))
    renderer.move("torus", translate=(-1.5, -1.1, 0.1))
    assert_as_fresh(renderer, renderer.render())


def test_arrays_of_a_frame_stay_as_they_are() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    frame = renderer.render()
    renderer.move("torus", translate=(-1.5, -1.1, 0.1))
    renderer.render()
    renderer.render(dataclasses.replace(scene().camera, eye=(1, -4, 2)))
    assert difference(frame, ldtrefl.render(scene(), "ldt")) == ""


def test_vertices_that_are_handed_in_stay_the_callers() -> None:
    mesh = shapes.make("torus_knot", {"segments": [64, 12]})
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    maps, tree = ldtrefl.peel(vertices, faces, 64), ldtrefl.Raycaster(vertices, faces)
    given_mesh = ldtrefl.Mesh(vertices, faces)
    vertices[:], faces[:] = 0.0, 0
    origins = np.random.default_rng(1).normal(size=(500, 3)).astype(np.float32)
    origins *= 3.0 / np.linalg.norm(origins, axis=1, keepdims=True)
    truth = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, -origins)
    linear = ldtrefl.peel(mesh.vertices, mesh.faces, 64).trace(origins, -origins, search="linear")
    np.testing.assert_array_equal(tree.trace(origins, -origins).t, truth.t)
    # Made only now, from what the maps hold of the mesh.
    np.testing.assert_array_equal(maps.trace(origins, -origins, search="linear").t, linear.t)
    np.testing.assert_array_equal(maps.geometry.mesh.vertices, mesh.vertices)
    np.testing.assert_array_equal(given_mesh.normals, ldtrefl.Mesh(mesh.vertices, mesh.faces).normals)


def test_maps_hand_out_copies() -> None:
    mesh = shapes.make("torus_knot", {"segments": [64, 12]})
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, 64, search="linear")
    before = maps.layers(), maps.crossings()
    for array in (maps.start, maps.depth, maps.reference):
        array.numpy()[:] = 0
    assert (maps.layers(), maps.crossings()) == before
    for name in ("vertices", "faces", "normals", "uvs", "unit_vertices", "bounds"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(mesh, name)[...] = 0


# Threads.


@pytest.mark.parametrize("by", ["ldt", "ldt, error", "bvh", "envmap"])
@pytest.mark.parametrize("count", [1, THREADS], ids=["one renderer", "one each"])
def test_threads_get_their_own_frames(by: str, count: int, picture: str) -> None:
    given_scene = scene(environment=scene_module.Environment(image=picture))
    method, options = OPTIONS[by]
    renderers = [ldtrefl.Renderer(given_scene, method, **options) for _ in range(count)]
    wrong, tried = wrong_frames(given_scene, by, renderers, 4)
    assert wrong == 0, f"{wrong} of {tried} frames"


def test_frames_and_moves_of_several_threads() -> None:
    """Every frame is the scene's before a move or after it, never something between."""
    renderer = ldtrefl.Renderer(scene(), "ldt")
    places = ((-1.4, -1.2, 0.2), (-1.0, -1.5, 0.0))
    moved = [ldtrefl.render(scene().with_object("torus", translate=place), "ldt") for place in places]
    frames: list[Frame] = []

    def draw() -> None:
        for _ in range(8):
            frames.append(renderer.render())

    def move() -> None:
        for k in range(40):
            renderer.move("torus", translate=places[k % 2])

    in_threads([draw, move, draw])
    assert len(frames) == 16
    assert all(any(difference(frame, truth) == "" for truth in moved) for frame in frames)


def test_renderers_are_made_by_several_threads() -> None:
    """Meshes and kernels are shared: whoever comes first makes them."""
    frames: list[Frame] = []
    params = {"segments": [90, 12]}

    def work() -> None:
        knot = Object(name="fresh", shape="torus_knot", params=params, scale=0.5, translate=(1.5, -1, 0))
        frames.append(ldtrefl.render(scene(objects=(scene().objects[0], knot)), "ldt", error=1.0))

    in_threads([work] * THREADS)
    assert len(frames) == THREADS and all(difference(frame, frames[0]) == "" for frame in frames)


# What fails or is stopped.


class Stop(BaseException):
    """Stands for Ctrl-C."""


def stopping_at(monkeypatch: pytest.MonkeyPatch, launches: int) -> Callable[[], None]:
    """Have the launch after so many raise ``Stop``, once; call what is returned to end that."""
    whole, left = launch.launch, [launches]

    def stopped(*arguments: Any) -> None:
        left[0] -= 1
        if left[0] == -1:
            raise Stop
        whole(*arguments)

    modules = [module for name, module in sys.modules.items() if name.startswith("ldtrefl.")]
    for module in modules:
        if getattr(module, "launch", None) is whole:
            monkeypatch.setattr(module, "launch", stopped)
    return monkeypatch.undo


@pytest.mark.parametrize("launches", range(0, 16, 3))
def test_a_frame_that_is_stopped_leaves_nothing_half_done(launches: int, monkeypatch: pytest.MonkeyPatch) -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt", error=1.0)
    renderer.render()
    renderer.move("torus", translate=(-1.2, -1.3, 0.1))
    renderer.render()
    renderer.move("knot", translate=(1.2, -1.3, 0.1))
    go_on = stopping_at(monkeypatch, launches)
    try:
        renderer.render()
    except Stop:
        pass
    go_on()
    # What moved before the frame that was stopped, and what moves now.
    assert_as_fresh(renderer, renderer.render(), error=1.0)
    renderer.move("box", translate=(0.1, -1.7, -0.5))
    assert_as_fresh(renderer, renderer.render(), error=1.0)


def test_a_move_that_fails_leaves_all_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    before = renderer.render()
    with pytest.raises(ldtrefl.InputError):
        renderer.move("torus", translate=(1.0, 0.0, 0.0), scale=-1.0)

    def fail(*_arguments: Any, **_named: Any) -> None:
        raise Stop

    monkeypatch.setattr(renderer_module, "DeviceScene", fail)
    with pytest.raises(Stop):
        renderer.move("torus", translate=(1.0, 0.0, 0.0))
    monkeypatch.undo()
    assert renderer.scene.objects == scene().objects
    assert difference(renderer.render(), before) == ""


# Large images.


@pytest.mark.parametrize(
    ("method", "options"),
    [
        ("ldt", {}),
        ("ldt", {"max_bounces": 2}),
        ("ldt", {"search": "linear"}),
        ("bvh", {}),
        ("envmap", {"resolution": 64}),
    ],
    ids=str,
)
def test_a_large_image_in_bands_has_the_same_bits(
    method: str, options: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    light = ldtrefl.Light(kind="directional", direction=(0.3, 0.2, -1), radiance=(2, 2, 2))
    # The camera stands between things, so that triangles cross its plane, and the last band is a short one.
    camera = Camera(eye=(0.2, -2.2, 0.3), look_at=(0, 0, 0), width=120, height=91, fov_y=100, up=(0.2, 0.1, 1))
    lit = scene(camera=camera, lights=(light,), lighting=Lighting(shadows=True))
    whole = ldtrefl.Renderer(lit, method, **options)
    truth = whole.render()
    assert whole.gbuffer is not None
    monkeypatch.setattr(renderer_module, "LARGEST_WHOLE", 5000)
    monkeypatch.setattr(gbuffer, "BAND_PIXELS", 2000)
    renderer = ldtrefl.Renderer(lit, method, **options)
    frame = renderer.render()
    assert difference(frame, truth) == "" and renderer.gbuffer is not None
    np.testing.assert_array_equal(renderer.gbuffer.triangles, whole.gbuffer.triangles)
    if truth.hits is not None and frame.hits is not None:
        errors = [reprojection_errors(truth.hits, hits, whole.gbuffer) for hits in (truth.hits, frame.hits)]
        assert len(errors[0]) > 100 and len(errors[0]) == len(errors[1]) and not errors[1].any()
    # A frame keeps what it is of, whatever comes after it; a small one after it is right.
    again = renderer.render()
    renderer.move("torus", translate=(-1.2, -1.3, 0.1))
    small = dataclasses.replace(camera, width=60, height=40)
    assert difference(renderer.render(small), ldtrefl.Renderer(renderer.scene, method, **options).render(small)) == ""
    assert difference(again, truth) == ""


def test_a_large_image_keeps_nothing_for_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    renderer.render()
    monkeypatch.setattr(renderer_module, "LARGEST_WHOLE", 5000)
    monkeypatch.setattr(gbuffer, "BAND_PIXELS", 2000)
    renderer.render()
    assert "frames_kept" not in renderer.render().stats.counters
    assert vars(renderer._method)["_last"] is None and renderer._last is None


def test_an_image_that_is_too_large_is_refused_in_a_line() -> None:
    huge = dataclasses.replace(scene().camera, width=16384, height=16384)
    renderer = ldtrefl.Renderer(scene(), "ldt")
    budget.set_memory_limit(1 << 30)
    try:
        with pytest.raises(
            ldtrefl.InputError, match=r"an image of 16384 x 16384 pixels needs 3\.\d GiB.*camera\.width"
        ):
            renderer.render(huge)
    finally:
        budget.set_memory_limit()
    assert_as_fresh(renderer, renderer.render())


# Many objects.


def test_the_launches_of_a_frame_do_not_depend_on_the_number_of_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    counts = []
    for objects in (10, 400):
        boxes = [Object(shape="box", scale=0.05, translate=(0.1 * k - 2, -2, -1)) for k in range(objects)]
        many = scene(objects=(*scene().objects[:1], *boxes))
        # Meshes are made by launches of their own, as many for each mesh; objects share them.
        assert len({id(entry.geometry.unit_vertices) for entry in many.objects}) == 2
        made = [0]
        whole = launch.launch

        def counted(*arguments: Any, whole: Any = whole, made: list[int] = made) -> None:
            made[0] += 1
            whole(*arguments)

        monkeypatch.setattr(launch, "launch", counted)
        ldtrefl.render(many, "bvh")
        monkeypatch.undo()
        counts.append(made[0])
    assert counts[0] == counts[1] < 20, counts


def test_many_small_objects_are_drawn_like_one_mesh() -> None:
    """Boxes one by one cover the pixels that the same boxes cover as one mesh."""
    camera = Camera(eye=(0, -6, 2), look_at=(0, 0, 0), width=96, height=64, fov_y=40)
    places = np.random.default_rng(2).uniform(-1.5, 1.5, (300, 3))
    box = shapes.make("box")
    apart = [Object(shape="box", scale=0.05, translate=tuple(place.tolist())) for place in places]
    vertices = np.concatenate([0.05 * box.vertices + place for place in places])
    faces = np.concatenate([box.faces + len(box.vertices) * k for k in range(len(places))])
    one = Object(mesh=ldtrefl.Mesh(vertices, faces))
    seen = []
    for objects in ((one,), tuple(apart)):
        renderer = ldtrefl.Renderer(Scene(camera=camera, objects=objects), "bvh")
        renderer.render()
        assert renderer.gbuffer is not None
        seen.append(renderer.gbuffer)
    number = np.where(seen[1].objects >= 0, seen[1].objects * len(box.faces) + seen[1].triangles, -1)
    # Corners are rounded to float32 in a box of another size: pixels on an edge may go to either side.
    assert (number != seen[0].triangles).mean() < 0.002


@pytest.mark.parametrize("shadows", [False, True])
def test_coarse_maps_hide_nothing_from_the_search_by_bounds(shadows: bool) -> None:
    """Patches of coarse maps rise out of the sphere about their object: no skip may show what another hides."""
    rng = np.random.default_rng(4)
    dense = (("sphere", (400, 200)), ("torus_knot", (400, 40)), ("torus", (300, 100)))
    for error in (1.0, 8.0, 32.0):
        things = tuple(
            Object(
                shape=shape,
                params={"segments": segments},
                scale=float(rng.uniform(0.2, 0.6)),
                translate=tuple((rng.uniform(-1.8, 1.8, 3) - [0, 1, 0]).tolist()),
            )
            for shape, segments in dense
        )
        mirrors = (
            Object(shape="sphere", material=MIRROR),
            Object(shape="sphere", scale=0.5, translate=(1.6, 0.3, 0.2), material=MIRROR),
        )
        seen = scene(objects=(*mirrors, *things), lighting=Lighting(shadows=shadows))
        frames = [ldtrefl.render(seen, "ldt", error=error, skip=skip) for skip in ("all", "none", "bounds", "regions")]
        for other in frames[1:]:
            np.testing.assert_array_equal(frames[0].image, other.image)
