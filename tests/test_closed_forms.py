"""Renderings whose radiance, or where reflected rays end, is known on paper."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene
from ldtrefl.world.camera import camera_axes

MIRROR = Material(albedo=(0, 0, 0), mirror=(1, 1, 1))
BLACK = Environment(sky=(0, 0, 0), ground=(0, 0, 0))


def emitter(color: tuple[float, float, float]) -> Material:
    return Material(albedo=(0, 0, 0), emission=color)


@pytest.mark.parametrize("method", ["bvh", "ldt"])
def test_plane_mirror_shows_the_virtual_image(method: str) -> None:
    """What the mirror shows of an object is what a camera sees of the mirrored object, to the pixel."""
    camera = Camera(eye=(2.5, -4.0, 1.5), look_at=(0, 0.5, 0), width=288, height=192, fov_y=40)
    knot = {"shape": "torus_knot", "params": {"segments": [200, 40]}, "scale": 0.8}
    wall = Object(shape="plane", scale=50.0, rotate=(1, 0, 0, 90), translate=(0, 1.0, 0), material=MIRROR)
    thing = Object(**knot, translate=(0, 0, 0), material=emitter((1, 1, 1)))
    reflected = ldtrefl.render(Scene(camera=camera, environment=BLACK, objects=(wall, thing)), method).reflection

    # Mirrored in y = 1; the mesh's vertices are mirrored too, as the knot is not symmetric.
    mesh = shapes.make("torus_knot", knot["params"])
    virtual = ldtrefl.Mesh(mesh.vertices * [1, -1, 1], mesh.faces[:, ::-1])
    twin = Object(mesh=virtual, scale=0.8, translate=(0, 2.0, 0), material=emitter((1, 1, 1)))
    expected = ldtrefl.render(Scene(camera=camera, environment=BLACK, objects=(twin,)), "bvh").image
    seen, truth = reflected[..., 0] > 0.5, expected[..., 0] > 0.5
    hidden = ldtrefl.render(Scene(camera=camera, environment=BLACK, objects=(thing,)), "bvh").image[..., 0] > 0.5
    wrong = (seen != truth) & ~hidden
    assert (truth & ~hidden).sum() > 500
    assert wrong.sum() == 0, f"{method}: {wrong.sum()} pixels differ"


def test_sphere_mirror_reflects_a_known_point() -> None:
    """Seen along its axis, a sphere of radius 1 reflects by r = d - 2 (d.n) n; the hit on a plane is known."""
    camera = Camera(eye=(0, 0, 10), look_at=(0, 0, 0), up=(0, 1, 0), width=65, height=65, fov_y=8)
    ball = Object(shape="sphere", params={"segments": [1024, 512]}, material=MIRROR)
    wall = Object(shape="plane", scale=40.0, rotate=(1, 0, 0, 180), translate=(0, 0, 11), material=emitter((1, 1, 1)))
    frame = ldtrefl.render(Scene(camera=camera, environment=BLACK, objects=(ball, wall)), "bvh")
    half = np.tan(np.radians(4.0))
    checked = 0
    for row, column in [(32, 32), (32, 44), (20, 30), (45, 50)]:
        direction = np.array([(2 * (column + 0.5) / 65 - 1) * half, -(2 * (row + 0.5) / 65 - 1) * half, -1.0])
        direction /= np.linalg.norm(direction)
        origin = np.array([0.0, 0.0, 10.0])
        b = origin @ direction
        point = origin + (-b - np.sqrt(b * b - origin @ origin + 1.0)) * direction
        reflected = direction - 2 * (direction @ point) * point
        distance = (11.0 - point[2]) / reflected[2]
        if reflected[2] > 0:
            assert frame.hits.distance[row, column] == pytest.approx(distance, rel=2e-4)
            checked += 1
    assert checked == 4


def test_diffuse_radiance_of_one_light() -> None:
    """albedo * (ambient + radiance * cos 60 degrees) + emission, on a facet that fills the image."""
    light = ldtrefl.Light(kind="directional", direction=(np.sin(np.pi / 3), 0, -np.cos(np.pi / 3)), radiance=(2, 2, 2))
    floor = Object(shape="plane", scale=10.0, material=Material(albedo=(0.5, 0.25, 1.0), emission=(0.1, 0.2, 0.3)))
    scene = Scene(
        camera=Camera(eye=(0, 0, 3), look_at=(0, 0, 0), up=(0, 1, 0), width=8, height=8),
        lighting=Lighting(ambient=(0.2, 0.2, 0.2)),
        lights=(light,),
        objects=(floor,),
    )
    image = ldtrefl.render(scene, "bvh").image
    np.testing.assert_allclose(
        image, np.broadcast_to([0.5 * 1.2 + 0.1, 0.25 * 1.2 + 0.2, 1.2 + 0.3], image.shape), 1e-5
    )


def test_point_light_falls_off_with_the_square_of_the_distance_at_any_scale() -> None:
    for size in (1e-3, 1.0, 1e4):
        light = ldtrefl.Light(kind="point", position=(0, 0, 2 * size), intensity=(4 * size**2,) * 3)
        floor = Object(shape="plane", scale=0.01 * size, material=Material(albedo=(1, 1, 1)))
        camera = Camera(eye=(0, 0, size), look_at=(0, 0, 0), up=(0, 1, 0), width=3, height=3, fov_y=0.1)
        scene = Scene(camera=camera, lighting=Lighting(ambient=(0, 0, 0)), lights=(light,), objects=(floor,))
        np.testing.assert_allclose(ldtrefl.render(scene, "bvh").image, 1.0, rtol=1e-4)


def test_mirror_adds_reflectance_times_reflected_radiance() -> None:
    mirror = Material(albedo=(0, 0, 0), mirror=(0.5, 0.25, 1.0))
    scene = Scene(
        camera=Camera(eye=(0, 0, 3), look_at=(0, 0, 0), up=(0, 1, 0), width=8, height=8),
        environment=Environment(sky=(0.8, 0.8, 0.8), ground=(0.8, 0.8, 0.8)),
        objects=(Object(shape="plane", scale=10.0, material=mirror),),
    )
    frame = ldtrefl.render(scene, "bvh")
    np.testing.assert_allclose(frame.reflection, 0.8, rtol=1e-6)
    np.testing.assert_allclose(frame.image, np.broadcast_to([0.4, 0.2, 0.8], frame.image.shape), rtol=1e-6)


def test_fresnel_follows_schlick() -> None:
    angle = np.radians(70.0)
    mirror = Material(albedo=(0, 0, 0), mirror=(0.04, 0.04, 0.04), fresnel=True)
    camera = Camera(eye=(0, -np.sin(angle), np.cos(angle)), look_at=(0, 0, 0), width=1, height=1, fov_y=0.01)
    white = Environment(sky=(1, 1, 1), ground=(1, 1, 1))
    plane = Object(shape="plane", material=mirror)
    image = ldtrefl.render(Scene(camera=camera, environment=white, objects=(plane,)), "bvh").image
    np.testing.assert_allclose(image, 0.04 + 0.96 * (1 - np.cos(angle)) ** 5, rtol=1e-4)


@pytest.mark.parametrize("method", ["bvh", "ldt", "envmap"])
def test_an_eye_in_a_mirrors_surface_sees_a_finite_picture(method: str) -> None:
    """The direction from the eye to a point that it touches is not defined."""
    for shape, eye in (("sphere", (0, 0, 1)), ("plane", (0, 0, 0)), ("box", (1, 1, 1))):
        camera = Camera(eye=eye, look_at=(0, 0.1, -2), width=9, height=9)
        objects = (Object(shape=shape, material=MIRROR), Object(shape="box", translate=(3, 0, 0)))
        frame = ldtrefl.render(Scene(camera=camera, objects=objects), method)
        assert np.isfinite(frame.image).all() and np.isfinite(frame.reflection).all()


@pytest.mark.parametrize("method", ["bvh", "ldt"])
def test_facing_mirrors_bounce(method: str) -> None:
    """Two mirrors and an emitter seen after two reflections: reflectance squared times emission."""
    half = Material(albedo=(0, 0, 0), mirror=(0.5, 0.5, 0.5))
    front = Object(shape="plane", scale=0.5, rotate=(1, 0, 0, 90), translate=(0, 2, 0), material=half)
    back = Object(shape="plane", scale=5.0, rotate=(1, 0, 0, -90), translate=(0, -4, 0), material=half)
    glow = Object(shape="box", scale=(4.0, 0.1, 4.0), translate=(0, 5, 0), material=emitter((1, 1, 1)))
    scene = Scene(
        camera=Camera(eye=(1.2, -3, 0), look_at=(0.45, 2, 0), width=3, height=3, fov_y=0.5),
        environment=BLACK,
        lighting=Lighting(ambient=(0, 0, 0)),
        objects=(front, back, glow),
    )
    # Front mirror, back mirror, past the front mirror to the glow.
    np.testing.assert_allclose(ldtrefl.render(scene, method, max_bounces=1).image, 0.0, atol=1e-6)
    np.testing.assert_allclose(ldtrefl.render(scene, method, max_bounces=2).image, 0.25, rtol=1e-6)


@pytest.mark.parametrize("method", ["bvh", "ldt", "envmap"])
def test_shadow_falls_where_geometry_says(method: str) -> None:
    """A unit ball over a floor, light straight down: dark within radius 1 but for the tessellation, lit beyond."""
    light = ldtrefl.Light(kind="directional", direction=(0, 0, -1), radiance=(1, 1, 1))
    ball = Object(shape="sphere", translate=(0, 0, 2.0))
    floor = Object(shape="plane", scale=4.0, material=Material(albedo=(1, 1, 1)))
    camera = Camera(eye=(0, -4, 0.9), look_at=(0, 0, 0), width=96, height=64, fov_y=40)
    scene = Scene(
        camera=camera,
        lighting=Lighting(ambient=(0, 0, 0), shadows=True),
        lights=(light,),
        objects=(ball, floor),
    )
    image = ldtrefl.render(scene, method).image[..., 0]
    x, y = np.meshgrid(np.arange(96) + 0.5, np.arange(64) + 0.5)
    right, down, forward = camera_axes(camera)
    half = np.tan(np.radians(20.0))
    across, along = (2 * x / 96 - 1) * half * 96 / 64, (2 * y / 64 - 1) * half
    rays = forward + across[..., None] * right + along[..., None] * down
    with np.errstate(divide="ignore"):
        points = np.array(camera.eye) + (-0.9 / rays[..., 2])[..., None] * rays
    on_floor = (rays[..., 2] < 0) & (np.abs(points[..., :2]).max(axis=-1) < 3.9)
    radius = np.hypot(points[..., 0], points[..., 1])
    assert (on_floor & (radius < 0.97)).sum() > 100 and (on_floor & (radius > 1.03)).sum() > 100
    np.testing.assert_array_equal(image[on_floor & (radius < 0.97)], 0.0)
    np.testing.assert_allclose(image[on_floor & (radius > 1.03)], 1.0, rtol=1e-6)
