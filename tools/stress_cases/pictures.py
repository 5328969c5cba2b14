"""What the cases about pictures share: whole frames, and reflected rays followed by nobody's tracer of ours."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

import ldtrefl
from ldtrefl.camera import camera_axes

from .judge import Outcome, Truth

METHODS: dict[str, tuple[str, dict[str, str]]] = {
    "exact": ("ldt", {"quality": "exact"}),
    "balanced": ("ldt", {}),
    "fast": ("ldt", {"quality": "fast"}),
    "linear": ("ldt", {"search": "linear"}),
    "bvh": ("bvh", {}),
}
"""Name in the report -> method and options."""


def frames(scene: ldtrefl.Scene) -> Iterator[tuple[str, ldtrefl.Frame, float]]:
    """(name, frame, seconds) of every method."""
    for by, (method, options) in METHODS.items():
        start = time.perf_counter()
        frame = ldtrefl.render(scene, method, **options)
        yield by, frame, time.perf_counter() - start


def not_finite(frame: ldtrefl.Frame) -> int:
    """Pixels that are not finite."""
    return int((~np.isfinite(frame.image).all(axis=2)).sum())


def judge_same_pictures(
    case: str, what: str, a: ldtrefl.Scene, b: ldtrefl.Scene, percent: float, most: float = 0.02
) -> list[Outcome]:
    """Both scenes look the same but for ``percent`` of the pixels, which may differ by more than ``most``."""
    outcomes = []
    for (by, one, _), (_, other, seconds) in zip(frames(a), frames(b), strict=True):
        differ = np.abs(one.image - other.image).max(axis=2) > most
        outcome = Outcome(case, what, by, tried=differ.size, wrong_hits=int(differ.sum()), seconds=seconds)
        outcome.non_finite = not_finite(one) + not_finite(other)
        outcome.limit = f"<= {percent:g}% of the pixels differ by more than {most:g}"
        outcome.passed = outcome.non_finite == 0 and 100.0 * differ.mean() <= percent
        outcomes.append(outcome)
    return outcomes


def camera_rays(camera: ldtrefl.Camera) -> tuple[np.ndarray, np.ndarray]:
    """(h * w, 3) float64 origins and directions through the pixels' centres."""
    right, down, forward = camera_axes(camera)
    half = np.tan(np.radians(camera.fov_y / 2))
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    across = (2 * x / camera.width - 1) * half * camera.width / camera.height
    along = (2 * y / camera.height - 1) * half
    rays = forward + across[..., None] * right + along[..., None] * down
    return np.broadcast_to(np.asarray(camera.eye, float), (x.size, 3)), rays.reshape(-1, 3)


