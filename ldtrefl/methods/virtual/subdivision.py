"""Triangles taken to pieces where a mirror bends them: A. Szabo, "Adaptive Tessellation in Screen Space Curved
Reflections" (2013), section 4.2.

What a mirror shows of an edge is drawn straight, between the reflection points of its ends. The *error* of an edge is
how far that is from the truth in its middle: there, on the reflector, the normal should be the bisector b of the ways
to the eye and to the edge's middle, and the error is ``1 - (N . b + 1) / 2``, from 0 to 1. Pieces are divided in rounds
those of the round before, until no error is above a threshold or the rounds are used up.

By the paper's rule a triangle with an edge that is not good enough is divided into four. Its neighbour, if it is good
enough, is not: between them a hole opens (its Fig. 10a). *Crack-free*, an edge is divided or not by its own error,
which both neighbours see alike, and a triangle is divided into two, three or four by which of its edges are.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.base import budget
from ldtrefl.device import launch
from ldtrefl.device.bins import CHUNK
from ldtrefl.device.stats import Stats
from ldtrefl.frame.projection import chunks_of
from ldtrefl.methods.virtual.image import VERTEX_BYTES, DrawnMeshes, PlaceVertices
from ldtrefl.methods.virtual.raster import Piece, in_pixels
from ldtrefl.methods.virtual.vertex import VirtualVertex
from ldtrefl.world.camera import CameraView
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import ObjectRecord

PIECE_BYTES = 56
"""Bytes of a piece and of its errors."""

LEAST_LENGTH = wp.constant(1.0)
"""Pixels: an edge that is shorter in the image has no error. Else fine meshes would be divided for nothing where what
is reflected ends."""

SMALLER = "levels, or a larger threshold"
"""What an error names for the user to change."""


@wp.struct
class SurfacePoint:
    """A point of a reflector."""

    position: wp.vec3d
    normal: wp.vec3d  # unit, facing the eye
    is_known: int  # 0 if the reflector is not there


@dataclass(frozen=True)
class Subdivision:
    """How triangles are taken to pieces."""

    threshold: float
    """Edges whose error is less are good enough: 0 divides all, 1 none."""
    levels: int
    """Rounds, at most."""
    crack_free: bool
    """Whether edges are divided each by its own error."""


@wp.func
def apart_in_pixels(camera: CameraView, a: wp.vec3d, b: wp.vec3d) -> float:
    """Pixels between two points in the image; +inf if one is not in front of the camera."""
    p, q = in_pixels(camera, a), in_pixels(camera, b)
    if p[2] <= wp.float64(0.0) or q[2] <= wp.float64(0.0):
        return wp.inf
    return float(wp.length(wp.vec2d(p[0] / p[2] - q[0] / q[2], p[1] / p[2] - q[1] / q[2])))


@launch.once
def edge_errors_kernel(reflector: type, surface_at: Callable[..., SurfacePoint]) -> wp.Kernel:
    """The kernel that finds the errors of pieces' edges. ``surface_at(reflector, camera, point)`` is the reflector's
    point that the eye sees in the direction of a point."""

    @wp.func
    def edge_error(
        camera: CameraView, mirror: reflector, a: VirtualVertex, b: VirtualVertex, from_a: wp.vec3d, from_b: wp.vec3d
    ) -> float:
        if apart_in_pixels(camera, a.position, b.position) < LEAST_LENGTH:
            return 0.0
        if a.is_seen != b.is_seen:
            return 1.0  # the border of what is reflected lies between
        half = wp.float64(0.5)
        there = surface_at(mirror, camera, half * (a.point + b.point))
        if a.is_seen != 1 or there.is_known == 0:
            return 0.0
        view = wp.normalize(camera.eye - there.position)
        onwards = wp.normalize(half * (from_a + from_b) - there.position)
        return float(half * (wp.float64(1.0) - wp.dot(there.normal, wp.normalize(view + onwards))))

    @launch.kernel
    def edge_errors(
        first: int,
        # In:
        camera: CameraView,
        mirror: reflector,
        pieces: wp.array(dtype=Piece),
        points: wp.array(dtype=wp.vec3d),
        vertices: wp.array(dtype=VirtualVertex),
        # Out:
        error_out: wp.array(dtype=wp.vec3),  # of the edges from corner 0 to 1, 1 to 2, 2 to 0
    ):
        """Find the errors of the edges of one piece."""
        i = first + wp.tid()
        a, b, c = pieces[i].vertices[0], pieces[i].vertices[1], pieces[i].vertices[2]
        error_out[i] = wp.vec3(
            edge_error(camera, mirror, vertices[a], vertices[b], points[a], points[b]),
            edge_error(camera, mirror, vertices[b], vertices[c], points[b], points[c]),
            edge_error(camera, mirror, vertices[c], vertices[a], points[c], points[a]),
        )

    return edge_errors


@launch.kernel
def find_pieces(
    first: int,
    # In:
    chunks: wp.array(dtype=wp.vec2i),  # ``chunks_of`` triangles
    numbers: wp.array(dtype=wp.int32),
    first_vertex: wp.array(dtype=wp.int32),
    first_piece: wp.array(dtype=wp.int32),
    objects: wp.array(dtype=ObjectRecord),
    # Out:
    pieces_out: wp.array(dtype=Piece),
):
    """Make a piece of each whole triangle of one chunk."""
    place, begin = chunks[first + wp.tid()][0], chunks[first + wp.tid()][1]
    k = numbers[place]
    for i in range(begin, wp.min(begin + CHUNK, objects[k].faces.shape[0])):
        face, base = objects[k].faces[i], first_vertex[place]
        piece = Piece()
        piece.object = k
        piece.triangle = i
        piece.vertices = wp.vec3i(base + face[0], base + face[1], base + face[2])
        piece.b = wp.vec2(1.0, 0.0)
        piece.c = wp.vec2(0.0, 1.0)
        pieces_out[first_piece[place] + i] = piece


@wp.func
def place_of(piece: Piece, corner: int) -> wp.vec2:
    """Barycentrics of a corner, 0 to 2, in the whole triangle."""
    return wp.where(corner == 0, piece.a, wp.where(corner == 1, piece.b, piece.c))


@wp.func
def between(whole: Piece, a: int, b: int, c: int, at_a: wp.vec2, at_b: wp.vec2, at_c: wp.vec2) -> Piece:
    """The piece of the same triangle between these corners."""
    made = Piece()
    made.object = whole.object
    made.triangle = whole.triangle
    made.vertices = wp.vec3i(a, b, c)
    made.a = at_a
    made.b = at_b
    made.c = at_c
    return made


@launch.kernel
def divide_pieces(
    first: int,
    # In:
    divided: wp.array(dtype=wp.int32),  # numbers of the pieces that are divided
    edges: wp.array(dtype=wp.int32),  # of each of these, a bit for each edge that is divided
    first_child: wp.array(dtype=wp.int32),
    first_middle: wp.array(dtype=wp.int32),
    known: int,  # points
    pieces: wp.array(dtype=Piece),
    points: wp.array(dtype=wp.vec3d),
    # Out:
    children_out: wp.array(dtype=Piece),
    middles_out: wp.array(dtype=wp.vec3d),  # points, numbered from ``known`` on
):
    """Divide one piece at the middles of some of its edges."""
    i = first + wp.tid()
    piece, bits = pieces[divided[i]], int(edges[i])
    # Counted from a corner on, so that edge 0 is divided and, of two, edge 1, too.
    turns = int(0)
    while (bits & 1) == 0 or bits == 5:
        bits = ((bits >> 1) | (bits << 2)) & 7
        turns += 1
    first_corner, second, third = turns % 3, (turns + 1) % 3, (turns + 2) % 3
    a, b, c = piece.vertices[first_corner], piece.vertices[second], piece.vertices[third]
    at_a, at_b, at_c = place_of(piece, first_corner), place_of(piece, second), place_of(piece, third)
    half, child, middle = wp.float64(0.5), first_child[i], first_middle[i]
    middles_out[middle] = half * (points[a] + points[b])
    ab, at_ab = known + middle, 0.5 * (at_a + at_b)
    if bits == 1:
        children_out[child] = between(piece, a, ab, c, at_a, at_ab, at_c)
        children_out[child + 1] = between(piece, ab, b, c, at_ab, at_b, at_c)
    else:
        middles_out[middle + 1] = half * (points[b] + points[c])
        bc, at_bc = known + middle + 1, 0.5 * (at_b + at_c)
        children_out[child] = between(piece, ab, b, bc, at_ab, at_b, at_bc)
        if bits == 3:
            children_out[child + 1] = between(piece, a, ab, bc, at_a, at_ab, at_bc)
            children_out[child + 2] = between(piece, a, bc, c, at_a, at_bc, at_c)
        else:
            middles_out[middle + 2] = half * (points[c] + points[a])
            ca, at_ca = known + middle + 2, 0.5 * (at_c + at_a)
            children_out[child + 1] = between(piece, a, ab, ca, at_a, at_ab, at_ca)
            children_out[child + 2] = between(piece, ab, bc, ca, at_ab, at_bc, at_ca)
            children_out[child + 3] = between(piece, bc, c, ca, at_bc, at_c, at_ca)


FindErrors = Callable[[wp.array, wp.array, wp.array], wp.array]
"""``(pieces, points, vertices)`` -> (n,) vec3 errors of the pieces' edges."""


