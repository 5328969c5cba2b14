"""Fermat's points in (u, v): pictures against the ray caster, the pole, what is left out, refusals."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.compare.metrics.structural_similarity import ssim
from ldtrefl.renderer import Frame
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene

MIRROR = Material(albedo=0.0, mirror=0.9)
BALL = Object(name="ball", shape="sphere", material=MIRROR)
EGG = BALL.changed(name="egg", scale=(1.3, 0.9, 0.8), rotate=(0, 0, 1, 30))
EYES = [(0.3, -6.0, 1.6), (2.0, -3.0, 5.0), (-3.0, -5.0, 0.2), (-4.0, 3.0, 2.2)]
"""One sees the ball stand on the floor at its lower pole, one the ball's upper pole."""


def things(fine: bool = True) -> tuple[Object, ...]:
    """A floor that the ball stands on, and what stands about; of small triangles unless ``fine`` is false."""
    return (
        Object(
            shape="torus",
            scale=0.5,
            translate=(-1.7, -1.2, 0.1),
            rotate=(1, 1, 0, 40),
            material=Material(albedo=(0.2, 0.3, 0.8)),
        ),
        Object(shape="sphere", scale=0.4, translate=(1.5, -1.3, -0.5), material=Material(albedo=(0.8, 0.2, 0.1))),
        Object(
            shape="plane",
            params={"segments": 100 if fine else 1},
            scale=6.0,
            translate=(0.0, 0.0, -1.0),
            material=Material(albedo=(0.2, 0.5, 0.3)),
        ),
        Object(
            shape="box",
            params={"segments": 40 if fine else 1},
            scale=(0.4, 0.4, 0.8),
            translate=(0.9, -2.6, -0.2),
            rotate=(0, 0, 1, 30),
            smooth=False,
            material=Material(albedo=(0.9, 0.8, 0.3)),
        ),
    )


def scene(mirror: Object = BALL, eye: tuple[float, float, float] = EYES[0], **changes: object) -> Scene:
    """The mirror among the things."""
    given = {
        "camera": Camera(eye=eye, look_at=(0.0, 0.0, 0.0), width=240, height=176, fov_y=28.0),
        "environment": Environment(sky=(0.5, 0.6, 0.9), ground=(0.3, 0.2, 0.1)),
        "lighting": Lighting(ambient=(0.3, 0.3, 0.3), shadows=True),
        "lights": (ldtrefl.Light(kind="directional", direction=(0.3, 0.5, -1.0), radiance=(1.0, 1.0, 1.0)),),
        "objects": (mirror, *things()),
    }
    return Scene(**{**given, **changes})


def rendered(given: Scene, **options: object) -> tuple[Frame, Frame]:
    """By the method, and by the ray caster."""
    found = ldtrefl.render(given, "fermat-uv", samples=1, **options)
    return found, ldtrefl.render(given, "bvh", samples=1, max_bounces=1)


def similarity(found: Frame, truth: Frame) -> float:
    return ssim(found.image, truth.image, truth.reflector_mask)


@pytest.mark.parametrize("eye", EYES)
def test_a_ball_shows_what_rays_meet(eye: tuple[float, float, float]) -> None:
    found, truth = rendered(scene(eye=eye))
    assert truth.reflection[truth.reflector_mask].std() > 0.1
    assert similarity(found, truth) >= 0.97, similarity(found, truth)
    assert found.stats.counters["steps"] <= 5 * found.stats.counters["vertices"]


@pytest.mark.parametrize("eye", EYES)
def test_an_egg_takes_a_few_more_steps(eye: tuple[float, float, float]) -> None:
    found, truth = rendered(scene(EGG, eye))
    more = ldtrefl.render(scene(EGG, eye), "fermat-uv", samples=1, steps=8)
    assert similarity(found, truth) > 0.94, similarity(found, truth)
    assert similarity(more, truth) >= 0.97, similarity(more, truth)


def share_near_pole(wrong: np.ndarray, truth: Frame) -> tuple[float, float]:
    """Of the ball's pixels within 45 degrees of its poles the share that is wrong, and of the others."""
    is_near = np.abs(truth.layers()["normal"][..., 2]) > np.sqrt(0.5)
    return tuple(float(wrong[truth.reflector_mask & chosen].mean()) for chosen in (is_near, ~is_near))


