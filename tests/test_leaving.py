"""Rays that leave a surface: shadows begin where things touch, and do not depend on what else is in the scene."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl import shapes
from ldtrefl.camera import camera_axes
from ldtrefl.scene import Camera, Light, Lighting, Material, Object, Scene

METHODS = [("bvh", {}), ("ldt", {}), ("ldt", {"quality": "exact"})]
WHITE = Material(albedo=(1, 1, 1))
DARK = Material(albedo=(0, 0, 0), mirror=(0.8,) * 3)


def box_on_floor(size: float, *others: Object, floor: float = 2.0) -> Scene:
    """A box from -0.3 to 0.3 that stands on a floor; light falls at 45 degrees towards +x."""

    def place(x: float, y: float, z: float) -> tuple[float, float, float]:
        return size * x, size * y, size * z

    return Scene(
        camera=Camera(eye=place(1.6, -0.9, 1.0), look_at=place(0.5, 0, 0), width=160, height=120, fov_y=35),
        lighting=Lighting(ambient=(0, 0, 0), shadows=True),
        lights=(Light(kind="directional", direction=(1, 0, -1), radiance=(np.sqrt(2.0),) * 3),),
        objects=(
            Object(shape="plane", scale=floor * size, rotate=(0, 0, 1, 10), material=WHITE),
            Object(shape="box", scale=0.3 * size, translate=place(0, 0, 0.3), material=WHITE),
            *others,
        ),
    )


def points_on_floor(scene: Scene, size: float) -> np.ndarray:
    """(h, w, 3) where each pixel's ray meets the floor, in sizes; NaN where it does not."""
    camera = scene.camera
    right, down, forward = camera_axes(camera)
    half = np.tan(np.radians(camera.fov_y / 2))
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    across = (2 * x / camera.width - 1) * half * camera.width / camera.height
    rays = forward + across[..., None] * right + ((2 * y / camera.height - 1) * half)[..., None] * down
    eye = np.asarray(camera.eye) / size
    return eye + np.where(rays[..., 2] < 0, -eye[2] / rays[..., 2], np.nan)[..., None] * rays


def strays(distance: float) -> tuple[Object, ...]:
    """A box far away that makes the scene so much larger."""
    return (Object(shape="box", scale=0.3, translate=(-distance, 0.7 * distance, -0.3 * distance)),)


@pytest.mark.parametrize(("method", "options"), METHODS)
@pytest.mark.parametrize(
    ("size", "others", "floor"),
    [
        (1e-4, (), 2.0),
        (1.0, (), 2.0),
        (1e4, (), 2.0),
        (1.0, strays(1e3), 2.0),
        (1.0, strays(1e4), 2.0),
        (1.0, strays(1e6), 2.0),
        (1.0, strays(1e8), 2.0),
        (1.0, (), 1e4),
        (1.0, (), 1e6),
    ],
    ids=["tiny", "one", "large", "stray 1e3", "stray 1e4", "stray 1e6", "stray 1e8", "floor 1e4", "floor 1e6"],
)
def test_contact_shadow_is_where_geometry_says(
    method: str, options: dict, size: float, others: tuple[Object, ...], floor: float
) -> None:
    """The box's shadow is the strip 0.3 < x < 0.9, |y| < 0.3 of the floor, from where the box touches it."""
    scene = box_on_floor(size, *others, floor=floor)
    points = points_on_floor(scene, size)
    # Seen past the box: in front of its plane y = -0.3, or beyond x = 0.3.
    x, y = points[..., 0], points[..., 1]
    image = ldtrefl.render(scene, method, **options).image[..., 0]
    margin = 1e-4
    inside = (x > 0.3 + margin) & (x < 0.9 - margin) & (np.abs(y) < 0.3 - margin)
    outside = (np.abs(x) < 1.9) & (np.abs(y) < 1.9) & ((y < -0.3 - margin) | (x > 0.9 + margin))
    ring = inside & (x < 0.31)
    assert inside.sum() > 1000 and outside.sum() > 1000 and ring.sum() > 20
    assert (image[inside] == 0.0).all(), f"{(image[inside] != 0).sum()} lit, {(image[ring] != 0).sum()} at the contact"
    np.testing.assert_allclose(image[outside], 1.0, rtol=1e-5)


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

    differences = np.abs(picture(*strays(distance)) - picture()).max(axis=2)
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
    scene = box_on_floor(1.0)
    thing = Object(mesh=ldtrefl.Mesh(vertices, faces), smooth=False, material=WHITE)
    scene = dataclasses.replace(scene, objects=(thing,))
    points = points_on_floor(scene, 1.0)
    x, y = points[..., 0], points[..., 1]
    image = ldtrefl.render(scene, method, **options).image[..., 0]
    inside = (x > 0.3 + 1e-4) & (x < 0.9 - 1e-4) & (np.abs(y) < 0.3 - 1e-4)
    outside = (np.abs(x) < 1.9) & (np.abs(y) < 1.9) & ((y < -0.3 - 1e-4) | (x > 0.9 + 1e-4))
    assert inside.sum() > 1000 and outside.sum() > 1000
    assert (image[inside] == 0.0).all(), f"{(image[inside] != 0).sum()} lit"
    np.testing.assert_allclose(image[outside], 1.0, rtol=1e-5)


@pytest.mark.parametrize(
    ("shape", "segments"), [("torus_knot", (2000, 125)), ("sphere", (1000, 500)), ("torus", (1000, 400))]
)
def test_dense_smooth_meshes_do_not_shade_themselves(shape: str, segments: tuple[int, int]) -> None:
    """Patches stand for their triangles and lie a little above them: no speck of shadow on what is lit."""
    scene = Scene(
        camera=Camera(eye=(1, -4, 2), look_at=(0, 0, 0), width=160, height=160, fov_y=32),
        lighting=Lighting(ambient=(0, 0, 0), shadows=True),
        lights=(Light(kind="directional", direction=(0.9, 0.3, -0.3), radiance=(1, 1, 1)),),
        objects=(Object(shape=shape, params={"segments": segments}),),
    )
    truth = ldtrefl.render(scene, "bvh").image[..., 0]
    image = ldtrefl.render(scene, "ldt").image[..., 0]
    assert (truth > 0.02).sum() > 3000 and (truth == 0.0).sum() > 1000
    assert (np.abs(image - truth) > 0.02).sum() <= 1


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
