"""Fermat's search as a method: finely tessellated scenes as rays see them, the paper's failures, and refusals."""

import dataclasses

import numpy as np
import pytest
from skimage.metrics import structural_similarity

import ldtrefl
from ldtrefl.base.errors import NotForThisScene
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene
from tests.conftest import SCENES

MIRROR = Material(albedo=0.02, mirror=0.9)
BALL = Object(name="ball", shape="sphere", material=MIRROR)


def scene(reflector: Object, floor: int = 120) -> Scene:
    """A mirror on a floor of so many squares a side, among finely tessellated things."""
    things = [
        Object(shape="plane", params={"segments": floor}, scale=4.0, translate=(0.0, 0.0, -1.0), material=Material()),
        Object(shape="torus", scale=0.6, translate=(-1.6, -1.2, 0.0), rotate=(1, 1, 0, 40), material=_colored(0)),
        Object(shape="sphere", scale=0.5, translate=(1.5, -1.5, -0.4), material=_colored(2)),
    ]
    return Scene(
        camera=Camera(eye=(0.3, -5.0, 1.5), look_at=(0.0, 0.0, 0.0), width=240, height=160, fov_y=32.0),
        environment=Environment(sky=(0.5, 0.6, 0.9), ground=(0.3, 0.25, 0.2)),
        lighting=Lighting(ambient=(0.3, 0.3, 0.3), shadows=True),
        lights=(Light(kind="directional", direction=(0.3, 0.5, -1.0), radiance=(0.8, 0.8, 0.8)),),
        objects=(reflector, *things),
    )


def _colored(channel: int) -> Material:
    color = [0.2, 0.2, 0.2]
    color[channel] = 0.8
    return Material(albedo=tuple(color))


def similarity(given: Scene, **options: object) -> tuple[float, ldtrefl.Frame]:
    """SSIM with what rays see after one bounce, over the mirror."""
    found = ldtrefl.render(given, "fermat", **options)
    truth = ldtrefl.render(given, "bvh", max_bounces=1)
    pictures = [np.clip(frame.image, 0.0, 1.0) ** (1 / 2.2) for frame in (found, truth)]
    _, each = structural_similarity(*pictures, channel_axis=2, data_range=1.0, full=True)
    return float(each.mean(axis=2)[found.reflector_mask].mean()), found


EGG = Object(name="egg", shape="sphere", scale=(1.4, 0.8, 0.9), rotate=(0, 1, 1, 30), material=MIRROR)
DOME = Object(
    name="dome",
    shape="bowl",
    params={"closed": False, "depth": 1.0, "segments": [256, 96]},
    rotate=(1, 0, 0, 180),
    material=MIRROR,
)


@pytest.mark.parametrize("reflector", [BALL, EGG, DOME], ids=lambda reflector: reflector.name)
def test_finely_tessellated_scenes_are_as_rays_see_them(reflector: Object) -> None:
    """A ball that stands on the floor, an egg, and half a sphere, which is open below."""
    ssim, frame = similarity(scene(reflector))
    counters = frame.stats.counters
    print(f"fermat, {reflector.name}: SSIM {ssim:.4f}, {counters['iterations'] / counters['vertices']:.2f} iterations")
    assert ssim >= 0.97
    assert counters["vertices_found"] > 0.9 * counters["vertices"]
    assert 2 * counters["vertices"] < counters["iterations"] < 10 * counters["vertices"]


def test_a_flat_mirror_is_exact() -> None:
    flat = Object(name="flat", shape="plane", scale=1.2, rotate=(1, 0, 0, 80), translate=(0, 0.5, 0.3), material=MIRROR)
    ssim, frame = similarity(scene(flat))
    assert ssim >= 0.99, ssim
    planar = ldtrefl.render(scene(flat), "planar").image
    off = np.abs(frame.image - planar).max(axis=2)[frame.reflector_mask]
    assert (off > 0.02).mean() < 0.01