def test_what_is_wrong_is_near_the_pole() -> None:
    """Where the ball stands on the floor: holes, as the paper says of poles (section 4)."""
    found, truth = rendered(scene(eye=EYES[2]))
    near, far = share_near_pole(np.abs(found.image - truth.image).max(axis=2) > 0.05, truth)
    assert near > 0.01 > 20.0 * far, (near, far)


def test_long_triangles_have_straight_reflections() -> None:
    """The failure that the paper shows (section 4): a floor of two triangles."""
    coarse = scene(objects=(BALL, *things(fine=False)))
    found, truth = rendered(coarse)
    assert similarity(found, truth) < 0.9


@pytest.mark.parametrize("samples", [1, 4])
def test_a_distant_ball_is_where_rays_meet_it(samples: int) -> None:
    """Distances and points of what is hit, from the true surface."""
    given = scene(objects=(BALL, things()[1]))
    found = ldtrefl.render(given, "fermat-uv", samples=samples)
    truth = ldtrefl.render(given, "bvh", samples=samples, max_bounces=1)
    assert found.hits is not None and truth.hits is not None
    both = (found.hits.object >= 0) & (truth.hits.object >= 0)
    assert both.sum() > 0.9 * (truth.hits.object >= 0).sum() > 30
    np.testing.assert_allclose(found.hits.distance[both], truth.hits.distance[both], atol=0.05)


def test_mirrors_that_move_are_sampled_again() -> None:
    renderer = ldtrefl.Renderer(scene(EGG), "fermat-uv", resolution=64)
    renderer.render()
    renderer.move("egg", rotate=(0, 0, 1, 80))
    other = ldtrefl.render(scene(EGG.changed(rotate=(0, 0, 1, 80))), "fermat-uv", resolution=64)
    np.testing.assert_array_equal(renderer.render().image, other.image)


def test_the_pole_points_up_as_the_scenes_camera_does() -> None:
    """A ball on a floor, and both turned so that y is up: the same holes."""
    floor = things()[2]
    upright = scene(objects=(BALL, floor), lights=(), eye=EYES[2])
    camera = dataclasses.replace(upright.camera, eye=(-3.0, 0.2, 5.0), up=(0.0, 1.0, 0.0))
    wall = floor.changed(rotate=(1, 0, 0, -90), translate=(0.0, -1.0, 0.0))
    turned = dataclasses.replace(upright, camera=camera, objects=(BALL.changed(rotate=(1, 0, 0, -90)), wall))
    (found, truth), (other, _) = rendered(upright, steps=3), rendered(turned, steps=3)
    differs = np.abs(found.image - truth.image).max(axis=2) > 0.02
    assert differs.sum() > 20
    assert (np.abs(found.image - other.image).max(axis=2) > 0.02).sum() < 0.1 * differs.sum()


def test_a_mirror_that_is_not_star_shaped_is_refused_by_name() -> None:
    ring = Object(name="ring", shape="torus", material=MIRROR)
    with pytest.raises(ldtrefl.InputError, match=r"^object 'ring' is not star-shaped.*ldt or bvh"):
        ldtrefl.render(scene(ring), "fermat-uv")


def test_memory_that_is_not_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(needed: int, what: str, smaller: str = "") -> None:
        if "textures" in what:
            raise ldtrefl.InputError(f"{what}: {needed} bytes, {smaller}")

    monkeypatch.setattr(budget, "take", refuse)
    with pytest.raises(ldtrefl.InputError, match=r"textures of a mirror, 131584 samples.*resolution"):
        ldtrefl.render(scene(), "fermat-uv")


@pytest.mark.parametrize(("option", "value"), [("steps", 0), ("steps", 2.5), ("resolution", 7), ("resolution", 2048)])
def test_options_that_are_not_allowed(option: str, value: object) -> None:
    with pytest.raises(ldtrefl.InputError, match=f"^method fermat-uv: {option}: "):
        ldtrefl.Renderer(scene(), "fermat-uv", **{option: value})
