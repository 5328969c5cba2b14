"""What a ``Renderer`` promises: arrays are the caller's, and a call that fails or is stopped changes nothing."""

import dataclasses
import sys
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest
from stress_cases.histories import difference

import ldtrefl
from ldtrefl import renderer as renderer_module
from ldtrefl.device import launch
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.renderer import Frame
from ldtrefl.scene.description import Object
from tests.frame_scenes import assert_as_fresh, scene


def test_a_move_that_cannot_be_is_refused() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    with pytest.raises(ldtrefl.InputError, match=r"unknown object 'toros'; did you mean 'torus'\?"):
        renderer.move("toros", scale=2.0)
    with pytest.raises(ldtrefl.InputError, match=r"scale: should be from 1e-15 to 1e\+15, got -1"):
        renderer.move("torus", scale=-1.0)
    with pytest.raises(ldtrefl.InputError, match=r"rotate: the axis must not be the zero vector"):
        renderer.move("torus", rotate=(0, 0, 0, 10))


def scribble(values: Iterable[np.ndarray]) -> None:
    """Write into every element of some arrays."""
    for array in values:
        array[...] = 1 if array.dtype == bool else 77


def arrays_of(frame: Frame, drawn: GBuffer) -> list[np.ndarray]:
    """All arrays that a frame and its G-buffer hand out."""
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


class Stop(BaseException):
    """Stands for the exception that Ctrl-C raises."""


def stopping_at(monkeypatch: pytest.MonkeyPatch, launches: int) -> Callable[[], None]:
    """Let so many launches run and have the next one raise ``Stop``. The function that is returned undoes this."""
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


@pytest.mark.parametrize("launches", range(0, 13, 3))  # of the 13 that the frame needs
def test_a_frame_that_is_stopped_leaves_nothing_half_done(launches: int, monkeypatch: pytest.MonkeyPatch) -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt", error=1.0)
    renderer.render()
    renderer.move("torus", translate=(-1.2, -1.3, 0.1))
    renderer.render()
    renderer.move("knot", translate=(1.2, -1.3, 0.1))
    go_on = stopping_at(monkeypatch, launches)
    with pytest.raises(Stop):
        renderer.render()
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

    monkeypatch.setattr(Object, "changed", fail)
    with pytest.raises(Stop):
        renderer.move("torus", translate=(1.0, 0.0, 0.0))
    monkeypatch.undo()
    assert renderer.scene.objects == scene().objects
    assert difference(renderer.render(), before) == ""
    # Of a move that counts the way to the device is tried again.
    renderer.move("torus", translate=(1.0, 0.0, 0.0))
    monkeypatch.setattr(renderer_module, "DeviceScene", fail)
    with pytest.raises(Stop):
        renderer.render()
    monkeypatch.undo()
    assert_as_fresh(renderer, renderer.render())


def test_changes_between_two_frames_add_up() -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    renderer.render()
    renderer.move("torus", translate=(9.0, 0.0, 0.0))
    renderer.move("knot", translate=(1.2, -1.4, 0.3))
    renderer.move("torus", scale=0.3)
    given = scene().objects[scene().number_of("torus")].geometry.vertices
    renderer.update_vertices("torus", 1.1 * given)
    renderer.move("torus", translate=(-1.2, -1.4, 0.1))
    torus = renderer.scene.objects[renderer.scene.number_of("torus")]
    assert torus.scale == 0.3 and torus.translate == (-1.2, -1.4, 0.1)
    np.testing.assert_array_equal(torus.geometry.vertices, 1.1 * given)
    assert_as_fresh(renderer, renderer.render())


def test_a_scene_goes_to_the_device_once_for_all_that_moved(monkeypatch: pytest.MonkeyPatch) -> None:
    renderer, made = ldtrefl.Renderer(scene(), "bvh"), []
    whole = renderer_module.DeviceScene
    monkeypatch.setattr(renderer_module, "DeviceScene", lambda *a, **n: made.append(a) or whole(*a, **n))
    for k in range(5):
        renderer.move("torus", translate=(0.1 * k, -1.5, 0.0))
        renderer.move("knot", scale=0.3 + 0.1 * k)
    assert made == []
    renderer.render()
    renderer.render()
    assert len(made) == 1


def test_a_move_to_a_size_that_is_not_allowed_names_the_object() -> None:
    renderer = ldtrefl.Renderer(scene(objects=(Object(name="a", shape="box", fit=1e15),)), "bvh")
    with pytest.raises(ldtrefl.InputError, match=r"^object 'a': fit 1e\+15, scale 10.0 and the mesh's own size of 2"):
        renderer.move("a", scale=10.0)


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