class Reference:
    """Primary and reflected rays of a scene, made in float64 and followed by Embree: no rasteriser, no map."""

    def __init__(self, scene: ldtrefl.Scene) -> None:
        self.scene = scene
        meshes = []
        for entry in scene.objects:
            matrix, mesh = entry.world_from_object(), entry.geometry
            meshes.append(ldtrefl.Mesh(mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3], mesh.faces))
        self.truths = [Truth(mesh, always_embree=True) for mesh in meshes]

    def first(self, o: np.ndarray, d: np.ndarray, without: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
        """(t, object, triangle) of the first hits; ``without`` holds an object per ray that is not looked for."""
        t, index, triangle = np.full(len(o), np.inf), np.full(len(o), -1), np.full(len(o), -1)
        for k, truth in enumerate(self.truths):
            found, number = truth.first_hits(o, d)
            if without is not None:
                found = np.where(without == k, np.inf, found)
            nearer = found < t
            t, index, triangle = (
                np.where(nearer, found, t),
                np.where(nearer, k, index),
                np.where(nearer, number, triangle),
            )
        return t, index, triangle

    def normals(self, k: int, triangles: np.ndarray, points: np.ndarray, view: np.ndarray) -> np.ndarray:
        """(n, 3) unit shading normals of object ``k`` on the viewer's side."""
        mesh, entry = self.truths[k].mesh, self.scene.objects[k]
        a, b, c = (mesh.vertices[mesh.faces[triangles, i]] for i in range(3))
        facet = np.cross(b - a, c - a)
        facet *= -np.sign((facet * view).sum(axis=1, keepdims=True))
        normal = facet
        if entry.smooth:
            area = (facet * facet).sum(axis=1)
            weights = [
                np.abs((np.cross(q - points, r - points) * facet).sum(axis=1)) / area
                for q, r in ((b, c), (c, a), (a, b))
            ]
            corners = entry.geometry.normals[entry.geometry.faces[triangles]]
            mixed = sum(w[:, None] * corners[:, i] for i, w in enumerate(weights))
            normal = mixed @ np.linalg.inv(entry.world_from_object()[:3, :3])
            normal *= np.sign((normal * facet).sum(axis=1, keepdims=True))
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)

    def reflected_hits(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(h, w) arrays: object seen, distance of the reflected ray's hit, and the object hit."""
        camera = self.scene.camera
        shape = camera.height, camera.width
        o, d = camera_rays(camera)
        t, seen, triangle = self.first(o, d)
        distance, hit = np.full(len(o), np.inf), np.full(len(o), -1)
        for k, entry in enumerate(self.scene.objects):
            at = np.flatnonzero(seen == k)
            if entry.is_reflector and len(at):
                way = d[at] / np.linalg.norm(d[at], axis=1, keepdims=True)
                points = o[at] + t[at, None] * d[at]
                normal = self.normals(k, triangle[at], points, way)
                onwards = way - 2 * (way * normal).sum(axis=1, keepdims=True) * normal
                distance[at], hit[at], _ = self.first(points, onwards, np.full(len(at), k))
        return seen.reshape(shape), distance.reshape(shape), hit.reshape(shape)


def judge_reflections(
    case: str, what: str, scene: ldtrefl.Scene, percent: float, linear_percent: float = 15.0
) -> list[Outcome]:
    """Where reflected rays end, against :class:`Reference`, on the pixels that see the same reflector.

    ``percent`` of them may end on another object, or half a texel or more from the true distance.
    """
    seen, distance, hit = Reference(scene).reflected_hits()
    mirrors = np.array([entry.is_reflector for entry in scene.objects] + [False])
    outcomes = []
    for by, frame, seconds in frames(scene):
        outcome = Outcome(case, what, by, seconds=seconds, non_finite=not_finite(frame))
        allowed = linear_percent if by == "linear" else percent
        outcome.limit = f"<= {allowed:g}% of the reflector's pixels end elsewhere, all pixels finite"
        same = frame.reflector_mask & mirrors[seen]
        outcome.tried = int(same.sum())
        if frame.hits is not None and outcome.tried:
            ours, true = frame.hits.object[same] >= 0, hit[same] >= 0
            outcome.wrong_hits, outcome.wrong_misses = int((ours & ~true).sum()), int((true & ~ours).sum())
            both = ours & true
            texels = np.array([2 * scene_half / 256 for scene_half in _halves(scene)])[hit[same][both]]
            error = np.abs(frame.hits.distance[same][both] - distance[same][both]) / texels
            outcome.worst = float(error.max(initial=0.0))
            outcome.p999 = float(np.percentile(error, 99.9)) if len(error) else 0.0
            off = (error > 0.5) | (frame.hits.object[same][both] != hit[same][both])
            wrong = outcome.wrong_hits + outcome.wrong_misses + int(off.sum())
            outcome.passed = 100.0 * wrong <= allowed * outcome.tried
        lost = frame.reflector_mask != mirrors[seen]
        outcome.passed &= outcome.non_finite == 0 and (percent == 100 or lost.sum() <= max(4, 0.02 * lost.size))
        outcomes.append(outcome)
    return outcomes


def _halves(scene: ldtrefl.Scene) -> list[float]:
    halves = []
    for entry in scene.objects:
        matrix = entry.world_from_object()
        low, high = entry.geometry.bounds
        halves.append(float((np.linalg.norm(matrix[:3, :3], axis=0) * (high - low)).max()) / 2)
    return halves
