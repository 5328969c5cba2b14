"""Surfaces of groups of rays against float64: where they are, which way they face, whichever lanes see them."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.scene.mesh import Mesh
from ldtrefl.shading.surface import Surface
from ldtrefl.shading.surfaces import GROUP, Sighting, look_along, look_from
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import ObjectRecord

CAMERA = Camera(eye=(0.0, -5.0, 1.0), look_at=(0.0, 0.0, 0.0))
ROUNDED = 2e-6
VECTORS = {"view": wp.vec3, "way": wp.vec3d}


@launch.kernel
def look(
    first: int,
    # In:
    from_eye: int,
    lanes: int,
    objects: wp.array(dtype=ObjectRecord),
    eye: wp.vec3d,
    given: wp.array(dtype=Sighting),
    # Out:
    sightings_out: wp.array(dtype=Sighting),
    surfaces_out: wp.array(dtype=Surface),
):
    """Find the surfaces of one group."""
    for lane in range(given.shape[0]):
        sightings_out[lane] = given[lane]
    if from_eye != 0:
        look_from(objects, lanes, eye, sightings_out, surfaces_out)
    else:
        look_along(objects, lanes, sightings_out, surfaces_out)


def seen(scene: DeviceScene, sightings: list[dict], lanes: int, *, eye: np.ndarray | None = None) -> tuple:
    """(what is known of the sightings, the surfaces) as numpy's structured arrays."""
    structs = []
    for values in sightings:
        struct = Sighting()
        for name, value in values.items():
            setattr(
                struct, name, {"view": wp.vec3, "way": wp.vec3d}[name](*value) if name in ("view", "way") else value
            )
        structs.append(struct)
    device = launch.resolve_device(None)
    given, after = (wp.array(structs, dtype=Sighting, device=device) for _ in range(2))
    surfaces = wp.zeros(int(GROUP), dtype=Surface, device=device)
    place = wp.vec3d(*(np.zeros(3) if eye is None else eye))
    inputs = [0 if eye is None else 1, lanes, scene.records, place, given, after, surfaces]
    launch.launch(look, 1, inputs, device)
    return after.numpy(), surfaces.numpy()


def two_meshes(offset: float = 0.0) -> tuple[Scene, DeviceScene]:
    """Two soups of triangles with normals of their own, stretched and turned; ``offset`` moves them far from 0."""
    rng = np.random.default_rng(5)
    objects = []
    for k, scale in enumerate(((1.0, 0.3, 2.0), 0.5)):
        vertices = rng.uniform(-1.0, 1.0, (30, 3))
        faces = np.stack([rng.permutation(30)[:3] for _ in range(40)])
        normals = rng.normal(size=(30, 3))
        place = tuple((np.array([0.4 * k, 0.1, -0.2]) + offset).tolist())
        objects.append(Object(mesh=Mesh(vertices, faces, normals), scale=scale, rotate=(1, 2, 3, 40), translate=place))
    scene = Scene(camera=CAMERA, objects=tuple(objects))
    return scene, DeviceScene(scene, launch.resolve_device(None))


def corners_of(scene: DeviceScene, k: int, triangle: int) -> tuple[np.ndarray, np.ndarray]:
    """(3, 3) corners of a triangle in device space and (3, 3) normals of unit space, float64."""
    mesh, matrix = scene.meshes[scene.mesh_of[k]], scene.device_from_world @ scene.world_from_unit[k]
    face = mesh.faces.numpy()[triangle]
    return mesh.vertices.numpy()[face].astype(float) @ matrix[:3, :3].T + matrix[:3, 3], mesh.normals.numpy()[face]


