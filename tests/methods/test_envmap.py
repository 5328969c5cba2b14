"""Environment mapping: right for what is far away, and only for that."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene

CAMERA = Camera(eye=(0.5, -4.0, 1.0), look_at=(0, 0, 0), width=60, height=40, fov_y=40)
BALL = Object(shape="sphere", material=Material(albedo=0.0, mirror=1.0))


def scene(*others: Object, **changes: object) -> Scene:
    """The mirror ball and other objects."""
    return Scene(camera=CAMERA, objects=(BALL, *others), **changes)


def test_the_sky_is_reflected_as_by_ray_casting() -> None:
    sky = Environment(sky=(1.0, 0.5, 0.0), ground=(0.0, 0.5, 1.0))
    truth, mapped = (ldtrefl.render(scene(environment=sky), method).image for method in ("bvh", "envmap"))
    np.testing.assert_allclose(mapped, truth, atol=2e-3)


def test_a_far_object_is_reflected_in_its_place_and_a_near_one_is_not() -> None:
    """A glowing ball as large from the mirror's centre, a thousand sizes away and next to the mirror."""
    dark = {"environment": Environment(sky=(0, 0, 0), ground=(0, 0, 0)), "lighting": Lighting(ambient=0.0)}
    wrong = []
    for distance in (1000.0, 1.6):
        glow = Material(albedo=0.0, emission=1.0)
        lamp = Object(shape="sphere", scale=0.3 * distance, translate=(distance, 0.0, 0.0), material=glow)
        truth, mapped = (ldtrefl.render(scene(lamp, **dark), method) for method in ("bvh", "envmap"))
        shown = truth.reflection[..., 0] > 0.5
        assert shown.sum() > 5
        wrong.append((shown != (mapped.reflection[..., 0] > 0.5)).sum() / shown.sum())
    assert wrong[0] < 0.15 < 0.5 < wrong[1], wrong


def test_a_frame_has_no_hits() -> None:
    frame = ldtrefl.render(scene(), "envmap", resolution=16)
    assert frame.hits is None and "cubemap" in frame.stats.seconds


@pytest.mark.parametrize("resolution", [0, 4097, 12.5])
def test_a_resolution_that_is_none_is_refused(resolution: object) -> None:
    with pytest.raises(InputError, match=r"^method envmap: resolution: "):
        ldtrefl.Renderer(scene(), "envmap", resolution=resolution)
