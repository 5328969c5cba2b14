"""Virtual vertices on star-shaped reflectors: where points are placed, and what the eye sees in a direction."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.methods.virtual.fermat_places import FermatPlaces, surface_towards
from ldtrefl.methods.virtual.fermat_search import SearchLimits
from ldtrefl.methods.virtual.radius_map import RadiusMap
from ldtrefl.methods.virtual.star_shape import star_shape
from ldtrefl.methods.virtual.subdivision import SurfacePoint
from ldtrefl.methods.virtual.vertex import HIDDEN, VirtualVertex
from ldtrefl.scene.shapes import make
from ldtrefl.world.camera import CameraView
from tests.methods.virtual.ellipsoids import directions, dots

EYE = np.array([0.0, -4.0, 0.5])
CENTRE = np.array([0.2, 0.1, -0.1])


def unit_sphere_map() -> RadiusMap:
    sphere = make("sphere", {"segments": [256, 128]})
    shape = star_shape(sphere.vertices + CENTRE, sphere.faces, sphere.normals.astype(float), "ball")
    return shape.radius_map(128, wp.get_device("cpu"))


def camera() -> CameraView:
    view = CameraView()
    view.eye, view.forward = wp.vec3d(*EYE), wp.vec3d(0.0, 1.0, 0.0)
    return view


@launch.kernel
def look(
    first: int,
    # In:
    surface: RadiusMap,
    view: CameraView,
    points: wp.array(dtype=wp.vec3d),
    # Out:
    found_out: wp.array(dtype=SurfacePoint),
):
    """Each thread looks in the direction of one point."""
    i = first + wp.tid()
    found_out[i] = surface_towards(surface, view, points[i])


def test_the_eye_sees_where_its_ray_meets_the_sphere() -> None:
    on_sphere = directions(4000)
    is_seen = dots(EYE - CENTRE - on_sphere, on_sphere) > 0.3
    points = CENTRE + 0.97 * on_sphere[is_seen]
    device = wp.get_device("cpu")
    found = wp.zeros(len(points), dtype=SurfacePoint, device=device)
    given = wp.array(points, dtype=wp.vec3d, device=device)
    launch.launch(look, len(points), [unit_sphere_map(), camera(), given, found], device)
    way = (points - EYE) / np.linalg.norm(points - EYE, axis=1, keepdims=True)
    along = way @ (CENTRE - EYE)
    distance = along - np.sqrt(along**2 - (CENTRE - EYE) @ (CENTRE - EYE) + 1.0)
    exact = EYE + distance[:, None] * way
    assert found.numpy()["is_known"].all()
    assert np.allclose(found.numpy()["position"], exact, atol=2e-3)
    assert np.allclose(found.numpy()["normal"], exact - CENTRE, atol=2e-3)


def test_vertices_stand_behind_the_points_that_mirror_them() -> None:
    points = CENTRE + 3.0 * directions(2000)
    limits = SearchLimits()
    limits.most_iterations, limits.least_area, limits.most_residual = 20, 1e-12, 1e-3
    device, stats = wp.get_device("cpu"), Stats()
    vertices = wp.zeros(len(points), dtype=VirtualVertex, device=device)
    places = FermatPlaces(camera(), unit_sphere_map(), limits, stats)
    places(wp.array(points, dtype=wp.vec3d, device=device), vertices)
    found = vertices.numpy()
    # Hidden is what is in the cone of the sphere and behind it.
    way = (points - EYE) / np.linalg.norm(points - EYE, axis=1, keepdims=True)
    aside = np.linalg.norm(np.cross(way, CENTRE - EYE), axis=1)
    is_hidden = (aside < 1.0) & (np.linalg.norm(points - EYE, axis=1) > np.linalg.norm(CENTRE - EYE))
    assert np.mean(found["is_seen"] == np.where(is_hidden, int(HIDDEN), 1)) > 0.995
    is_seen = found["is_seen"] == 1
    p, position = found["point"][is_seen], found["position"][is_seen]
    view, onwards = p - EYE, points[is_seen] - p
    there = np.linalg.norm(view, axis=1)
    assert np.allclose(found["distance"][is_seen], np.linalg.norm(onwards, axis=1), rtol=1e-6)
    assert np.allclose(np.linalg.norm(position - EYE, axis=1), there + found["distance"][is_seen], rtol=1e-6)
    assert np.allclose(np.cross(view, position - EYE), 0.0, atol=1e-9)
    assert np.allclose(found["depth"][is_seen], view[:, 1], rtol=1e-6)
    hidden = found["point"][found["is_seen"] == int(HIDDEN)] - CENTRE
    assert np.allclose(dots(hidden, EYE - CENTRE - hidden), 0.0, atol=0.02)  # on the silhouette
    counters = stats.counters
    assert counters["vertices"] == 2000 and counters["vertices_found"] == (found["is_seen"] != 0).sum()
    assert 2 * 2000 < counters["iterations"] < 12 * 2000
