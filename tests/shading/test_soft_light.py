"""Spheres, rectangles, spot lights and ambient occlusion against closed forms; penumbras too."""

import dataclasses
from collections.abc import Sequence

import numpy as np
import pytest

import ldtrefl
from ldtrefl import renderer as renderer_module
from ldtrefl.compare.metrics.structural_similarity import ssim
from ldtrefl.device import launch
from ldtrefl.frame import visibility
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene
from tests.frame_scenes import scene as mirror_ball
from tests.shading.facets import NO_LIGHT, SIZES, TURNS, Facet, turned

WHITE = Material(albedo=1.0)
FLOOR = Object(name="floor", shape="plane", scale=20.0, material=WHITE)
CAMERA = Camera(eye=(4, 0, 0.8), look_at=(0, 0, 0), width=480, height=60, fov_y=12)


def floor_under(
    lights: Sequence[Light], things: Sequence[Object] = (), camera: Camera = CAMERA, **lighting: object
) -> tuple[np.ndarray, np.ndarray]:
    """Red of the pixels that see the floor, and where they see it, (n, 3)."""
    lit = Lighting(**{"ambient": 0.0, "shadows": True, **lighting})
    given = Scene(camera=camera, lights=tuple(lights), objects=(FLOOR, *things), lighting=lit)
    renderer = ldtrefl.Renderer(given, "bvh")
    image = renderer.render().image
    assert renderer.gbuffer is not None
    on_floor = renderer.gbuffer.objects.ravel() == 0
    position = renderer.gbuffer.surfaces[0].numpy()[on_floor]
    matrix = np.linalg.inv(renderer.gbuffer.scene.device_from_world)
    return image.reshape(-1, 3)[on_floor, 0], position @ matrix[:3, :3].T + matrix[:3, 3]


