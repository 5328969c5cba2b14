"""Environment mapping: faces and their axes, what is far away against closed forms, and cube maps that follow moves."""

import dataclasses

import numpy as np
import pytest
import warp as wp
from stress_cases.histories import difference

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.compare.metrics import ssim
from ldtrefl.device import launch
from ldtrefl.methods.envmap import reflect_cube
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene
from ldtrefl.tracing.ray_buffers import empty_rays
from tests.frame import flat_mirror
from tests.frame_scenes import scene
from tests.methods.cube_maps.rooms import lit_room, texels

PROJECTIONS = ("infinite", "sphere", "box", "distance", "layered")

CAMERA = Camera(eye=(0.5, -4.0, 1.0), look_at=(0, 0, 0), width=60, height=40, fov_y=40)
BALL = Object(shape="sphere", material=Material(albedo=0.0, mirror=1.0))


def ball_scene(*others: Object, **changes: object) -> Scene:
    """The mirror ball and other objects."""
    return Scene(camera=CAMERA, objects=(BALL, *others), **changes)


def looked_up(cube: np.ndarray, resolution: int, directions: np.ndarray) -> np.ndarray:
    """(n, 3) what rays of reflector 0 find in a cube map."""
    device, count = launch.resolve_device(None), len(directions)
    rays = empty_rays(count, device)
    rays.direction = wp.array(directions.astype(np.float32), dtype=wp.vec3, device=device)
    rays.source.fill_(0)
    radiance = wp.zeros(count, dtype=wp.vec3, device=device)
    inputs = [rays, 0, wp.array(cube, dtype=wp.vec3, device=device), resolution, radiance]
    launch.launch(reflect_cube, count, inputs, device)
    return radiance.numpy()


