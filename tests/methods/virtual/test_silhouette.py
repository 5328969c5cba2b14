"""Silhouettes of spheres and ellipsoids, in closed form."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.methods.virtual.radius_map import RadiusMap
from ldtrefl.methods.virtual.silhouette import silhouette_point
from ldtrefl.methods.virtual.star_shape import star_shape
from ldtrefl.scene.shapes import make
from tests.methods.virtual.ellipsoids import directions

AXES = np.array([1.0, 1.4, 0.8])


@launch.kernel
def find_silhouette(
    first: int,
    # In:
    surface: RadiusMap,
    eyes: wp.array(dtype=wp.vec3d),
    beyond: wp.array(dtype=wp.vec3d),
    # Out:
    points_out: wp.array(dtype=wp.vec3d),
):
    """Each thread finds the silhouette on the way to one point."""
    i = first + wp.tid()
    points_out[i] = silhouette_point(surface, eyes[i], beyond[i])


def test_the_silhouette_of_an_ellipsoid() -> None:
    sphere, device = make("sphere", {"segments": [256, 128]}), wp.get_device("cpu")
    surface = star_shape(sphere.vertices * AXES, sphere.faces, sphere.normals / AXES, "egg").radius_map(128, device)
    eyes, beyond = 4.0 * directions(2000), directions(2000) * AXES
    is_unseen = np.einsum("ij,ij->i", beyond / AXES**2, eyes) < 0.9
    eyes, beyond = eyes[is_unseen], beyond[is_unseen]
    points = wp.zeros(len(eyes), dtype=wp.vec3d, device=device)
    given = [wp.array(values, dtype=wp.vec3d, device=device) for values in (eyes, beyond)]
    launch.launch(find_silhouette, len(eyes), [surface, *given, points], device)
    found = points.numpy()
    # The eye's polar plane meets the ellipsoid in its silhouette; and the point lies between eye and ``beyond``.
    assert np.allclose(np.einsum("ij,ij->i", found / AXES**2, eyes), 1.0, atol=0.02)
    assert np.allclose(np.linalg.norm(found / AXES, axis=1), 1.0, atol=1e-3)
    assert np.allclose(np.einsum("ij,ij->i", np.cross(eyes, beyond), found), 0.0, atol=1e-3)
    assert np.all(np.einsum("ij,ij->i", found, eyes) > np.einsum("ij,ij->i", beyond, eyes) - 0.05)
