"""Rays that leave a surface: shadows begin where things touch, and do not depend on what else is in the scene."""

import dataclasses

import numpy as np
import pytest
from stress_cases import shadows
from stress_cases.outcomes import Outcome

import ldtrefl
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Light, Lighting, Material, Object, Scene

METHODS = [("bvh", {}), ("ldt", {}), ("ldt", {"quality": "exact"})]
DARK = Material(albedo=(0, 0, 0), mirror=(0.8,) * 3)


def outliers(distance: float) -> tuple[Object, ...]:
    """A box far away that makes the scene so much larger."""
    return (Object(shape="box", scale=0.3, translate=(-distance, 0.7 * distance, -0.3 * distance)),)


def test_shadows_are_where_geometry_says_and_a_wrong_one_is_found() -> None:
    """The stress test's case with small pictures, and its judge with a lit pixel at the contact, and a dark one."""
    outcomes = shadows.run(0, 96)
    assert len(outcomes) == 12 * 3 + 3
    assert all(o.passed for o in outcomes), [o for o in outcomes if not o.passed]
    scene = shadows.box_on_floor(1.0, 96)
    points, image = shadows.points_on_floor(scene, 1.0), ldtrefl.render(scene, "bvh").image[..., 0]
    for x, light in ((0.33, 1.0), (0.6, 1.0), (1.2, 0.0)):
        row, column = np.unravel_index(np.argmin(np.hypot(points[..., 0] - x, points[..., 1])), image.shape)
        changed = image.copy()
        changed[row, column] = light
        assert not shadows.judge_strip(Outcome(), changed, points).passed, x


@pytest.mark.parametrize(("method", "options"), METHODS)
@pytest.mark.parametrize("distance", [1e3, 1e6])
def test_a_small_object_in_a_large_scene_looks_as_alone(method: str, options: dict, distance: float) -> None:
    """Curved things, mirrors, a point light and shadows, alone and beside a box a million sizes away."""

    def picture(*others: Object) -> np.ndarray:
        scene = Scene(
            camera=Camera(eye=(1, -4, 2), look_at=(0, 0, 0.2), width=120, height=80, fov_y=40),
            lighting=Lighting(shadows=True),
            lights=(
                Light(kind="directional", direction=(0.5, 0.4, -0.8), radiance=(1, 1, 1)),
                Light(kind="point", position=(-1, -2, 2.5), intensity=(2, 2, 2)),
            ),
            objects=(
                Object(shape="plane", scale=2.0),
                Object(shape="sphere", scale=0.5, translate=(-0.6, 0, 0.5), material=DARK),
                Object(shape="torus", scale=0.4, translate=(0.4, 0.7, 0.15)),
                Object(shape="torus_knot", params={"segments": [200, 30]}, scale=0.4, translate=(0.6, -0.5, 0.3)),
                *others,
            ),
        )
        return ldtrefl.render(scene, method, **options).image

    differences = np.abs(picture(*outliers(distance)) - picture()).max(axis=2)
    assert (differences > 1e-4).sum() == 0, f"{(differences > 1e-4).sum()} pixels, up to {differences.max():.3g}"


@pytest.mark.parametrize(("method", "options"), METHODS)
@pytest.mark.parametrize("reach", [2.0, 1e3, 1e6])
def test_contact_shadow_on_a_floor_of_the_same_mesh(method: str, options: dict, reach: float) -> None:
    """The box and its floor as one mesh: two of its triangles may be a million times larger than the others."""
    box = shapes.make("box", {"segments": 8})
    corners = reach * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    n = len(box.vertices)
    vertices = np.vstack([0.3 * box.vertices + [0, 0, 0.3], corners])
    faces = np.vstack([box.faces, [[n, n + 1, n + 2], [n, n + 2, n + 3]]])
    scene = shadows.box_on_floor(1.0, 128)
    thing = Object(mesh=ldtrefl.Mesh(vertices, faces), smooth=False, material=shadows.WHITE)
    scene = dataclasses.replace(scene, objects=(thing,))
    image = ldtrefl.render(scene, method, **options).image[..., 0]
    outcome = shadows.judge_strip(Outcome(), image, shadows.points_on_floor(scene, 1.0))
    assert outcome.passed, outcome


def test_a_light_in_a_surface_gives_finite_pictures() -> None:
    """On the floor under a pixel's centre, and a hair above it: neither divides by 0."""
    camera = Camera(eye=(0, 0, 3), look_at=(0, 0, 0), up=(0, 1, 0), width=9, height=9)
    for height in (0.0, 1e-12, 1e-6):
        light = Light(kind="point", position=(0, 0, height), intensity=(1, 1, 1))
        scene = Scene(camera=camera, lights=(light,), lighting=Lighting(shadows=True), objects=(Object(shape="plane"),))
        assert np.isfinite(ldtrefl.render(scene, "ldt").image).all()


def test_the_brightest_scene_that_is_allowed_is_finite() -> None:
    """All as bright as may be, and lights within 1e-15 of a black floor, of a white one and of a mirror."""
    camera = Camera(eye=(0, 0, 3), look_at=(0, 0, 0), up=(0, 1, 0), width=9, height=9)
    light = Light(kind="point", position=(0, 0, 1e-15), intensity=(1e15,) * 3)
    for albedo, mirror in ((0.0, 0.0), (1e9, 0.0), (0.0, 1.0), (1e9, 1.0)):
        material = Material(albedo=albedo, mirror=mirror, emission=1e9)
        floor = Object(shape="plane", material=material)
        above = Object(shape="plane", translate=(0, 0, 4), material=material)
        scene = Scene(camera=camera, lights=(light,) * 64, objects=(floor, above))
        for method in ("ldt", "bvh", "envmap"):
            assert np.isfinite(ldtrefl.render(scene, method).image).all()