def test_a_cube_map_is_read_where_its_cameras_looked() -> None:
    """Every pixel holds its own direction, at depth 1: bilinear reading is exact but at a face's border."""
    resolution = 16
    cube = texels(resolution)
    directions = np.random.default_rng(4).normal(size=(2000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    at_depth_1 = directions / np.abs(directions).max(axis=1, keepdims=True)
    inner = np.sort(np.abs(at_depth_1), axis=1)[:, 1] < 1 - 1 / resolution
    found = looked_up(cube.astype(np.float32), resolution, directions)
    assert inner.sum() > 1000
    np.testing.assert_allclose(found[inner], at_depth_1[inner], atol=1e-5)
    # Beyond the outermost centres the border's pixel is taken: half a pixel off at most.
    np.testing.assert_allclose(found, at_depth_1, atol=1.001 / resolution)


def test_rays_of_other_reflectors_are_left_alone() -> None:
    device = launch.resolve_device(None)
    rays, cube = empty_rays(2, device), wp.array(np.ones((6, 3), np.float32), dtype=wp.vec3, device=device)
    rays.direction = wp.array([(1, 0, 0), (1, 0, 0)], dtype=wp.vec3, device=device)
    rays.source = wp.array([3, 5], dtype=wp.int32, device=device)
    radiance = wp.array([(7, 7, 7), (7, 7, 7)], dtype=wp.vec3, device=device)
    launch.launch(reflect_cube, 2, [rays, 5, cube, 1, radiance], device)
    assert radiance.numpy().tolist() == [[7, 7, 7], [1, 1, 1]]


def errors(given: Scene, **options: object) -> dict[str, float]:
    """By projection, the root of the mean squared error of what is reflected, over what is reflected on average."""
    truth = ldtrefl.render(given, "bvh", samples=1, max_bounces=1)
    mask, found = truth.reflector_mask, {}
    for name in PROJECTIONS:
        frame = ldtrefl.render(given, "envmap", samples=1, projection=name, **options)
        off = (frame.reflection - truth.reflection)[mask].astype(float)
        found[name] = float(np.sqrt((off**2).mean()) / truth.reflection[mask].mean())
    return found


def test_a_spherical_room_is_exact_but_at_infinity() -> None:
    """The mirror is in its middle. What is left is what its triangles and the map's texels differ by."""
    off = errors(lit_room("sphere", (2.0, 2.0, 2.0), (0.0, 0.0, 0.0)))
    assert off["infinite"] > 0.1 and max(off[name] for name in ("sphere", "distance", "layered")) < 2e-3, off


def test_a_box_is_exact_but_for_spheres_and_at_infinity() -> None:
    """The mirror stands aside in the room. Where two walls meet, the picture is as coarse as the map's texels."""
    off = errors(lit_room("box", (2.5, 2.0, 1.5), (0.5, -0.2, 0.3)))
    assert min(off["infinite"], off["sphere"]) > 0.1, off
    assert max(off[name] for name in ("box", "distance", "layered")) < 0.01, off


def test_a_sphere_has_the_radius_that_is_asked_for() -> None:
    room = lit_room("sphere", (2.0, 2.0, 2.0), (0.0, 0.0, 0.0))
    frames = [
        ldtrefl.render(room, "envmap", samples=1, projection="sphere", radius=radius).reflection
        for radius in (None, 2.0, 4.0, 1e9)
    ]
    infinite = ldtrefl.render(room, "envmap", samples=1).reflection
    assert np.abs(frames[1] - frames[0]).max() < 2e-3 * frames[0].max() < np.abs(frames[2] - frames[0]).max()
    np.testing.assert_allclose(frames[3], infinite, rtol=1e-4, atol=1e-6)


def test_a_radius_without_a_sphere_is_refused() -> None:
    with pytest.raises(ldtrefl.InputError, match=r"^method envmap: radius: only projection=sphere has one, got .*box"):
        ldtrefl.Renderer(ball_scene(), "envmap", projection="box", radius=2.0)
    with pytest.raises(ldtrefl.InputError, match=r"^method envmap: radius: "):
        ldtrefl.Renderer(ball_scene(), "envmap", projection="sphere", radius=-2.0)
    with pytest.raises(ldtrefl.InputError, match=r"^method envmap: projection: .*'infinite', 'sphere', 'box'"):
        ldtrefl.Renderer(ball_scene(), "envmap", projection="cube")


def test_what_a_plate_hides_from_the_centre_is_found_in_the_second_layer() -> None:
    """A glowing plate stands behind a black one: the mirror's rim sees it, its centre does not."""
    dark = {"environment": Environment(sky=(0, 0, 0), ground=(0, 0, 0)), "lighting": Lighting(ambient=0.0)}
    glow, black = Material(albedo=0.0, emission=1.0), Material(albedo=0.0)
    plate = Object(shape="plane", scale=0.6, rotate=(0, 1, 0, 90), translate=(2.0, 0.0, 0.0), material=black)
    lamp = Object(shape="plane", scale=0.8, rotate=(0, 1, 0, 90), translate=(4.0, 0.0, 0.0), material=glow)
    camera = Camera(eye=(-2.0, 5.2, 0.0), look_at=(0.5, 0.85, 0), width=60, height=60, fov_y=3)
    given = dataclasses.replace(ball_scene(plate, lamp, **dark), camera=camera)
    truth = ldtrefl.render(given, "bvh", samples=1).reflection[..., 0] > 0.5
    shown = {
        name: ldtrefl.render(given, "envmap", samples=1, projection=name).reflection[..., 0] > 0.5
        for name in PROJECTIONS
    }
    assert truth.sum() > 200
    assert (shown.pop("layered") != truth).sum() < 0.1 * truth.sum()
    assert not any(image.any() for image in shown.values())


def test_far_from_everything_all_projections_are_alike() -> None:
    """A ball of radius 1, and things of every colour a thousand times as far away."""
    things = [
        Object(
            shape=shape,
            scale=250.0,
            translate=tuple(1000.0 * np.array(way, float)),
            material=Material(albedo=0.2, emission=color),
        )
        for shape, way, color in (
            ("sphere", (1, 0, 0), (1, 0, 0)),
            ("box", (-1, -0.4, 0.2), (0, 1, 0)),
            ("torus", (0.3, -1, 0.3), (0, 0, 1)),
            ("sphere", (0.1, -0.6, 0.8), (1, 1, 0)),
        )
    ]
    given = ball_scene(*things)
    truth = ldtrefl.render(given, "bvh", samples=1)
    for name in PROJECTIONS:
        image = ldtrefl.render(given, "envmap", samples=1, projection=name, resolution=1024).image
        value = ssim(image, truth.image, truth.reflector_mask)
        assert value >= 0.99, f"envmap, projection={name}: SSIM {value:.4f}, 0.99 expected"


def test_projections_are_ordered_in_a_room_with_things_in_it() -> None:
    room = lit_room("box", (2.5, 2.0, 1.5), (0.5, -0.2, 0.0))
    glow = Material(albedo=0.0, emission=(0.3, 0.1, 0.0))
    pillar = Object(name="pillar", shape="box", scale=(0.2, 0.2, 1.0), translate=(-0.7, 0.6, -0.5), material=glow)
    off = errors(dataclasses.replace(room, objects=(*room.objects, pillar)))
    assert off["infinite"] > off["box"] > off["distance"] > off["layered"], off


def test_what_is_infinitely_far_is_right() -> None:
    """A flat mirror alone under the environment: a blend by height, which bilinear reading is a pixel off at most."""
    given = flat_mirror.scene()
    alone = dataclasses.replace(given, objects=given.objects[:1])
    frame = ldtrefl.render(alone, "envmap", resolution=256)
    rays = flat_mirror.reflection(flat_mirror.scene(place=(0.0, 0.0, 90.0)))
    expected = flat_mirror.environment(rays.direction)
    np.testing.assert_allclose(frame.reflection.reshape(-1, 3)[rays.pixels], expected, atol=1.0 / 256)
    assert frame.hits is None and "cubemap" in frame.stats.seconds


def test_a_wall_is_reflected_by_direction_alone() -> None:
    """The wall at x = 3 fills a cone about +x from the mirror's centre, wherever on the mirror it is looked at from."""
    given = flat_mirror.scene(environment=Environment(sky=(0, 0, 0), ground=(0, 0, 0)))
    glow = Material(albedo=0.0, emission=(1.0, 2.0, 3.0))
    wall = Object(shape="plane", rotate=(0, 1, 0, -90), translate=(3, 0, 0), material=glow)
    camera = dataclasses.replace(given.camera, eye=(-5.0, 0.1, 1.0), look_at=(0.0, 0.0, 0.0))
    frame = ldtrefl.render(dataclasses.replace(given, camera=camera, objects=(given.objects[0], wall)), "envmap")
    rays = flat_mirror.reflection(flat_mirror.scene(place=(0.0, 0.0, 90.0), camera=camera))
    at_wall = 3.0 * rays.direction / rays.direction[:, :1]
    aside = np.abs(at_wall[:, 1:]).max(axis=1)
    seen = frame.reflection.reshape(-1, 3)[rays.pixels]
    inside, outside = (rays.direction[:, 0] > 0) & (aside < 0.97), (rays.direction[:, 0] < 0) | (aside > 1.03)
    assert inside.sum() > 50 and outside.sum() > 50
    np.testing.assert_allclose(seen[inside], np.tile([1.0, 2.0, 3.0], (inside.sum(), 1)), rtol=1e-6)
    assert (seen[outside] == 0.0).all()


def test_cube_maps_that_need_too_much_memory_are_refused() -> None:
    renderer = ldtrefl.Renderer(flat_mirror.scene(), "envmap", resolution=4096)
    budget.set_memory_limit(1 << 30)
    with pytest.raises(ldtrefl.InputError, match=r"^1 cube maps of 6 x 4096 x 4096 pixels needs? .*resolution"):
        renderer.render()


@pytest.mark.parametrize(("projection", "bytes_of_a_texel"), [("infinite", 12), ("box", 16), ("layered", 32)])
def test_cube_maps_ask_for_what_they_hold(projection: str, bytes_of_a_texel: int) -> None:
    renderer = ldtrefl.Renderer(flat_mirror.scene(), "envmap", resolution=256, projection=projection, samples=1)
    budget.set_memory_limit(bytes_of_a_texel * 6 * 256 * 256 - 1)
    with pytest.raises(ldtrefl.InputError, match=r"^1 cube maps of 6 x 256 x 256 pixels needs? .*resolution"):
        renderer.render()


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_environment_maps_follow_a_move(projection: str) -> None:
    options = {"projection": projection, "resolution": 64}
    renderer = ldtrefl.Renderer(scene(), "envmap", **options)
    renderer.render()
    renderer.move("torus", translate=(-1.2, -1.4, 0.4))
    expected = ldtrefl.render(renderer.scene, "envmap", **options)
    np.testing.assert_array_equal(renderer.render().image, expected.image)


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_environment_maps_turn_with_the_camera(projection: str) -> None:
    given_scene, options = scene(), {"projection": projection, "resolution": 64}
    renderer = ldtrefl.Renderer(given_scene, "envmap", **options)
    renderer.render()
    turned = dataclasses.replace(given_scene.camera, up=(1.0, 0.0, 0.5))
    fresh = ldtrefl.Renderer(given_scene, "envmap", **options)
    assert difference(renderer.render(turned), fresh.render(turned)) == ""


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_what_is_skipped_changes_no_bit(projection: str) -> None:
    options = {"projection": projection, "resolution": 64}
    frames = [ldtrefl.render(scene(), "envmap", skip=skip, **options) for skip in ("all", "none")]
    assert difference(*frames) == ""


def test_a_far_object_is_reflected_in_its_place_and_a_near_one_is_not() -> None:
    """A glowing ball as large from the mirror's centre, a thousand sizes away and next to the mirror."""
    dark = {"environment": Environment(sky=(0, 0, 0), ground=(0, 0, 0)), "lighting": Lighting(ambient=0.0)}
    wrong = []
    for distance in (1000.0, 1.6):
        glow = Material(albedo=0.0, emission=1.0)
        lamp = Object(shape="sphere", scale=0.3 * distance, translate=(distance, 0.0, 0.0), material=glow)
        truth, mapped = (ldtrefl.render(ball_scene(lamp, **dark), method) for method in ("bvh", "envmap"))
        shown = truth.reflection[..., 0] > 0.5
        assert shown.sum() > 5
        wrong.append((shown != (mapped.reflection[..., 0] > 0.5)).sum() / shown.sum())
    assert wrong[0] < 0.15 < 0.5 < wrong[1], wrong


@pytest.mark.parametrize("resolution", [0, 4097, 12.5])
def test_a_resolution_that_is_none_is_refused(resolution: object) -> None:
    with pytest.raises(ldtrefl.InputError, match=r"^method envmap: resolution: "):
        ldtrefl.Renderer(ball_scene(), "envmap", resolution=resolution)
