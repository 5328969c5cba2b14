"""Where the paths of a scene go, from mirror to mirror, in float64 and by brute force; and what they bring.

Every ray is tested against every triangle where it stands in the world (Moeller and Trumbore 1997). A path leaves a
triangle by leaving that one out of its next search. It uses no code of ours but that of the scene, and the launching of
kernels. Surfaces give off their emission alone: what lights, shadows and textures do is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.scene.description import Object

from .inputs import camera_rays

TOUCHING = 1e-10
"""Share of the size of the object that a ray leaves within which it meets nothing: what lies in the very triangle."""

SPHERE_SLACK = 1e-6
"""By how much larger than they must the spheres about objects are taken: far beyond the rounding of float64."""

SMALLEST_NORMAL = 1e-6
"""Length of an interpolated normal below which it says nothing."""

LEAST_RISE, KEPT_RISE = 0.01, 0.9
"""A mirrored ray rises above its facet by this sine at least, or by this part of the viewer's own rise where that is
less: what the renderer promises."""

HALVINGS = 60
"""Of the turn of a normal that is bent: more than a float64 has bits."""


@wp.struct
class LeavingRays:
    """Rays, and the triangles that they leave."""

    origin: wp.array(dtype=wp.vec3d)  # in the world
    direction: wp.array(dtype=wp.vec3d)  # unit
    left: wp.array(dtype=wp.int32)  # the triangle that the ray leaves; -1 for none
    least: wp.array(dtype=wp.float64)  # t of the nearest hit that counts


@wp.struct
class Triangles:
    """The triangles of all objects in the world, one object after another."""

    corner: wp.array(dtype=wp.vec3d)
    edge_u: wp.array(dtype=wp.vec3d)  # from that corner
    edge_v: wp.array(dtype=wp.vec3d)
    begin: wp.array(dtype=wp.int32)  # the first triangle of each object; then the number of triangles
    centre: wp.array(dtype=wp.vec3d)  # of a sphere about each object
    radius: wp.array(dtype=wp.float64)


@launch.kernel
def find_nearest_triangles(
    first: int,
    # In:
    rays: LeavingRays,
    triangles: Triangles,
    # Out:
    t_out: wp.array(dtype=wp.float64),
    triangle_out: wp.array(dtype=wp.int32),
):
    """Test one ray against every triangle."""
    i = first + wp.tid()
    o, d = rays.origin[i], rays.direction[i]
    nearest = wp.float64(wp.inf)
    found = int(-1)
    zero, one = wp.float64(0.0), wp.float64(1.0)
    for k in range(triangles.centre.shape[0]):
        offset = triangles.centre[k] - o
        aside = offset - wp.dot(offset, d) * d
        if wp.dot(aside, aside) <= triangles.radius[k] * triangles.radius[k]:
            for j in range(triangles.begin[k], triangles.begin[k + 1]):
                edge_u, edge_v = triangles.edge_u[j], triangles.edge_v[j]
                p = wp.cross(d, edge_v)
                determinant = wp.dot(p, edge_u)
                if determinant != zero and j != rays.left[i]:
                    s = o - triangles.corner[j]
                    u = wp.dot(s, p) / determinant
                    if u >= zero and u <= one:
                        q = wp.cross(s, edge_u)
                        v = wp.dot(d, q) / determinant
                        t = wp.dot(edge_v, q) / determinant
                        if v >= zero and u + v <= one and t > rays.least[i] and t < nearest:
                            nearest = t
                            found = j
    t_out[i] = nearest
    triangle_out[i] = found


@dataclass(frozen=True, eq=False)
class Ends:
    """Where paths are after so many mirrors, (h, w) each; -1 and +inf on a miss, and where none goes on."""

    followed: np.ndarray
    """bool: whether the path got so far."""
    distance: np.ndarray
    """World units from where it was before."""
    object: np.ndarray
    triangle: np.ndarray
    """Of that object."""


@dataclass(frozen=True, eq=False)
class Paths:
    """The paths of all pixels of a picture."""

    image: np.ndarray
    """(h, w, 3) radiance."""
    ends: tuple[Ends, ...]
    """What the camera sees, the first reflection, the second, ..."""


class Surfaces:
    """The objects of a scene in the world, in float64."""

    def __init__(self, scene: ldtrefl.Scene) -> None:
        meshes = [entry.geometry for entry in scene.objects]
        places = [entry.world_from_object() for entry in scene.objects]
        worlds = [mesh.vertices @ m[:3, :3].T + m[:3, 3] for mesh, m in zip(meshes, places, strict=True)]
        self.corners = np.concatenate([world[mesh.faces] for world, mesh in zip(worlds, meshes, strict=True)])
        self.normals = np.concatenate([_world_normals(entry) for entry in scene.objects])
        self.begin = np.cumsum([0] + [len(mesh.faces) for mesh in meshes])
        self.owner = np.repeat(np.arange(len(meshes)), np.diff(self.begin))
        low, high = (np.array([extreme(world, axis=0) for world in worlds]) for extreme in (np.min, np.max))
        self.radius = 0.5 * np.linalg.norm(high - low, axis=1)
        a, b, c = self.corners.transpose(1, 0, 2)
        self._triangles = Triangles()
        self._triangles.corner, self._triangles.edge_u, self._triangles.edge_v = map(_points, (a, b - a, c - a))
        self._triangles.begin = wp.array(self.begin, dtype=wp.int32, device="cpu")
        self._triangles.centre = _points(0.5 * (low + high))
        self._triangles.radius = wp.array((1.0 + SPHERE_SLACK) * self.radius, dtype=wp.float64, device="cpu")

    def first_hits(self, o: np.ndarray, d: np.ndarray, left: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(n,) t and triangles, +inf and -1 on a miss, of rays of unit directions that leave the triangles ``left``."""
        rays = LeavingRays()
        rays.origin, rays.direction = _points(o), _points(d)
        rays.left = wp.array(left, dtype=wp.int32, device="cpu")
        least = np.where(left >= 0, TOUCHING * self.radius[self.owner[left]], 0.0)
        rays.least = wp.array(least, dtype=wp.float64, device="cpu")
        t, triangle = wp.empty(len(o), dtype=wp.float64, device="cpu"), wp.empty(len(o), dtype=wp.int32, device="cpu")
        launch.launch(find_nearest_triangles, len(o), [rays, self._triangles, t, triangle], t.device)
        return t.numpy(), triangle.numpy().astype(int)

    def facet_and_normal(self, triangles: np.ndarray, points: np.ndarray, view: np.ndarray) -> tuple[np.ndarray, ...]:
        """(n, 3) unit normals of facets, towards the viewer, and shading normals on their side."""
        a, b, c = self.corners[triangles].transpose(1, 0, 2)
        cross = np.cross(b - a, c - a)
        facet = -np.sign((cross * view).sum(axis=1, keepdims=True)) * cross
        area = (cross * cross).sum(axis=1)
        pairs = ((b, c), (c, a), (a, b))
        weights = np.stack([(np.cross(q - points, r - points) * cross).sum(axis=1) / area for q, r in pairs], axis=1)
        normal = (weights[..., None] * self.normals[triangles]).sum(axis=1)
        normal *= np.sign((normal * facet).sum(axis=1, keepdims=True))
        says_nothing = np.linalg.norm(normal, axis=1) < SMALLEST_NORMAL
        facet /= np.linalg.norm(facet, axis=1, keepdims=True)
        normal = np.where(says_nothing[:, None], facet, normal)
        return facet, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def paths_of(scene: ldtrefl.Scene, bounces: int) -> Paths:
    """Follow the paths of all pixels by at most so many mirrors; as the renderer does, those that go no further end in
    the environment."""
    surfaces, camera = Surfaces(scene), scene.camera
    shape = camera.height, camera.width
    o, d = camera_rays(camera)
    d = d / np.linalg.norm(d, axis=1, keepdims=True)
    emission, mirror = (np.array([getattr(e.material, name) for e in scene.objects]) for name in ("emission", "mirror"))
    count, ends = len(o), []
    radiance, seen_in = np.zeros((count, 3)), np.ones((count, 3))
    weight: np.ndarray = np.ones((count, 3))
    paths: np.ndarray = np.arange(count)
    left = np.full(count, -1)
    for bounce in range(bounces + 1):
        if not len(paths):
            break
        t, triangle = surfaces.first_hits(o, d, left)
        met = np.where(triangle >= 0, surfaces.owner[triangle], -1)
        ends.append(_ends(shape, paths, t, met, np.where(triangle >= 0, triangle - surfaces.begin[met], -1)))
        missed = triangle < 0
        radiance[paths[missed]] += weight[missed] * environment(scene, d[missed])
        o, d, paths, weight, triangle, met, t = (x[~missed] for x in (o, d, paths, weight, triangle, met, t))
        radiance[paths] += weight * emission[met]
        onwards = mirror[met].max(axis=1) > 0.0
        o, d, paths, weight, triangle, met, t = (x[onwards] for x in (o, d, paths, weight, triangle, met, t))
        o = o + t[:, None] * d
        facet, normal = surfaces.facet_and_normal(triangle, o, d)
        d, left, weight = mirrored(d, normal, facet), triangle, weight * mirror[met]
        if bounce == 0:  # the weight of what is seen in the first mirror does not count
            seen_in[paths] = mirror[met]
        share = (weight / np.where(seen_in[paths] > 0.0, seen_in[paths], 1.0)).max(axis=1)
        ended = (share < scene.reflection.least_weight) | (bounce == bounces)
        radiance[paths[ended]] += weight[ended] * environment(scene, d[ended])
        o, d, paths, weight, left = (x[~ended] for x in (o, d, paths, weight, left))
    return Paths(radiance.reshape(*shape, 3), tuple(ends))