@pytest.mark.parametrize(("radius", "height", "edge"), [(0.2, 3.0, 1.0), (0.5, 4.0, 0.5), (0.05, 2.0, 0.3)])
def test_a_sphere_behind_an_edge_has_a_penumbra_of_the_right_width(radius: float, height: float, edge: float) -> None:
    """The light stands straight above the edge of a plate that covers x < 0: it is cut in half at x = 0. Of the disc
    that is seen, 5% and 95% are seen where the edge's plane passes its middle by 0.805 of its radius."""
    light = Light(kind="sphere", position=(0, 0, height), radius=radius, radiance=10.0)
    plate = Object(shape="box", scale=(2.0, 20.0, 1e-4), translate=(-2.0, 0, edge), smooth=False)
    reach = 1.3 * radius * edge / np.sqrt((height - edge) ** 2 - radius**2)
    half_height = 1.1 * reach / 3.0 * 60 / 480
    lens = {"height": 60, "width": 480, "fov_y": np.degrees(2.0 * np.arctan(half_height))}
    camera = Camera(eye=(0, -3, 0.5 * edge), look_at=(0, 0, 0), **lens)
    shaded, at = floor_under([light], [plate], camera)
    open_, _ = floor_under([light], [plate], camera, shadows=False)
    share, x = shaded / open_, at[:, 0]
    bins = np.linspace(-reach, reach, 53)
    count, _ = np.histogram(x, bins)
    means = np.histogram(x, bins, weights=share)[0] / count
    assert count.min() > 20
    middles = 0.5 * (bins[1:] + bins[:-1])
    assert (np.diff(means) > -0.02).all() and means[0] == 0.0 and means[-1] > 0.999
    low, high = (np.interp(level, means, middles) for level in (0.05, 0.95))
    t = 0.80537
    assert 0.5 + (t * np.sqrt(1 - t**2) + np.arcsin(t)) / np.pi == pytest.approx(0.95, abs=1e-4)
    # The plane through x on the floor and the edge passes the middle by |x| (height - edge) / sqrt(x^2 + edge^2).
    expected = 2.0 * t * radius * edge / np.sqrt((height - edge) ** 2 - (t * radius) ** 2)
    assert high - low == pytest.approx(expected, rel=0.05)
    assert np.interp(0.5, means, middles) == pytest.approx(0.0, abs=0.03 * expected)


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_a_sphere_above_the_horizon(turn: tuple, size: object) -> None:
    """``radiance * (radius / distance)^2 * cosine``, at any scale and turn, shadows or not."""
    facet, matrix = Facet(turn, size, 40.0), turned(turn)
    position = 0.7 * facet.distance * (0.8 * matrix[:, 2] + 0.6 * matrix[:, 1])
    light = Light(
        kind="sphere", position=tuple(position), radius=0.2 * facet.distance, radiance=(5, 1, 0), visible=False
    )
    expected = np.array([5.0, 1.0, 0.0]) * (0.2 / 0.7) ** 2 * 0.8
    for shadows in (False, True):
        lighting = dataclasses.replace(NO_LIGHT, shadows=shadows)
        np.testing.assert_allclose(facet.seen(WHITE, lights=(light,), lighting=lighting), expected, rtol=1e-4)


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_a_rectangle_straight_above(turn: tuple, size: object) -> None:
    """The corner of a rectangle above a point: Siegel and Howell, configuration factor of a differential element to a
    finite parallel rectangle."""
    facet, matrix = Facet(turn, size, 40.0), turned(turn)
    a, b = 0.6, 0.9  # half sides over the distance: four rectangles meet above the point
    position = 0.7 * facet.distance * matrix[:, 2]
    sides = {"width": 2 * a * 0.7 * facet.distance, "height": 2 * b * 0.7 * facet.distance}
    place = {"position": tuple(position), "direction": tuple(-matrix[:, 2]), "up": tuple(matrix[:, 1])}
    light = Light(kind="rectangle", radiance=2.0, visible=False, **place, **sides)
    quarter = a / np.hypot(1, a) * np.arctan(b / np.hypot(1, a)) + b / np.hypot(1, b) * np.arctan(a / np.hypot(1, b))
    expected = 2.0 * 4.0 * quarter / (2.0 * np.pi)
    for shadows in (False, True):
        lighting = dataclasses.replace(NO_LIGHT, shadows=shadows)
        np.testing.assert_allclose(facet.seen(WHITE, lights=(light,), lighting=lighting), expected, rtol=1e-4)


def test_a_spot_falls_off_as_gltf_says() -> None:
    """KHR_lights_punctual: the square of a ramp of cosines from the outer to the inner angle."""
    place, inner, outer = np.array([0.3, 0.2, 2.0]), 12.0, 31.0
    axis = np.array([0.1, -0.2, -1.0])
    light = Light(
        kind="spot", position=tuple(place), direction=tuple(axis), intensity=7, inner_angle=inner, outer_angle=outer
    )
    camera = Camera(eye=(0.5, -1, 6), look_at=(0.5, -0.4, 0), width=120, height=100, fov_y=40)
    radiance, at = floor_under([light], camera=camera)
    way = at - place
    square = np.vecdot(way, way)
    cosine = way @ axis / np.sqrt(square * (axis @ axis))
    begin, end = np.cos(np.radians([inner, outer]))
    fall = np.clip((cosine - end) / (begin - end), 0.0, 1.0) ** 2
    expected = 7.0 / square * (-way[:, 2] / np.sqrt(square)) * fall
    assert 1000 < np.count_nonzero(fall == 0.0) and 300 < np.count_nonzero((fall > 0) & (fall < 1))
    np.testing.assert_allclose(radiance, expected, rtol=1e-3, atol=1e-5)