def expected_normals(
    scene: DeviceScene, k: int, corners: np.ndarray, normals: np.ndarray, weights: np.ndarray, view: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals of the facet and of shading, facing the viewer."""
    facet = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    facet *= -np.sign(facet @ view) / np.linalg.norm(facet)
    linear = (scene.device_from_world @ scene.world_from_unit[k])[:3, :3]
    normal = np.linalg.inv(linear).T @ (weights @ normals)
    return facet, normal * np.sign(normal @ facet) / np.linalg.norm(normal)


@pytest.mark.parametrize("offset", [0.0, 1e4])
@pytest.mark.parametrize("lanes", [0b11111111, 0b00000001, 0b10100110])
def test_what_an_eye_sees(lanes: int, offset: float) -> None:
    _, scene = two_meshes(offset)
    rng = np.random.default_rng(lanes)
    eye = scene.spheres[0, :3] + [0.3, -3.0, 1.1]
    sightings, points, weights = [], [], []
    for _ in range(int(GROUP)):
        k, triangle = int(rng.integers(2)), int(rng.integers(40))
        weight = rng.dirichlet((1, 1, 1))
        point = weight @ corners_of(scene, k, triangle)[0]
        sightings.append({"object": k, "triangle": triangle, "way": (point - eye) * rng.uniform(0.1, 2.0)})
        points.append(point)
        weights.append(weight)
    after, surfaces = seen(scene, sightings, lanes, eye=eye)
    for lane in range(int(GROUP)):
        if not lanes >> lane & 1:
            assert surfaces[lane]["position"].tolist() == [0.0, 0.0, 0.0], "a lane that was not asked for"
            continue
        k, triangle = sightings[lane]["object"], sightings[lane]["triangle"]
        corners, normals = corners_of(scene, k, triangle)
        view = (points[lane] - eye) / np.linalg.norm(points[lane] - eye)
        facet = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        grazing = 1.0 / abs(facet @ view / np.linalg.norm(facet))
        apart = np.linalg.norm(surfaces[lane]["position"] - points[lane])
        assert apart < ROUNDED * grazing * np.linalg.norm(points[lane] - eye)
        u, v = after[lane]["u"], after[lane]["v"]
        at = np.array([1.0 - u - v, u, v])
        np.testing.assert_allclose(at @ corners, surfaces[lane]["position"], atol=ROUNDED)
        np.testing.assert_allclose(after[lane]["view"], view, atol=ROUNDED)
        facet, normal = expected_normals(scene, k, corners, normals, at, view)
        np.testing.assert_allclose(surfaces[lane]["facet"], facet, atol=5 * ROUNDED)
        np.testing.assert_allclose(surfaces[lane]["normal"], normal, atol=50 * ROUNDED)
        assert (surfaces[lane]["object"], surfaces[lane]["triangle"]) == (k, triangle)


def test_what_rays_have_met() -> None:
    _, scene = two_meshes()
    rng = np.random.default_rng(9)
    sightings = []
    for _ in range(int(GROUP)):
        u, v = rng.dirichlet((1, 1, 1))[:2]
        view = rng.normal(size=3)
        view /= np.linalg.norm(view)
        which = {"object": int(rng.integers(2)), "triangle": int(rng.integers(40))}
        sightings.append({**which, "u": u, "v": v, "view": view})
    _, surfaces = seen(scene, sightings, 0xFF)
    for sighting, surface in zip(sightings, surfaces, strict=True):
        corners, normals = corners_of(scene, sighting["object"], sighting["triangle"])
        weights = np.array([1.0 - sighting["u"] - sighting["v"], sighting["u"], sighting["v"]])
        np.testing.assert_allclose(surface["position"], weights @ corners, atol=ROUNDED)
        facet, normal = expected_normals(scene, sighting["object"], corners, normals, weights, sighting["view"])
        np.testing.assert_allclose(surface["facet"], facet, atol=5 * ROUNDED)
        np.testing.assert_allclose(surface["normal"], normal, atol=50 * ROUNDED)
        winding = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        assert surface["is_back"] == (winding @ sighting["view"] > 0.0)


def test_a_ray_that_misses_by_rounding_or_runs_along_the_triangle_stays_on_it() -> None:
    _, scene = two_meshes()
    corners, _ = corners_of(scene, 0, 3)
    middle, across = corners.mean(axis=0), np.cross(corners[1] - corners[0], corners[2] - corners[0])
    eye = middle + 3.0 * across / np.linalg.norm(across)
    beside = corners[0] + 1e-4 * (corners[0] - middle) - eye  # past a corner
    along = corners[1] - corners[0]  # never meets the plane
    which = {"object": 0, "triangle": 3}
    after, surfaces = seen(
        scene, [{**which, "way": way} for way in (beside, along, np.zeros(3))] * 2, 0b111111, eye=eye
    )
    np.testing.assert_allclose(surfaces[0]["position"], corners[0], atol=1e-3)
    for sighting, surface in zip(after, surfaces, strict=False):
        weights = np.array([1.0 - sighting["u"] - sighting["v"], sighting["u"], sighting["v"]])
        assert (weights >= -1e-6).all() and (weights <= 1.0 + 1e-6).all()
        assert np.isfinite(surface["position"]).all() and np.isfinite(surface["normal"]).all()
