"""Python's classes refuse what the scene file's tables refuse, in one line that names the class and the key."""

import dataclasses
import logging
from collections.abc import Callable

import numpy as np
import pytest

import ldtrefl
from ldtrefl import Camera, Environment, InputError, Light, Lighting, Material, Object, Reflection, Scene
from ldtrefl.base.notices import warn_once
from ldtrefl.scene import description

CAMERA = Camera(eye=(0, -5, 1), look_at=(0, 0, 0), width=8, height=6)
BOX = Object(name="box", shape="box")

WRONG: list[tuple[Callable[[], object], str]] = [
    (lambda: Camera(eye=(0, "far", 1), look_at=(0, 0, 0)), r"Camera: eye\[1\]: "),
    (lambda: Camera(eye=(0, 1), look_at=(0, 0, 0)), r"Camera: eye\[2\]: "),
    (lambda: Camera(eye=(0, 0, 1)), "Camera: look_at: "),
    (lambda: Camera(eye=(0, 0, 1), look_at=(0, 0, 0)), "Camera: up is parallel"),
    (lambda: Camera(eye=(1, 0, 0), look_at=(0, 0, 0), width=10**5000), "Camera: width: "),
    (lambda: Camera(eye=(10**400, 0, 0), look_at=(0, 0, 0)), r"Camera: eye\[0\]: "),
    (lambda: Camera(eye=(1, 0, 0), look_at=(0, 0, 0), up=(0, 0, 1e-300)), "Camera: up: must not be the zero vector"),
    (lambda: Camera(eye=(1e-300, 0, 0), look_at=(0, 0, 0)), "Camera: eye and look_at are the same point"),
    (lambda: Camera(eye=(1, 0, 0), look_at=(0, 0, 0), fov_y=1e-300), "Camera: fov_y: "),
    (lambda: Environment(skye=1.0), "Environment: unknown key 'skye'; did you mean 'sky'"),
    (lambda: Environment(sky="blue"), "Environment: sky: should be a list, got 'blue'"),
    (lambda: Lighting(ambient=-1.0), "Lighting: ambient: should be greater than or equal to 0"),
    (lambda: Light(kind="point", position=(0, 0, 1)), "Light: a point light needs 'intensity'"),
    (lambda: Light(kind="directional", direction=(1e-300, 0, 0), radiance=1), "Light: direction: must not be the zero"),
    (lambda: Material(mirror=1.5), "Material: mirror: should be less than or equal to 1, got 1.5"),
    (lambda: Material(mirror=(0.5, 2, 0)), r"Material: mirror\[1\]: "),
    (lambda: Material(albedo=True), "Material: albedo: "),
    (lambda: Object(shape="box", translate=(0, True, 0)), r"Object: translate\[1\]: should be a valid number"),
    (lambda: Material(albedo=float("nan")), "Material: albedo: should be a finite number"),
    (lambda: Object(shape="box", scale=-1.0), "Object: scale: should be from 1e-15 to 1e.15, got -1$"),
    (lambda: Object(shape="box", scale=(1, 1, 1e-300)), r"Object: scale\[2\]: should be from 1e-15"),
    (lambda: Object(shape="box", fit=1e-300), "Object: fit: should be from 1e-15"),
    (lambda: Object(shape="box", rotate=(0, 1e-300, 0, 3)), "Object: rotate: the axis"),
    (lambda: Object(shape="box", material={"mirror": 3}), "Object: material.mirror: "),  # type: ignore[arg-type]
    (lambda: Object(shape="box", material=CAMERA), "Object: material: "),  # type: ignore[arg-type]
    (lambda: Reflection(max_bounces=0), "Reflection: max_bounces: "),
    (lambda: description.Expectation(ssim=2.0), "Expectation: ssim: "),
    (lambda: Scene(camera="front"), "Scene: camera: "),  # type: ignore[arg-type]
    (lambda: Scene(camera=CAMERA, lights=[{"kind": "tube"}]), r"Scene: lights\[0\]\.kind: "),  # type: ignore[list-item]
    (lambda: Scene(camera=CAMERA, objekts=()), "Scene: unknown key 'objekts'; did you mean 'objects'"),  # type: ignore[call-arg]
    (lambda: dataclasses.replace(CAMERA, width=0), "Camera: width: "),
    (lambda: Scene(camera=CAMERA, objects=(BOX,)).with_object("box", scale=0), "object 'box': Object: scale: "),
    (lambda: ldtrefl.render("scene.toml"), "a Scene is needed, got str"),  # type: ignore[arg-type]
    (lambda: ldtrefl.Renderer(None), "a Scene is needed, got NoneType"),  # type: ignore[arg-type]
    (lambda: ldtrefl.Renderer(Scene(camera=CAMERA)).render("front"), "a Camera is needed, got str"),  # type: ignore[arg-type]
]


@pytest.mark.parametrize(("make", "message"), WRONG, ids=[message for _, message in WRONG])
def test_wrong_values_raise_one_line(make: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value) and "function-" not in str(caught.value)
    assert isinstance(caught.value, ValueError)