def test_a_spots_radius_softens_its_shadow_and_changes_nothing_else() -> None:
    hard = Light(kind="spot", position=(0, 0, 3), direction=(0, 0, -1), intensity=9.0, outer_angle=60)
    soft = dataclasses.replace(hard, radius=0.2)
    plate = Object(shape="box", scale=(2.0, 20.0, 1e-4), translate=(-2.0, 0, 1.0), smooth=False)
    camera = Camera(eye=(0, -3, 0.5), look_at=(0, 0, 0), height=60, width=480, fov_y=1.0)
    hardly, at = floor_under([hard], [plate], camera)
    softly, _ = floor_under([soft], [plate], camera)
    reach = 0.2 / np.sqrt(2.0**2 - 0.2**2)  # as far from the edge as a sphere's penumbra goes
    x = at[:, 0]
    assert (hardly[x > 0.001] > 0.0).all() and not hardly[x < -0.001].any()
    np.testing.assert_array_equal(softly[x > 1.001 * reach], hardly[x > 1.001 * reach])
    assert not softly[x < -1.001 * reach].any() and np.count_nonzero(np.abs(x) > 1.001 * reach) > 1000
    assert 0.4 < softly[np.abs(x) < reach].mean() / hardly[(x > 0.0) & (x < reach)].mean() < 0.6


@pytest.mark.parametrize("edge", [0.02, 0.6])
def test_a_studio_behind_an_edge(edge: float) -> None:
    """A plate covers x < 0 at some height: a point of the floor at x sees what of the soft boxes goes by its edge."""
    plate = Object(shape="box", scale=(20.0, 60.0, 1e-4), translate=(-20.0, 0, edge), smooth=False)
    camera = Camera(eye=(0, -0.3, 0.5 * edge), look_at=(0, 0, 0), height=60, width=480, fov_y=edge * 20.0)
    studio = Environment(preset="studio", rotation=70.0, strength=0.5)
    assert studio.surroundings is not None
    lighting = Lighting(ambient=0.0, shadows=True)
    given = Scene(camera=camera, environment=studio, objects=(FLOOR, plate), lighting=lighting)
    renderer = ldtrefl.Renderer(given, "bvh", samples=64)
    image = renderer.render().image
    assert renderer.gbuffer is not None
    at = renderer.gbuffer.surfaces[0].numpy().reshape(60, 480, 3)[30]
    matrix = np.linalg.inv(renderer.gbuffer.scene.device_from_world)
    x = at @ matrix[0, :3] + matrix[0, 3]
    turn = np.array(
        [[np.cos(np.radians(70)), -np.sin(np.radians(70))], [np.sin(np.radians(70)), np.cos(np.radians(70))]]
    )
    expected = np.zeros_like(x)
    for light in studio.surroundings.rectangles:
        u = (np.arange(200) + 0.5) / 100.0 - 1.0
        ways = np.array(light.middle) + (u[:, None, None] * light.right + u[:, None] * np.array(light.up))
        ways = ways.reshape(-1, 3)
        area = 4.0 * np.linalg.norm(light.right) * np.linalg.norm(light.up) / len(ways)
        square = np.vecdot(ways, ways)
        lit = area * ways @ light.middle * ways[:, 2] / square**2 / np.pi
        slope = (turn @ ways[:, :2].T)[0] / ways[:, 2]
        order = np.argsort(slope)
        seen = np.concatenate([np.cumsum(lit[order][::-1])[::-1], [0.0]])
        expected += 0.5 * light.radiance[0] * seen[np.searchsorted(slope[order], -x / edge)]
    assert expected.max() > 2.0 * expected.min()
    np.testing.assert_allclose(image[30, :, 0], expected, atol=0.02 * expected.max())


