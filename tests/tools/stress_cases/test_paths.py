"""The float64 paths that pictures are held to, against closed forms."""

import dataclasses

import numpy as np
import pytest
from stress_cases.paths import KEPT_RISE, LEAST_RISE, mirrored, paths_of

import ldtrefl
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Reflection, Scene
from tests.frame import flat_mirror


@pytest.mark.parametrize("bounces", [1, 2, 4])
def test_paths_between_two_mirrors_are_the_known_ones(bounces: int) -> None:
    """The ground glows as it is lit in the closed form: these surfaces give off their emission alone."""
    given = flat_mirror.scene(place=(0.1, 0.2, 0.8), box_mirror=0.5)
    emission = tuple(flat_mirror.GROUND_DIRECT.tolist())
    ground = Material(albedo=0.0, emission=emission, mirror=tuple(flat_mirror.GROUND_MIRROR.tolist()))
    objects = (dataclasses.replace(given.objects[0], material=ground), given.objects[1])
    paths = paths_of(dataclasses.replace(given, objects=objects), bounces)
    expected = flat_mirror.reflection(given, bounces)
    seen, first, *later = paths.ends
    pixels = expected.pixels
    assert (seen.object.ravel()[pixels] == flat_mirror.GROUND).all() and len(later) == bounces - 1
    np.testing.assert_allclose(first.distance.ravel()[pixels], expected.distance, rtol=1e-12)
    np.testing.assert_array_equal(first.object.ravel()[pixels], expected.object)
    for k, ends in enumerate(later):
        np.testing.assert_array_equal(ends.followed.ravel()[pixels], expected.later_followed[:, k])
        np.testing.assert_array_equal(ends.object.ravel()[pixels], expected.later_object[:, k])
        np.testing.assert_allclose(ends.distance.ravel()[pixels], expected.later_distance[:, k], rtol=1e-12)
    radiance = flat_mirror.GROUND_DIRECT + flat_mirror.GROUND_MIRROR * expected.radiance
    np.testing.assert_allclose(paths.image.reshape(-1, 3)[pixels], radiance, rtol=1e-12)


@pytest.mark.parametrize("shape", ["sphere", "room"])
def test_inside_a_mirror_paths_bring_the_sum_until_little_is_left(shape: str) -> None:
    """Glow 0.3, reflectance 0.5: a ray ends where less than 0.1 of what it meets would arrive at the first."""
    scene = Scene(
        camera=Camera(eye=(0.3, 0.2, -0.1), look_at=(0.0, 1.0, 0.0), width=9, height=7, fov_y=90),
        environment=Environment(sky=(2.0,) * 3, ground=(2.0,) * 3),
        objects=(
            Object(
                shape=shape,
                params={"segments": [12, 6] if shape == "sphere" else 2},
                material=Material(albedo=0.0, emission=0.3, mirror=0.5),
            ),
        ),
        reflection=Reflection(least_weight=0.1),
    )
    expected = 0.3 * (1 + 0.5 + 0.25 + 0.125 + 0.0625) + 2.0 * 0.5**5
    for bounces in (4, 9):
        paths = paths_of(scene, bounces)
        np.testing.assert_allclose(paths.image, expected, rtol=1e-12)
        assert len(paths.ends) == 5 and all(ends.followed.all() for ends in paths.ends)


def test_directions_rise_above_their_facets_and_are_bent_no_further() -> None:
    rng = np.random.default_rng(5)
    facets = np.broadcast_to([0.0, 0.0, 1.0], (4000, 3))
    normals, directions = (rng.normal(size=(4000, 3)) for _ in range(2))
    normals[:, 2], directions[:, 2] = np.abs(normals[:, 2]), -np.abs(directions[:, 2])
    normals, directions = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in (normals, directions))
    made = mirrored(directions, normals, facets)
    plain = directions - 2 * (directions * normals).sum(axis=1, keepdims=True) * normals
    least = np.minimum(KEPT_RISE * -directions[:, 2], LEAST_RISE)
    rises = plain[:, 2] >= least
    assert 0.2 < rises.mean() < 0.9
    np.testing.assert_array_equal(made[rises], plain[rises])
    np.testing.assert_allclose(made[~rises, 2], least[~rises], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(made, axis=1), 1.0, rtol=1e-12)


def test_the_renderer_follows_the_same_paths() -> None:
    """Coarse smooth mirrors that see themselves and each other, by the ray caster: each hit, and the radiance."""
    glow, mirror = Material(albedo=0.0, emission=0.6), Material(albedo=0.0, mirror=0.8)
    scene = Scene(
        camera=Camera(eye=(1.5, -4, 2), look_at=(0.5, 0, 0), width=64, height=48, fov_y=45),
        lighting=Lighting(ambient=0.0),
        objects=(
            Object(shape="sphere", params={"segments": [16, 8]}, material=mirror),
            Object(shape="torus", params={"segments": [24, 10]}, material=mirror, translate=(2.0, -0.5, 0)),
            Object(mesh=shapes.make("box"), scale=0.5, translate=(-1.8, -0.8, -0.3), smooth=False, material=glow),
        ),
    )
    paths, frame = paths_of(scene, 4), ldtrefl.render(scene, "bvh", max_bounces=4)
    assert frame.hits is not None and len(frame.hits.later) >= 2
    ours, true = (frame.hits, *frame.hits.later), paths.ends[1:]
    for hits, ends in zip(ours, true, strict=True):
        for name in ("followed", "object", "triangle"):
            differ = getattr(hits, name) != getattr(ends, name)
            assert differ.sum() <= 1, name
    assert (np.abs(frame.image - paths.image).max(axis=2) > 1e-3).sum() <= 1
