"""Reflection regions: the cone's pure functions against sampling, and `safe` against brute force."""

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl import launch
from ldtrefl.cull import MirrorTriangle, shows_flat, shows_safe
from ldtrefl.scene import Camera, Material, Object, Scene


@launch.kernel
def answer_cases(
    first: int,
    eye: wp.array(dtype=wp.vec3),
    corners: wp.array2d(dtype=wp.vec3),
    normals: wp.array2d(dtype=wp.vec3),
    centre: wp.array(dtype=wp.vec3),
    radius: wp.array(dtype=float),
    flat_out: wp.array(dtype=int),
    safe_out: wp.array(dtype=int),
):
    i = first + wp.tid()
    mirror = MirrorTriangle()
    mirror.a = corners[i, 0]
    mirror.b = corners[i, 1]
    mirror.c = corners[i, 2]
    mirror.normal_a = normals[i, 0]
    mirror.normal_b = normals[i, 1]
    mirror.normal_c = normals[i, 2]
    flat_out[i] = int(shows_flat(eye[i], corners[i, 0], corners[i, 1], corners[i, 2], centre[i], radius[i]))
    safe_out[i] = int(shows_safe(eye[i], mirror, centre[i], radius[i]))


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def random_cases(n: int, bend: float) -> dict[str, np.ndarray]:
    """Triangles of many sizes and places, their corner normals bent by up to ``bend``, and spheres."""
    rng = np.random.default_rng(11)
    size = 10.0 ** rng.uniform(-3, 0.5, (n, 1, 1))
    corners = rng.normal(size=(n, 1, 3)) + size * rng.normal(size=(n, 3, 3))
    facet = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    normals = unit(facet[:, None] + bend * rng.uniform(0, 1, (n, 1, 1)) * rng.normal(size=(n, 3, 3)))
    return {
        "eye": 4 * rng.normal(size=(n, 3)),
        "corners": corners,
        "normals": normals,
        "centre": 3 * rng.normal(size=(n, 3)),
        "radius": 10.0 ** rng.uniform(-2, 0.3, n),
    }


def answers(case: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    device, n = launch.resolve_device(None), len(case["radius"])
    vectors = [
        wp.array(case[k].astype(np.float32), dtype=wp.vec3, device=device) for k in ("eye", "corners", "normals")
    ]
    centre = wp.array(case["centre"].astype(np.float32), dtype=wp.vec3, device=device)
    radius = wp.array(case["radius"].astype(np.float32), dtype=float, device=device)
    flat, safe = (wp.zeros(n, dtype=int, device=device) for _ in range(2))
    launch.launch(answer_cases, n, [*vectors, centre, radius, flat, safe], device)
    return flat.numpy() != 0, safe.numpy() != 0


def reflects_the_sphere(case: dict[str, np.ndarray], samples: int, flat: bool) -> np.ndarray:
    """Whether any of many rays reflected at random points of each triangle meets its sphere."""
    rng = np.random.default_rng(12)
    found = np.zeros(len(case["radius"]), bool)
    facet = np.cross(case["corners"][:, 1] - case["corners"][:, 0], case["corners"][:, 2] - case["corners"][:, 0])
    for _ in range(samples):
        weights = rng.dirichlet((0.7, 0.7, 0.7), len(found))[:, :, None]
        point = (weights * case["corners"]).sum(axis=1)
        normal = unit(facet if flat else (weights * case["normals"]).sum(axis=1))
        view = unit(point - case["eye"])
        ray = view - 2 * (view * normal).sum(axis=1, keepdims=True) * normal
        offset = case["centre"] - point
        along = (offset * ray).sum(axis=1)
        aside = np.linalg.norm(offset - along[:, None] * ray, axis=1)
        inside = np.linalg.norm(offset, axis=1) <= case["radius"]
        found |= inside | ((aside <= case["radius"]) & (along > 0))
    return found


@pytest.mark.parametrize("bend", [0.0, 0.05, 0.5, 3.0])
def test_safe_drops_nothing_that_reflects(bend: float) -> None:
    case = random_cases(30_000, bend)
    _, safe = answers(case)
    lost = reflects_the_sphere(case, 60, flat=False) & ~safe
    assert not lost.any(), f"{lost.sum()} of {len(lost)} lost"
    if bend <= 0.05:
        assert safe.mean() < 0.5, "the test keeps too much to be of use"


def test_flat_is_exact_for_flat_mirrors() -> None:
    """Never drops what reflects; keeps little that does not (only what lies in the infinite cone)."""
    case = random_cases(30_000, 0.0)
    flat, _ = answers(case)
    truth = reflects_the_sphere(case, 200, flat=True)
    assert not (truth & ~flat).any()
    assert (flat & ~truth).mean() < 0.02


def two_object_scene(**reflector: object) -> Scene:
    return Scene(
        camera=Camera(eye=(0, -4, 1), look_at=(0, 0, 0), width=160, height=120, fov_y=35),
        objects=(
            Object(shape="sphere", material=Material(mirror=(1, 1, 1)), **reflector),
            Object(shape="torus_knot", params={"segments": [200, 30]}, scale=0.4, translate=(0.9, -1.2, 0)),
        ),
    )


@pytest.mark.parametrize("segments", [[8, 4], [32, 16], [128, 64]])
def test_culling_changes_no_pixel(segments: list[int]) -> None:
    scene = two_object_scene(params={"segments": segments})
    everything = ldtrefl.render(scene, "ldt", cull="none")
    safe = ldtrefl.render(scene, "ldt", cull="safe")
    np.testing.assert_array_equal(safe.image, everything.image)
    assert safe.stats.counters["rays_saved"] > 0 or segments == [8, 4]
    assert 0 < safe.stats.counters["triangles_culled"] < safe.stats.counters["triangles_tested"]


def test_objects_that_nothing_reflects_are_not_peeled() -> None:
    scene = two_object_scene()
    behind = Object(shape="gyroid", translate=(0, 1.5, -0.375), scale=0.1)  # in the ball's shadow as seen by the eye
    frame = ldtrefl.render(Scene(camera=scene.camera, objects=(*scene.objects, behind)), "ldt")
    assert frame.stats.counters["objects_peeled"] == 1
    away = scene.with_camera(Camera(eye=(0, -4, 1), look_at=(0, -8, 1), width=32, height=32))
    none = ldtrefl.render(away, "ldt")
    assert none.stats.counters["rays"] == 0 and "objects_peeled" not in none.stats.counters