@dataclass(frozen=True, eq=False)
class Subdivider:
    """Takes the triangles of meshes to pieces, for one mirror."""

    scene: DeviceScene
    rule: Subdivision
    place: PlaceVertices
    errors: FindErrors
    stats: Stats

    def __call__(self, meshes: DrawnMeshes) -> tuple[wp.array, wp.array]:
        """((n,) ``Piece``, (m,) ``VirtualVertex``) of all triangles.

        Raises:
            InputError: the pieces need more memory than is allowed.
        """
        points, device = meshes.points(self.scene), self.scene.device
        vertices = self._placed(points)
        pieces, finished = self._whole(meshes), []
        for _ in range(self.rule.levels):
            edges = self._divided_edges(self.errors(pieces, points, vertices).numpy())
            divided = np.flatnonzero(edges)
            if not len(divided):
                break
            finished.append(_taken(pieces, np.flatnonzero(edges == 0)))
            middles = np.bitwise_count(edges[divided].astype(np.uint8)).astype(np.int64)
            total = int(middles.sum())
            budget.take(VERTEX_BYTES * total + PIECE_BYTES * (total + len(divided)), "pieces of triangles", SMALLER)
            children = wp.empty(total + len(divided), dtype=Piece, device=device)
            added = wp.empty(total, dtype=wp.vec3d, device=device)
            arrays = [divided, edges[divided], np.cumsum(middles + 1) - middles - 1, np.cumsum(middles) - middles]
            inputs = [wp.array(values.astype(np.int32), dtype=wp.int32, device=device) for values in arrays]
            inputs += [points.shape[0], pieces, points, children, added]
            launch.launch(divide_pieces, len(divided), inputs, device)
            points, vertices = _joined([points, added]), _joined([vertices, self._placed(added)])
            pieces = children
        finished.append(pieces)
        self.stats.count("pieces", sum(part.shape[0] for part in finished))
        return _joined(finished), vertices

    def _placed(self, points: wp.array) -> wp.array:
        vertices = wp.empty(points.shape[0], dtype=VirtualVertex, device=self.scene.device)
        self.place(points, vertices)
        return vertices

    def _whole(self, meshes: DrawnMeshes) -> wp.array:
        """(triangles,) ``Piece``: all triangles as they are."""
        scene, device = self.scene, self.scene.device
        counts = scene.triangle_counts[meshes.numbers]
        budget.take(PIECE_BYTES * int(counts.sum()), "pieces of triangles", "the number of triangles")
        pieces = wp.empty(int(counts.sum()), dtype=Piece, device=device)
        arrays = (meshes.numbers, meshes.first_vertex, (np.cumsum(counts) - counts).astype(np.int32))
        inputs = [wp.array(values, dtype=wp.int32, device=device) for values in arrays]
        chunks = chunks_of(counts, device)
        launch.launch(find_pieces, chunks.shape[0], [chunks, *inputs, scene.records, pieces], device)
        return pieces

    def _divided_edges(self, errors: np.ndarray) -> np.ndarray:
        """(n,) bits of the edges that are divided, of (n, 3) errors."""
        is_above = (errors >= self.rule.threshold) & (self.rule.threshold < 1.0)
        if not self.rule.crack_free:
            is_above = np.repeat(is_above.any(axis=1, keepdims=True), 3, axis=1)
        return np.asarray(is_above @ np.array([1, 2, 4]))


def _taken(pieces: wp.array, numbers: np.ndarray) -> wp.array:
    """The pieces of these numbers."""
    return wp.array(pieces.numpy()[numbers], dtype=Piece, device=pieces.device)


def _joined(parts: list[wp.array]) -> wp.array:
    """Arrays one after another."""
    return wp.array(np.concatenate([part.numpy() for part in parts]), dtype=parts[0].dtype, device=parts[0].device)