def test_a_bowl_shows_far_things_upside_down_and_nothing_that_it_walls_off() -> None:
    """The paper's Fig. 11: what is far is seen once. The table that the bowl stands on is not seen in it."""
    given = ldtrefl.load_scene(SCENES / "paper" / "bowl.toml")
    given = given.with_camera(dataclasses.replace(given.camera, width=192, height=128))
    frames = [ldtrefl.render(given, "fermat", samples=1), ldtrefl.render(given, "bvh", samples=1, max_bounces=1)]
    assert frames[0].hits is not None and frames[1].hits is not None
    found, truth = (frame.hits.object[frame.reflector_mask] for frame in frames)
    own = given.number_of("bowl")  # what is reflected twice
    is_once = (truth >= 0) & (truth != own)
    assert (found[is_once] == truth[is_once]).mean() > 0.65
    assert (found[truth == own] < 0).mean() > 0.95
    names = np.array([entry.called for entry in given.objects])
    assert {"ceiling", "lamp"} <= set(names[np.unique(found[found >= 0])])
    assert np.isin(names[found[found >= 0]], ["floor", "table"]).mean() < 0.01


def test_long_triangles_have_straight_reflections() -> None:
    """The paper's section 4.5: a floor of four squares is bent where it should be, and straight where it is drawn."""
    fine, _ = similarity(scene(BALL))
    coarse, _ = similarity(scene(BALL, floor=2))
    assert coarse < fine - 0.05, (coarse, fine)


def test_triangles_taken_to_pieces_are_bent() -> None:
    fine, _ = similarity(scene(BALL))
    coarse, _ = similarity(scene(BALL, floor=2))
    pieces, frame = similarity(scene(BALL, floor=2), levels=7)
    print(f"fermat: SSIM {coarse:.4f} of long triangles, {pieces:.4f} in pieces, {fine:.4f} if finely tessellated")
    assert pieces > coarse + 0.8 * (fine - coarse)
    assert frame.stats.counters["pieces"] > 100


def test_options_end_searches_sooner() -> None:
    counts = {}
    for name, options in (("usual", {}), ("large area", {"area": 10.0}), ("few", {"iterations": 2})):
        counters = ldtrefl.render(scene(BALL), "fermat", samples=1, **options).stats.counters
        counts[name] = counters["iterations"] / counters["vertices"]
    assert counts["large area"] < counts["usual"] - 0.5 and counts["few"] <= 2.0


def test_reflectors_that_move_or_are_deformed_are_mapped_again() -> None:
    renderer = ldtrefl.Renderer(scene(BALL), "fermat", samples=1)
    renderer.render()
    renderer.move("ball", translate=(0.3, 0.0, 0.2), scale=(1.0, 1.2, 0.9))
    moved = dataclasses.replace(BALL, translate=(0.3, 0.0, 0.2), scale=(1.0, 1.2, 0.9))
    expected = ldtrefl.Renderer(scene(BALL), "fermat", samples=1)
    expected.move("ball", translate=moved.translate, scale=moved.scale)
    np.testing.assert_array_equal(renderer.render().image, expected.render().image)
    vertices = BALL.geometry.vertices * [1.0, 1.0, 1.3]
    for each in (renderer, expected):
        each.update_vertices("ball", vertices)
    fresh = ldtrefl.Renderer(scene(BALL), "fermat", samples=1)
    fresh.move("ball", translate=moved.translate, scale=moved.scale)
    fresh.update_vertices("ball", vertices)
    np.testing.assert_array_equal(renderer.render().image, fresh.render().image)


def test_what_is_not_star_shaped_is_refused_by_name() -> None:
    ring = Object(name="ring", shape="torus", material=MIRROR)
    with pytest.raises(NotForThisScene, match=r"^object 'ring' is not star-shaped.*ldt or bvh take any mirror"):
        ldtrefl.render(scene(ring), "fermat")


def test_options_are_checked() -> None:
    for option, value in (("resolution", 4), ("iterations", 0), ("area", -1.0)):
        with pytest.raises(ldtrefl.InputError, match=f"fermat.*{option}"):
            ldtrefl.render(scene(BALL), "fermat", **{option: value})
