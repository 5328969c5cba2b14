"""What ours adds: how exact the search in the image is, what tessellation wins back, and the holes that it leaves."""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.methods import find_method
from ldtrefl.methods.virtual.bisector_places import BisectorPlaces
from ldtrefl.methods.virtual.reflector_texture import texture_of, wider
from ldtrefl.methods.virtual.vertex import VirtualVertex
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world.camera import camera_view, whole_image
from ldtrefl.world.device_scene import DeviceScene

from .table import Cell, Table
from .tessellated import picture

EYES = 100
POINTS = 100
"""Of each eye."""

SIDE = 256
"""Texels."""

STEEPEST = 75.0
"""Degrees of incidence up to which texels are seen from the front: nearer to the silhouette a texel is a long way."""

COARSE = {"paper/bar": 3, "paper/tablecloth": 4, "teapot": 3}
"""Scenes with coarse objects, and the levels up to which full tessellation takes no longer than a minute."""

QUICK_LEVELS = 1
DEFAULT_LEVELS, DEFAULT = (find_method("tessellation").options()[name][0] for name in ("levels", "threshold"))
"""The options of ``tessellation`` if nothing is said."""

FINER = 0.0001
"""A threshold at which more is won back."""

WON_BACK = 0.8
"""Of the SSIM that ``bisector`` loses against full tessellation, what adaptive tessellation is to win back."""

HOLES_AT = 0.003
"""A threshold at which neighbours are often divided unlike."""


def tables(quick: bool) -> list[Table]:
    """The three."""
    return [_against_alhazen(quick), _won_back(quick), _holes(quick)]