def test_studios_boxes_are_mirrored_with_the_picture_alone() -> None:
    """A varnish that faces the key shows the picture's radiance, as one under the same picture without lights does."""
    facet = Facet((0, 0, 1, 0), 1.0, 0.0)
    plastic = Material(albedo=0.0, roughness=0.4, ior=1.5)
    studio = Environment(preset="studio")
    assert studio.surroundings is not None
    key = studio.surroundings.rectangles[0]
    lit = facet.seen(plastic, environment=studio, lighting=NO_LIGHT)
    plain = Environment(preset="studio")
    vars(plain)["surroundings"] = dataclasses.replace(studio.surroundings, rectangles=())
    np.testing.assert_array_equal(lit, facet.seen(plastic, environment=plain, lighting=NO_LIGHT))
    white = facet.seen(WHITE, environment=studio, lighting=NO_LIGHT)
    assert white.min() > 0.05 * key.radiance[0]


def test_occlusion_beside_a_wall() -> None:
    """A wall of height h hides (1 - x / sqrt(x^2 + h^2)) / 2 of the ambient light from a floor at a distance of x."""
    height = 0.5
    wall = Object(shape="box", scale=(0.1, 30.0, height), translate=(-0.1, 0, 0), smooth=False)
    camera = dataclasses.replace(CAMERA, eye=(3, 0, 2.0), look_at=(0.6, 0, 0), height=240, width=60, fov_y=25)
    radiance, at = floor_under([], [wall], camera, ambient=0.5, shadows=False, occlusion={"distance": 50.0})
    x = at[:, 0]
    bins = np.linspace(0.02, 1.2, 13)
    count, _ = np.histogram(x, bins)
    means = np.histogram(x, bins, weights=radiance / 0.5)[0] / count
    middles = np.histogram(x, bins, weights=x)[0] / count
    expected = 0.5 + 0.5 * middles / np.hypot(middles, height)
    np.testing.assert_allclose(means, expected, atol=0.01)
    near, at = floor_under([], [wall], camera, ambient=0.5, shadows=False, occlusion={"distance": 0.3})
    np.testing.assert_array_equal(near[at[:, 0] > 0.31], np.float32(0.5))
    assert near[at[:, 0] < 0.1].mean() < 0.4
    with_looks = dataclasses.replace(FLOOR, material=Material(albedo=1.0, roughness=1.0, ior=1.0))
    given = Scene(
        camera=camera,
        environment=Environment(sky=0.0, ground=0.0),
        objects=(with_looks, wall),
        lighting=Lighting(ambient=0.5, occlusion={"distance": 0.3}),
    )
    plain = dataclasses.replace(given, objects=(FLOOR, wall))
    looks, plainly = (ldtrefl.render(one, "bvh").image for one in (given, plain))
    np.testing.assert_allclose(looks, plainly, atol=1e-3)


@pytest.mark.parametrize("shape", ["sphere", "rectangle"])
def test_a_smooth_varnish_shows_a_light_in_its_own_radiance(shape: str) -> None:
    """Too weak to send rays, it mirrors 4% at normal incidence; beside the light's shape it mirrors none of it."""
    facet = Facet((0, 0, 1, 0), 1.0, 0.0)
    away = 3.0 * facet.distance
    place: dict[str, object] = {"position": (0.0, 0.0, away), "radiance": 2.0}
    if shape == "sphere":
        light = Light(kind="sphere", radius=0.3 * away, **place)
    else:
        light = Light(kind="rectangle", direction=(0, 0, -1), width=0.5 * away, height=0.3 * away, **place)
    plastic = Material(albedo=0.0, roughness=0.0, ior=1.5)
    np.testing.assert_allclose(facet.seen(plastic, lights=(light,)), 0.04 * 2.0, rtol=0.02)
    aside = dataclasses.replace(light, position=(0.4 * away, 0.0, away))
    assert (facet.seen(plastic, lights=(aside,)) < 0.001).all()