def test_values_go_by_name() -> None:
    with pytest.raises(TypeError, match=r"Camera takes its values by name, such as Camera\(eye=\.\.\.\)"):
        Camera((0, -5, 1), (0, 0, 0))  # type: ignore[misc]


def test_one_number_is_a_grey() -> None:
    assert Material(mirror=0.5, albedo=1, emission=2.0) == Material(
        mirror=(0.5, 0.5, 0.5), albedo=(1.0, 1.0, 1.0), emission=(2.0, 2.0, 2.0)
    )
    assert Environment(sky=1.0, ground=0).sky == (1.0, 1.0, 1.0)
    assert Lighting(ambient=0.25).ambient == (0.25, 0.25, 0.25)
    assert Light(kind="point", position=(0, 0, 1), intensity=4).intensity == (4.0, 4.0, 4.0)


def test_numpy_values_are_taken() -> None:
    camera = Camera(eye=np.array([0, -5, 1]), look_at=np.zeros(3, np.float32), width=np.int64(8), height=np.uint16(6))
    assert camera == CAMERA
    assert Object(shape="box", scale=np.float32(2.0), smooth=np.bool_(False)).scale == 2.0
    assert Material(mirror=np.full(3, 0.5)).mirror == (0.5, 0.5, 0.5)
    single = Camera(eye=(np.int64(0), np.float32(-5), np.float64(1)), look_at=[0, 0, 0], width=8, height=6)
    assert single == CAMERA and {type(number) for number in single.eye} == {float}


def test_albedo_that_nobody_stated() -> None:
    """0.8, or 0 beside a mirror; a material made from another follows the same rule, a stated albedo stays."""
    replace = dataclasses.replace
    assert Material().albedo == (0.8, 0.8, 0.8)
    assert Material(mirror=(0.0, 0.1, 0.0)).albedo == (0.0, 0.0, 0.0)
    assert replace(Material(), mirror=0.9).albedo == (0.0, 0.0, 0.0)
    assert replace(Material(mirror=0.9), mirror=0).albedo == (0.8, 0.8, 0.8)
    assert replace(Material(albedo=0.8), mirror=0.1).albedo == (0.8, 0.8, 0.8)
    assert replace(Material(mirror=0.9), texture="wood.png").albedo == (0.0, 0.0, 0.0)


def test_more_light_than_falls_on_it_is_said_once(caplog: pytest.LogCaptureFixture) -> None:
    warn_once.cache_clear()
    with caplog.at_level(logging.WARNING, "ldtrefl"):
        bright = Object(name="lamp [x]", shape="sphere", material=Material(albedo=(0.1, 0.8, 0.1), mirror=0.5))
        dataclasses.replace(bright, scale=2.0)
        Object(name="fair", shape="sphere", material=Material(albedo=0.1, mirror=0.9))
    assert [record.getMessage() for record in caplog.records] == [
        "object 'lamp [x]': material.albedo and material.mirror add up to 1.3 in green: "
        "above 1 it gives back more light than falls on it"
    ]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("method", ["ldt", "bvh"])
def test_no_size_that_is_allowed_overflows(method: str) -> None:
    """A tiny mirror and a huge box, and the other way round: a finite picture, and nothing said by NumPy."""
    for small, large in ((1e-15, 1.0), (1.0, 1e15), (1e-15, 1e15)):
        mirror = Object(shape="sphere", params={"segments": [16, 8]}, scale=small, material=Material(mirror=1))
        box = Object(shape="box", scale=large / 2, translate=(large, 0, 0))
        for camera in (
            Camera(eye=(0, -5 * small, small), look_at=(0, 0, 0), width=8, height=6),
            Camera(eye=(0, -large, 0), look_at=(large, 0, 0), width=8, height=6, fov_y=1e-6),
        ):
            assert np.isfinite(ldtrefl.render(Scene(camera=camera, objects=(mirror, box)), method).image).all()


def test_sizes_that_multiply_out_of_range_are_refused() -> None:
    for changes in ({"fit": 1e15, "scale": 10.0}, {"fit": 1e-15, "scale": (1.0, 1.0, 0.5)}):
        with pytest.raises(InputError, match=r"give a size of .*, allowed are 1e-15 to 1e.15"):
            Object(shape="box", **changes).world_from_object()
    mesh = ldtrefl.Mesh(np.eye(3) * 1e100, [[0, 1, 2]])
    with pytest.raises(InputError, match=r"own size of 1e.100"):
        Object(mesh=mesh).world_from_object()
    assert np.isfinite(Object(mesh=mesh, fit=2.0).world_from_object()).all()


def test_the_brightest_light_in_the_smallest_scene_is_finite() -> None:
    """Its intensity over the square of a distance would be infinite, and the picture NaN."""
    lamp = Light(kind="point", position=(0, 0, 3e-15), intensity=1e15)
    camera = Camera(eye=(0, -5e-15, 4e-15), look_at=(0, 0, 0), width=8, height=8)
    frame = ldtrefl.render(Scene(camera=camera, lights=(lamp,), objects=(Object(shape="box", scale=1e-15),)))
    assert np.isfinite(frame.image).all() and frame.image.max() > 1e15