def environment(scene: ldtrefl.Scene, directions: np.ndarray) -> np.ndarray:
    """(n, 3) radiance in unit directions, of a scene without a picture of the sky."""
    up = np.array(scene.camera.up) / np.linalg.norm(scene.camera.up)
    blend = (0.5 + 0.5 * directions @ up)[:, None]
    return blend * np.array(scene.environment.sky) + (1.0 - blend) * np.array(scene.environment.ground)


def mirrored(directions: np.ndarray, normals: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """(n, 3) unit directions mirrored at normals, which are turned towards their facets' just far enough."""
    least = np.minimum(KEPT_RISE * -(directions * facets).sum(axis=1), LEAST_RISE)
    fully, not_at_all = np.ones(len(directions)), np.zeros(len(directions))
    for _ in range(HALVINGS):
        turn = 0.5 * (fully + not_at_all)
        rises = (_mirrored_at(directions, _turned(normals, facets, turn)) * facets).sum(axis=1) >= least
        fully, not_at_all = np.where(rises, turn, fully), np.where(rises, not_at_all, turn)
    leaving = _mirrored_at(directions, normals)
    rises = (leaving * facets).sum(axis=1) >= least
    return np.where(rises[:, None], leaving, _mirrored_at(directions, _turned(normals, facets, fully)))


def _mirrored_at(directions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    return directions - 2.0 * (directions * normals).sum(axis=1, keepdims=True) * normals


def _turned(normals: np.ndarray, facets: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Unit normals turned by a share of their angle with the facets' (spherical linear interpolation)."""
    angle = np.arccos(np.clip((normals * facets).sum(axis=1), -1.0, 1.0))
    sine = np.maximum(np.sin(angle), np.finfo(float).tiny)
    shares = (np.sin((1.0 - turn) * angle) / sine)[:, None], (np.sin(turn * angle) / sine)[:, None]
    mixed = np.where((angle > 0.0)[:, None], shares[0] * normals + shares[1] * facets, facets)
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)


def _points(values: np.ndarray) -> wp.array:
    return wp.array(np.ascontiguousarray(values), dtype=wp.vec3d, device="cpu")


def _world_normals(entry: Object) -> np.ndarray:
    """(m, 3, 3) normals of the corners of an object's triangles, in the world; 0 where it is not smooth."""
    mesh = entry.geometry
    if entry.smooth is False:
        return np.zeros((len(mesh.faces), 3, 3))
    return mesh.normals[mesh.faces] @ np.linalg.inv(entry.world_from_object()[:3, :3])


def _ends(shape: tuple[int, int], paths: np.ndarray, t: np.ndarray, met: np.ndarray, triangle: np.ndarray) -> Ends:
    pictures = []
    for values, fill in ((np.ones(len(paths), bool), False), (t, np.inf), (met, -1), (triangle, -1)):
        picture = np.full(shape[0] * shape[1], fill, values.dtype)
        picture[paths] = values
        pictures.append(picture.reshape(shape))
    return Ends(*pictures)