def test_a_small_light_has_the_highlight_of_a_point() -> None:
    facet = Facet((0, 0, 1, 0), 1.0, 30.0)
    place = tuple(facet.distance * np.array([-0.4, 0.1, 0.9]))
    radius = 1e-4 * facet.distance
    ball = Light(kind="sphere", position=place, radius=radius, radiance=2e8)
    side = np.sqrt(np.pi) * radius
    sheet = Light(
        kind="rectangle", position=place, direction=tuple(-np.array(place)), width=side, height=side, radiance=2e8
    )
    point = Light(kind="point", position=place, intensity=2e8 * radius**2)
    for roughness in (0.3, 0.7):
        metal = Material(albedo=0.9, metallic=1.0, roughness=roughness)
        expected = facet.seen(metal, lights=(point,))
        assert expected.min() > 0.1
        for light in (ball, sheet):
            np.testing.assert_allclose(facet.seen(metal, lights=(light,)), expected, rtol=0.01)


def test_what_sends_rays_sees_a_light_by_them_alone() -> None:
    """And by its highlight if its shape is not to be seen."""
    facet = Facet((0, 0, 1, 0), 1.0, 0.0)
    light = Light(kind="sphere", position=(0, 0, 3.0 * facet.distance), radius=0.5 * facet.distance, radiance=2.0)
    metal = Material(albedo=0.9, metallic=1.0, roughness=0.1)
    np.testing.assert_allclose(facet.seen(metal, lights=(light,)), 1.8, rtol=0.02)
    hidden = dataclasses.replace(light, visible=False)
    np.testing.assert_allclose(facet.seen(metal, lights=(hidden,)), 1.8, rtol=0.05)


LIGHTS = {
    "sphere": Light(kind="sphere", position=(-1.5, -2.0, 3.0), radius=0.4, radiance=25.0),
    "rectangle": Light(
        kind="rectangle", position=(2.5, -1.5, 2.5), direction=(-1, 0.6, -0.8), width=1, height=1.5, radiance=(8, 9, 9)
    ),
    "spot": Light(kind="spot", position=(0, -2, 4), direction=(0, 0.1, -1), intensity=20, outer_angle=25, radius=0.3),
}


def lit_scene(name: str) -> Scene:
    """A mirror ball among things in one light, or in all of them and dimmed ambient light."""
    lights = tuple(LIGHTS.values()) if name == "all" else (LIGHTS[name],)
    occlusion = {"distance": 0.5} if name == "all" else None
    return mirror_ball(lights=lights, lighting=Lighting(shadows=True, occlusion=occlusion))


@pytest.mark.parametrize("name", [*LIGHTS, "all"])
def test_layered_depth_textures_agree_with_the_ray_caster(name: str) -> None:
    truth, image = (ldtrefl.render(lit_scene(name), method).image for method in ("bvh", "ldt"))
    assert ssim(image, truth, np.ones(truth.shape[:2], bool)) >= 0.999


def test_bits_do_not_depend_on_threads_nor_on_bands(monkeypatch: pytest.MonkeyPatch) -> None:
    given, before = lit_scene("all"), launch.thread_count()
    truth = ldtrefl.render(given, "ldt").image
    try:
        for threads in (1, 3):
            ldtrefl.set_threads(threads)
            np.testing.assert_array_equal(ldtrefl.render(given, "ldt").image, truth)
    finally:
        ldtrefl.set_threads(before)
    monkeypatch.setattr(renderer_module, "LARGEST_WHOLE", 5000)
    monkeypatch.setattr(visibility, "BAND_PIXELS", 2000)
    np.testing.assert_array_equal(ldtrefl.render(given, "ldt").image, truth)


def test_a_moved_object_moves_its_occlusion() -> None:
    """Nothing of the last frame is used again where it could lie in light that has changed."""
    given = dataclasses.replace(lit_scene("all"), lights=(), lighting=Lighting(occlusion={"distance": 0.5}))
    renderer = ldtrefl.Renderer(given, "ldt")
    first = renderer.render().image.copy()
    renderer.move("box", translate=(0.0, -1.3, -0.8))
    second = renderer.render().image
    np.testing.assert_array_equal(second, ldtrefl.render(renderer.scene, "ldt").image)
    assert (first != second).any()
