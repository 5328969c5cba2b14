"""Frame after frame: what is taken over from the last frame changes no bit, and what moved is done again."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stress_cases.histories import OPTIONS, difference, history, sky

import ldtrefl
from ldtrefl.scene.description import Lighting
from tests.frame_scenes import assert_as_fresh, scene


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
    np.testing.assert_array_equal(first.image, before)  # the first frame's array is the caller's
    renderer.move("torus", rotate=(1, 1, 0, 50), scale=0.3)
    assert_as_fresh(renderer, renderer.render())


@pytest.mark.parametrize("max_bounces", [1, 4])
def test_a_move_among_many_objects_is_traced_again_only_where_it_matters(max_bounces: int) -> None:
    among_many = scene()
    box = among_many.objects[-1]
    boxes = (dataclasses.replace(box, name=f"box {k}", translate=(0.5 * k - 1.5, -1.8, -0.8)) for k in range(6))
    among_many = dataclasses.replace(among_many, objects=(*among_many.objects, *boxes))
    renderer = ldtrefl.Renderer(among_many, "bvh", max_bounces=max_bounces)
    first = renderer.render()
    for place in ((-1.5, -1.1, 0.1), (-1.6, -1.2, 0.3)):
        renderer.move("torus", translate=place)
        frame = renderer.render()
        assert_as_fresh(renderer, frame, "bvh", max_bounces=max_bounces)
        assert 0 < frame.stats.counters["rays"] < 0.5 * first.stats.counters["rays"]


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