def alhazen(eyes: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """((n, 3), (n,) bool): where the unit sphere about 0 mirrors points to eyes, both outside, and whether it does.

    In the plane of the three, as complex numbers, a mirroring point z has ``(a - z)(b - z) / z^2`` real: Alhazen's
    quartic ``conj(ab) z^4 - conj(a + b) z^3 + (a + b) z - ab = 0`` on the unit circle.
    """
    first = eyes / np.linalg.norm(eyes, axis=1, keepdims=True)
    second = points - (points * first).sum(axis=1, keepdims=True) * first
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    a = np.linalg.norm(eyes, axis=1).astype(complex)
    b = (points * first).sum(axis=1) + 1j * (points * second).sum(axis=1)
    leading = np.conj(a * b)
    companion = np.zeros((len(a), 4, 4), complex)
    companion[:, 0, 0] = np.conj(a + b) / leading
    companion[:, 0, 2] = -(a + b) / leading
    companion[:, 0, 3] = a * b / leading
    companion[:, [1, 2, 3], [0, 1, 2]] = 1.0
    roots = np.linalg.eigvals(companion)
    # Of the four the one on the circle at which both are outside: the others are inside the ball, or off the circle.
    heights = np.minimum((np.conj(roots) * a[:, None]).real, (np.conj(roots) * b[:, None]).real) - 1.0
    heights[np.abs(np.abs(roots) - 1.0) > 1e-6] = -np.inf
    best = heights.argmax(axis=1)
    z = np.take_along_axis(roots, best[:, None], axis=1)
    return z.real * first + z.imag * second, np.take_along_axis(heights, best[:, None], axis=1)[:, 0] > 0.0


def placed(camera: Camera, points: np.ndarray) -> np.ndarray:
    """(n, 3) where ``bisector`` says that a unit ball about 0 mirrors points to a camera."""
    ball = Object(shape="sphere", params={"segments": [512, 256]})
    scene = DeviceScene(Scene(camera=camera, objects=(ball,)), launch.resolve_device(None))
    matrix, device = scene.device_from_world, scene.device
    view = camera_view(camera, matrix, whole_image(camera))
    vertices = wp.empty(len(points), dtype=VirtualVertex, device=device)
    places = BisectorPlaces(view, texture_of(scene, 0, wider(camera, 1.0)), Stats())
    places(wp.array(points @ matrix[:3, :3].T + matrix[:3, 3], dtype=wp.vec3d, device=device), vertices)
    back = np.linalg.inv(matrix)
    return np.asarray(vertices.numpy()["point"] @ back[:3, :3].T + back[:3, 3])


def in_texels(camera: Camera, positions: np.ndarray) -> np.ndarray:
    """(n, 2) where a square camera that looks at 0 sees positions, from the middle of its picture."""
    eye = np.array(camera.eye)
    forward = -eye / np.linalg.norm(eye)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    way = positions - eye
    across = np.stack([way @ right, way @ np.cross(forward, right)], axis=1) / (way @ forward)[:, None]
    return np.asarray(across * (camera.height / 2 / np.tan(np.radians(camera.fov_y / 2))))


def _texels_off(eyes: int, points: int) -> tuple[np.ndarray, np.ndarray]:
    """(texels between where points are found and where they are, degrees of incidence), of those that are mirrored."""
    rng, off, degrees = np.random.default_rng(7), [], []
    for _ in range(eyes):
        eye = rng.normal(size=3)
        eye *= rng.uniform(1.5, 6.0) / np.linalg.norm(eye)
        distance = float(np.linalg.norm(eye))
        fov = float(np.degrees(2.0 * np.arcsin(1.0 / distance)) * 1.1)
        camera = Camera(eye=tuple(eye.tolist()), look_at=(0.0, 0.0, 0.0), fov_y=fov, width=SIDE, height=SIDE)
        directions = rng.normal(size=(points, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        targets = directions * rng.uniform(1.05, 6.0, (points, 1))
        true, is_seen = alhazen(np.broadcast_to(eye, targets.shape), targets)
        found = placed(camera, targets)
        both = in_texels(camera, true), in_texels(camera, found)
        off.append(np.abs(both[0] - both[1]).max(axis=1)[is_seen])
        cosine = ((eye - true) * true).sum(axis=1) / np.linalg.norm(eye - true, axis=1)
        degrees.append(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))[is_seen])
    return np.concatenate(off), np.concatenate(degrees)


def _against_alhazen(quick: bool) -> Table:
    off, degrees = _texels_off(5 if quick else 2 * EYES, POINTS)
    rows: list[list[Cell]] = []
    parts = {"all": degrees >= 0.0, f"up to {STEEPEST:g} degrees": degrees <= STEEPEST}
    parts[f"beyond {STEEPEST:g} degrees"] = degrees > STEEPEST
    for name, chosen in parts.items():
        those = off[chosen]
        quantiles = [float(each) for each in np.percentile(those, [50, 99, 99.9, 100])]
        rows.append([name, len(those), float(100.0 * (those <= 1.0).mean()), *quantiles])
    text = (
        "`bisector` places points that a ball mirrors, from random eyes, in textures of "
        f"{SIDE} x {SIDE} texels that the ball fills. Truth is the root of Alhazen's quartic. Counted is the larger of "
        "columns and rows between the two, in texels of the textures, of the points that are mirrored, by the angle of "
        "incidence there."
    )
    columns = ["incidence", "points", "within a texel, %", "texels off: median", "99%", "99.9%", "most"]
    return Table("What ours adds: `bisector` against Alhazen's quartic", "", text, columns, rows)


def _won_back(quick: bool) -> Table:
    rows: list[list[Cell]] = []
    for name, most in COARSE.items():
        full_levels = QUICK_LEVELS if quick else most
        full, none = picture(name, quick, 0.0, full_levels), picture(name, quick, 1.0, 0)
        lost = full.ssim - none.ssim
        for levels, threshold in ((full_levels, DEFAULT), (DEFAULT_LEVELS, DEFAULT), (DEFAULT_LEVELS, FINER)):
            for crack_free in (False, True):
                found = picture(name, quick, threshold, levels, crack_free)
                won, is_less = found.ssim - none.ssim, found.vertices < full.vertices
                rule = "crack-free" if crack_free else "the paper's"
                ssims = [none.ssim, found.ssim, full.ssim, won / lost if lost > 0.0 else None]
                verdict = "within" if won >= WON_BACK * lost and is_less else "**beyond**"
                vertices = [none.vertices, found.vertices, full.vertices]
                rows.append([name, full_levels, levels, f"{threshold:g}", rule, *ssims, *vertices, verdict])
    text = (
        "None is `bisector`, full divides all triangles, adaptive is `tessellation`, which has "
        f"{DEFAULT_LEVELS} levels and threshold {DEFAULT:g} if nothing is said. Of the SSIM between none and full "
        f"adaptive is to win back {WON_BACK:g}, with fewer vertices than full: 1 is all, and above 1 it is better than "
        "full. More levels of full would take minutes. Crack-free, a round divides less, and more rounds are needed."
    )
    columns = ["scene", "levels of full", "of adaptive", "threshold", "rule", "SSIM: none", "adaptive", "full"]
    columns += ["won back", "vertices: none", "adaptive", "full", ""]
    return Table("What ours adds: what adaptive tessellation wins back", "", text, columns, rows)


def _holes(quick: bool) -> Table:
    rows: list[list[Cell]] = []
    for name in COARSE:
        for threshold in (HOLES_AT, DEFAULT):
            pair = [picture(name, quick, threshold, DEFAULT_LEVELS, crack_free) for crack_free in (False, True)]
            rows.append([name, f"{threshold:g}", *(each.holes for each in pair), *(each.vertices for each in pair)])
    text = (
        "Pixels of the mirror that show what is behind an object in its place, while the object is seen on both sides "
        f"of them; up to {DEFAULT_LEVELS} levels."
    )
    columns = [
        "scene",
        "threshold",
        "holes: the paper's rule",
        "crack-free",
        "vertices: the paper's rule",
        "crack-free",
    ]
    return Table("What ours adds: no holes between triangles", "", text, columns, rows)
