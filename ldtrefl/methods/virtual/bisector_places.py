"""Virtual vertices by a search in image space for the texel whose normal is nearest to the bisector.

P. Estalella, I. Martin, G. Drettakis, D. Tost, "A GPU-driven algorithm for accurate interactive reflections on curved
objects" (2006): ``methods/bisector.py`` says how.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.geometry.vectors import as_double
from ldtrefl.methods.virtual.image import VirtualImage
from ldtrefl.methods.virtual.raster import in_pixels
from ldtrefl.methods.virtual.reflector_texture import ReflectorTexture, texture_of, wider
from ldtrefl.methods.virtual.subdivision import Subdivider, Subdivision, SurfacePoint, edge_errors_kernel
from ldtrefl.methods.virtual.texel_search import search_texel
from ldtrefl.methods.virtual.vertex import HIDDEN, VirtualVertex, unfolded
from ldtrefl.world.camera import CameraView


@launch.kernel
def search_vertices(
    first: int,
    # In:
    camera: CameraView,
    texture: ReflectorTexture,
    points: wp.array(dtype=wp.vec3d),
    starts: wp.array(dtype=wp.int32),  # the texel that the search of each begins at; empty: the middle
    # Out:
    vertices_out: wp.array(dtype=VirtualVertex),
    texel_out: wp.array(dtype=wp.int32),
    steps_out: wp.array(dtype=wp.int32),
):
    """Search for where the reflector shows one point."""
    i = first + wp.tid()
    vertex, start = points[i], int(texture.start)
    if starts.shape[0] > 0:
        if texture.object[starts[i]] >= 0:
            start = starts[i]
    found = search_texel(texture, start, camera.eye, vertex)
    texel_out[i] = found.texel
    steps_out[i] = found.steps
    point, normal = texture.position[found.texel], as_double(texture.normal[found.texel])
    height = wp.dot(vertex - point, normal)
    made = unfolded(camera.eye, point, vertex, wp.dot(point - camera.eye, camera.forward))
    if height <= wp.float64(0.0) and made.is_seen != 0:
        # Equation 1, mirrored: the vertex whose virtual image this one would be.
        made.position = vertex - wp.float64(2.0) * height * normal
        made.is_seen = HIDDEN
    vertices_out[i] = made


@wp.func
def texel_towards(texture: ReflectorTexture, camera: CameraView, point: wp.vec3d) -> SurfacePoint:
    """What a texture shows in the direction of a point from the eye."""
    found, at = SurfacePoint(), in_pixels(texture.camera, point)
    if at[2] > wp.float64(0.0):
        x, y = at[0] / at[2], at[1] / at[2]
        if x >= wp.float64(0.0) and y >= wp.float64(0.0):
            if x < wp.float64(texture.width) and y < wp.float64(texture.height):
                texel = int(y) * texture.width + int(x)
                if texture.object[texel] >= 0:
                    found.position = texture.position[texel]
                    found.normal = as_double(texture.normal[texel])
                    found.is_known = 1
    return found


@dataclass(frozen=True)
class TextureView:
    """The view in which reflectors are searched."""

    widening: float
    """How many times as wide as the image."""
    fineness: float
    """Texels along a pixel."""


@dataclass(frozen=True, eq=False)
class BisectorPlaces:
    """Places vertices where one reflector shows them."""

    camera: CameraView
    """The image's."""
    texture: ReflectorTexture
    stats: Stats
    before: wp.array | None = None
    """(n,) int32: the texels at which searches begin, of calls with as many points."""
    found: list[wp.array] = field(default_factory=list)
    """(n,) int32 of each call: the texels that its points were found at."""

    def __call__(self, points: wp.array, vertices: wp.array) -> None:
        """Fill in the virtual vertices of (n,) vec3d points."""
        count, device = points.shape[0], points.device
        texels, steps = (wp.zeros(count, dtype=wp.int32, device=device) for _ in range(2))
        starts = wp.empty(0, dtype=wp.int32, device=device)
        if self.before is not None and self.before.shape[0] == count:
            starts = self.before
        inputs = [self.camera, self.texture, points, starts, vertices, texels, steps]
        launch.launch(search_vertices, count, inputs, device)
        self.found.append(texels)
        self.stats.count("vertices", count)
        self.stats.count("steps", int(steps.numpy().sum()))

    def errors(self, pieces: wp.array, points: wp.array, vertices: wp.array) -> wp.array:
        """(n,) vec3: the errors of the edges of (n,) pieces."""
        errors = wp.empty(pieces.shape[0], dtype=wp.vec3, device=pieces.device)
        kernel = edge_errors_kernel(ReflectorTexture, texel_towards)
        inputs = [self.camera, self.texture, pieces, points, vertices, errors]
        launch.launch(kernel, pieces.shape[0], inputs, pieces.device)
        return errors


Texels = dict[int, tuple[tuple[int, int], wp.array]]
"""By number of a reflector: height and width of its textures, and the texels that vertices were found at."""


def draw_bisected(
    image: VirtualImage,
    gbuffer: GBuffer,
    search: TextureView,
    rule: Subdivision,
    stats: Stats,
    texels: Texels | None = None,
) -> None:
    """Search for the vertices of all objects in each reflector that is seen, and draw them there.

    Args:
        image: where they are drawn.
        gbuffer: what the camera sees.
        search: the view in which reflectors are searched.
        rule: how triangles are first taken to pieces; not at all if it has no levels.
        stats: counts vertices, steps and pieces.
        texels: where searches begin, those of the frame before; replaced by where they end. None: in the middle.

    Raises:
        InputError: vertices or pieces need more memory than is allowed.
    """
    scene, view = gbuffer.scene, wider(gbuffer.camera, search.widening, search.fineness)
    for reflector in image.reflectors:
        texture = texture_of(scene, reflector, view)
        if texture.start < 0:
            continue
        size, known = (view.height, view.width), (texels or {}).get(reflector)
        before = known[1] if known is not None and known[0] == size else None
        places = BisectorPlaces(gbuffer.view.camera, texture, stats, before)
        if rule.levels:
            image.draw_pieces(reflector, Subdivider(scene, rule, places, places.errors, stats))
        else:
            image.draw(reflector, places)
        if texels is not None and places.found:
            texels[reflector] = size, places.found[0]
