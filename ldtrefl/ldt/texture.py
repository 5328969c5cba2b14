"""``LayeredDepthTexture``: an object's maps on the host side, and ``peel``, which makes them from a mesh."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import warp as wp
from pydantic import BeforeValidator, Field, PlainValidator, TypeAdapter, ValidationError

from ldtrefl.base.checked import plain
from ldtrefl.base.errors import InputError, first_fault, unknown_name
from ldtrefl.device import launch
from ldtrefl.files.atomic_write import written_whole
from ldtrefl.files.fingerprint import fingerprint
from ldtrefl.files.map_cache import current_cache, key_of
from ldtrefl.files.map_file import Entry
from ldtrefl.files.npz import read_arrays
from ldtrefl.ldt.exact.check import check_tree
from ldtrefl.ldt.exact.items import tree_of
from ldtrefl.ldt.exact.record_choice import Quality
from ldtrefl.ldt.exact.tree import Tree
from ldtrefl.ldt.exact.walk import GRAZING
from ldtrefl.ldt.fragments import ONE_A_TEXEL, LdtView
from ldtrefl.ldt.peel import Maps, Rasteriser, check_fragments, check_order, sort_fragments, sorted_maps
from ldtrefl.ldt.searches import TRACERS
from ldtrefl.ldt.texel_frame import FACE_NAMES, TexelFrame, texel_frame
from ldtrefl.scene.mesh import Mesh
from ldtrefl.tracing.batch import Hits, occluded_batch, trace_batch, trace_in_unit_space
from ldtrefl.tracing.tracer import array_of_views
from ldtrefl.world.device_mesh import DeviceMesh

FORMAT = 1
"""Of saved files; goes up when what they hold changes."""

SAVED = {
    "format": (np.int64, ()),
    "vertices": (np.float64, (None, 3)),
    "faces": (np.int32, (None, 3)),
    "normals": (np.float32, (None, 3)),
    "size": (np.int64, (3,)),
    "scale": (np.float64, ()),
    "offset": (np.float64, (3,)),
    "start": (np.int32, (None,)),
    "depth": (np.float32, (None,)),
    "reference": (np.int32, (None,)),
}
"""The arrays of a saved file: type and shape, None where any number will do."""

FEWEST_TEXELS, MOST_TEXELS = 16, 4096
"""Along an object's longest side."""
LARGEST = 1e30
"""Of a scale and an offset that are read: they are handed to kernels as float32."""

DEFAULT_RESOLUTION = 256
"""Texels along an object's longest side."""

DEFAULT_SEARCH = "exact"
DEFAULT_QUALITY: Quality = "balanced"

TEXEL: Literal["texel"] = "texel"
"""The default of ``linear_steps``: one sample for each texel that the ray passes, and no fewer than ``resolution``."""

MOST_LINEAR_STEPS, MOST_BINARY_STEPS = 100_000, 64

BINARY_STEPS = 8
"""Default of ``binary_steps``: a texel's step is halved to less than a hundredth."""

WORTH_KEEPING = 10_000
"""Triangles from which maps are kept on disk: fewer are peeled in the time of reading."""

RAYS_ALL_AROUND = 4096
FEW_BACKS = 2
"""Of so many rays so few may meet a back in a closed mesh that is wound one way: one in 100,000 slips through."""

Resolution = Annotated[int, BeforeValidator(plain), Field(strict=True, ge=FEWEST_TEXELS, le=MOST_TEXELS)]
"""The one definition for Python, methods and the command line."""


def _linear_steps(value: Any) -> Any:
    value = plain(value)
    if value != TEXEL and (type(value) is not int or not 1 <= value <= MOST_LINEAR_STEPS):
        raise ValueError(f"should be '{TEXEL}' or a whole number from 1 to {MOST_LINEAR_STEPS}, got {value!r:.60}")
    return value


LinearSteps = Annotated[int | Literal["texel"], PlainValidator(_linear_steps)]
"""Samples of the linear search on a ray's way through the box: so many, or one for each texel (``march_linear.py``)."""

BinarySteps = Annotated[int, BeforeValidator(plain), Field(strict=True, ge=0, le=MOST_BINARY_STEPS)]
"""Bisections of the step that crosses a surface."""

_RESOLUTION: TypeAdapter[int] = TypeAdapter(Resolution)
_QUALITY = TypeAdapter(Quality)
_LINEAR_STEPS: TypeAdapter[int | str] = TypeAdapter(LinearSteps)
_BINARY_STEPS: TypeAdapter[int] = TypeAdapter(BinarySteps)


def _checked(name: str, adapter: TypeAdapter[Any], value: Any) -> Any:
    """``value`` as the adapter gives it.

    Raises:
        InputError: it is not allowed; the message names it.
    """
    try:
        return adapter.validate_python(value)
    except ValidationError as error:
        raise first_fault(error, {}).within(name) from None


class LayeredDepthTexture:
    """An object's surfaces in six orthographic maps (Zhang, Hsieh and Shen, section 3.3); see ``fragments.py``.

    Made by :func:`ldtrefl.peel`. Object space is the object's own vertex coordinates. The sorted maps and the
    tree over them (``tree.py``) are each made when they are first asked for.
    """

    def __init__(
        self, geometry: DeviceMesh, frame: TexelFrame, quality: Quality = DEFAULT_QUALITY, trusted: bool = False
    ) -> None:
        self.geometry = geometry
        self.frame = frame
        self.quality: Quality = quality
        self.trusted = trusted
        """Whether the texels are smaller than what can be seen, so that patches need no check."""
        self.from_cache = False
        """Whether what was asked for last came from the cache in use (``cache.py``)."""

    @functools.cached_property
    def _rasteriser(self) -> Rasteriser:
        return Rasteriser(self.geometry, self.frame)

    @functools.cached_property
    def _maps(self) -> Maps:
        return self._kept("maps", self._make_maps, self._read_maps)

    def _read_maps(self, entry: Entry) -> Maps:
        check_fragments(self.frame, len(self.geometry.faces), entry.arrays)
        check_order(entry.arrays)
        return Maps.unpacked(self.frame, entry.arrays, self.geometry.vertices.device)

    def _make_maps(self) -> Maps:
        return sort_fragments(self.frame, self._rasteriser.fragments())

    @functools.cached_property
    def tree(self) -> Tree:
        """The tree that the exact search goes down."""
        return self._kept("tree", self._make_tree, self._read_tree)

    def _read_tree(self, entry: Entry) -> Tree:
        check_tree(entry.arrays, entry.values, len(self.geometry.faces))
        return Tree.unpacked(entry.arrays, entry.values, self.geometry)

    def _make_tree(self) -> Tree:
        made = tree_of(self.geometry, self.resolution, self.quality, trusted=self.trusted)
        if made.view.front != 0.0 and _shows_backs(made):
            made.view.front = 0.0
        return made

    def _kept(self, kind: str, make: Callable[[], Any], read: Callable[[Entry], Any]) -> Any:
        """What the cache in use has, or else what is made now, and then kept there."""
        cache, mesh = current_cache(), self.geometry.mesh
        if cache is None or len(mesh.faces) < WORTH_KEEPING:
            return make()
        options = {"kind": kind, "resolution": self.resolution, "quality": self.quality, "trusted": self.trusted}
        key = key_of(mesh.surface_key, {**options, "algorithm": fingerprint("ldt.texture")})
        kept = cache.load_as(key, read)
        self.from_cache = kept is not None
        if kept is not None:
            return kept
        made = make()
        cache.store(key, *made.packed())
        return made

    @property
    def start(self) -> wp.array:
        """(texels + 1,) int32: first fragment of each texel, the three axes' maps in a row; a copy."""
        return wp.clone(self._maps.start)

    @property
    def depth(self) -> wp.array:
        """(fragments,) float32, texels along the map's axis, sorted in each texel; a copy."""
        return wp.clone(self._maps.depth)

    @property
    def reference(self) -> wp.array:
        """(fragments,) int32: triangle times 2, plus 1 if it faces up the axis; a copy."""
        return wp.clone(self._maps.reference)

    @property
    def resolution(self) -> int:
        """Texels along the object's longest side."""
        return max(self.frame.size)

    @property
    def fragment_count(self) -> int:
        """Fragments in the three maps; each serves two faces."""
        return self._maps.depth.size if "_maps" in self.__dict__ else self._rasteriser.count

    @property
    def record_count(self) -> int:
        """Fragments in the maps and records in the tree, of what is made so far."""
        fragments = self.fragment_count if "_maps" in self.__dict__ else 0
        return fragments + (self.tree.records if "tree" in self.__dict__ else 0)

    @property
    def nbytes(self) -> int:
        """Bytes that the maps and the tree take so far, the mesh not counted."""
        maps = self._maps.nbytes if "_maps" in self.__dict__ else 0
        return maps + (self.tree.nbytes if "tree" in self.__dict__ else 0)

    def counts(self, axis: int) -> np.ndarray:
        """(rows, columns) int32: fragments per texel of the map of ``axis``."""
        rows, columns = self.frame.map_shape(axis)
        first = self.frame.first_texels
        return np.diff(self._maps.start.numpy()[first[axis] : first[axis + 1] + 1]).reshape(rows, columns)

    def layers(self) -> dict[str, int]:
        """Per face, the most surfaces that face it over one texel: the layers that depth peeling would draw."""
        starts = self._maps.start.numpy()
        first = self.frame.first_texels
        upwards = np.concatenate([[0], np.cumsum(self._maps.reference.numpy() & 1)])
        rising = upwards[starts[1:]] - upwards[starts[:-1]]
        total = np.diff(starts)
        layers = {}
        for face, name in enumerate(FACE_NAMES):
            span = slice(first[face // 2], first[face // 2 + 1])
            seen = rising[span] if face % 2 == 0 else total[span] - rising[span]
            layers[name] = int(seen.max(initial=0))
        return layers

    def crossings(self) -> dict[str, int]:
        """Per axis, the most surfaces over one texel."""
        return {name: int(self.counts(axis).max(initial=0)) for axis, name in enumerate("xyz")}

    def view(
        self, search: str = DEFAULT_SEARCH, *, linear_steps: LinearSteps = TEXEL, binary_steps: int = BINARY_STEPS
    ) -> Any:
        """What kernels read for a search: a ``TreeView`` for ``"exact"``, an ``LdtView`` for ``"linear"``.

        Raises:
            InputError: an unknown search, or a number of steps that is not allowed.
        """
        if search not in TRACERS:
            raise unknown_name("search", search, TRACERS)
        if search == "exact":
            return self.tree.view
        view = LdtView()
        view.start, view.depth, view.reference = self._maps.start, self._maps.depth, self._maps.reference
        self._maps.occupancy.show_in(view)
        view.size = wp.vec3i(*self.frame.size)
        view.first_texel = wp.vec3i(*self.frame.first_texels[:3])
        view.texels_per_unit = self.frame.scale
        view.texel_offset = wp.vec3(*self.frame.offset)
        view.vertices, view.faces = self.geometry.vertices, self.geometry.faces
        steps = _checked("linear_steps", _LINEAR_STEPS, linear_steps)
        view.linear_steps = ONE_A_TEXEL if steps == TEXEL else steps
        view.binary_steps = _checked("binary_steps", _BINARY_STEPS, binary_steps)
        return view

    def trace(
        self,
        origins: Any,
        directions: Any,
        t_max: Any = None,
        *,
        search: str = DEFAULT_SEARCH,
        linear_steps: LinearSteps = TEXEL,
        binary_steps: int = BINARY_STEPS,
    ) -> Hits:
        """First hits of rays given in object space.

        Args:
            origins: (..., 3) float32 numpy or Warp array.
            directions: (..., 3) float32, any length; ``t`` is in lengths of it.
            t_max: hits before this count; a number, or (...), one a ray; ``None``: all.
            search: ``"exact"``, a walk down the tree, or ``"linear"``, the paper's.
            linear_steps: of the linear search: ``"texel"``, one sample for each texel passed, or 1 to 100,000 samples.
            binary_steps: of the linear search: 0 to 64 bisections.

        Raises:
            InputError: shapes that do not fit, what is not a number, an unknown search, or a number of steps that is
                not allowed.
        """
        views = self._views(search, linear_steps, binary_steps)
        return trace_batch(TRACERS[search], views, self.geometry, origins, directions, t_max)

    def occluded(
        self,
        origins: Any,
        directions: Any,
        t_max: Any = None,
        *,
        search: str = DEFAULT_SEARCH,
        linear_steps: LinearSteps = TEXEL,
        binary_steps: int = BINARY_STEPS,
    ) -> Any:
        """(...) bool: whether rays meet the object at all; arguments and errors as :meth:`trace` has them."""
        views = self._views(search, linear_steps, binary_steps)
        return occluded_batch(TRACERS[search], views, self.geometry, origins, directions, t_max)

    def _views(self, search: str, linear_steps: LinearSteps, binary_steps: int) -> wp.array:
        """:meth:`view` as kernels read it; what it points to is owned by these maps."""
        view = self.view(search, linear_steps=linear_steps, binary_steps=binary_steps)
        return array_of_views([view], TRACERS[search].view, self.geometry.vertices.device)

    def save(self, path: str | Path) -> None:
        """Write the maps and their mesh to one file, whole or not at all.

        Raises:
            InputError: the file cannot be written.
        """
        arrays = {
            "format": np.int64(FORMAT),
            "vertices": self.geometry.mesh.vertices,
            "faces": self.geometry.mesh.faces,
            "normals": self.geometry.mesh.normals,
            "size": np.array(self.frame.size),
            "scale": np.float64(self.frame.scale),
            "offset": np.array(self.frame.offset),
            "start": self._maps.start.numpy(),
            "depth": self._maps.depth.numpy(),
            "reference": self._maps.reference.numpy(),
        }
        with written_whole(path) as scratch, scratch.open("wb") as file:
            np.savez(file, **arrays)

    @classmethod
    def load(cls, path: str | Path, device: str | None = None) -> LayeredDepthTexture:
        """Read what :meth:`save` wrote.

        Raises:
            InputError: the file is missing, damaged, of another format, or larger than the memory allowed.
        """
        target = launch.resolve_device(device)
        try:
            arrays = read_arrays(path, SAVED)
            if arrays["format"] != FORMAT:
                raise InputError(f"format {arrays['format']}, this version reads {FORMAT}")
            mesh, frame = _mesh_and_frame(arrays)
            check_fragments(frame, len(mesh.faces), arrays)
        except (ValueError, KeyError) as error:  # an InputError is a ValueError
            raise InputError(f"{path}: not a layered depth texture that can be read ({error})") from None
        loaded = cls(DeviceMesh(mesh, target), frame)
        loaded._maps = sorted_maps(
            frame,
            wp.array(arrays["start"], dtype=wp.int32, device=target),
            wp.array(arrays["depth"], dtype=wp.float32, device=target),
            wp.array(arrays["reference"], dtype=wp.int32, device=target),
        )
        return loaded


def _mesh_and_frame(arrays: dict[str, np.ndarray]) -> tuple[Mesh, TexelFrame]:
    """What the arrays of a saved file say of the mesh and of its box of texels.

    Raises:
        ValueError: it cannot be.
    """
    mesh = Mesh(arrays["vertices"], arrays["faces"], arrays["normals"])
    x, y, z = (int(n) for n in arrays["size"])
    scale, offset = float(arrays["scale"]), arrays["offset"]
    if not (min(x, y, z) >= 1 and max(x, y, z) <= MOST_TEXELS):
        raise ValueError(f"{x} x {y} x {z} texels, 1 to {MOST_TEXELS} allowed")
    if not (np.isfinite(arrays["normals"]).all() and 0.0 < scale < LARGEST and (np.abs(offset) < LARGEST).all()):
        raise ValueError("a normal, the scale or the offset is not finite")
    return mesh, TexelFrame((x, y, z), scale, (float(offset[0]), float(offset[1]), float(offset[2])))


def _shows_backs(tree: Tree) -> bool:
    """Whether rays from all around meet backs of a surface that is closed as a whole: a part is wound the other way."""
    device = tree.view.vertices.device
    origins, directions = _rays_all_around(str(device))
    views = array_of_views([tree.view], TRACERS["exact"].view, device)
    hits = trace_in_unit_space(TRACERS["exact"], views, origins, directions)
    towards = (hits.normal * directions.numpy()).sum(axis=1)
    return int((tree.view.front * towards > GRAZING).sum()) > FEW_BACKS


@functools.cache
def _rays_all_around(device: str) -> tuple[wp.array, wp.array]:
    """(n,) vec3 origins on a sphere about the unit cube and unit directions into it."""
    rng = np.random.default_rng(0)
    origins = rng.normal(size=(RAYS_ALL_AROUND, 3))
    origins *= 4.0 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-1.0, 1.0, (RAYS_ALL_AROUND, 3)) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return wp.array(origins, dtype=wp.vec3, device=device), wp.array(directions, dtype=wp.vec3, device=device)


def peel(
    vertices: Any,
    faces: Any,
    resolution: int = DEFAULT_RESOLUTION,
    device: str | None = None,
    *,
    quality: Quality = DEFAULT_QUALITY,
    search: str = DEFAULT_SEARCH,
) -> LayeredDepthTexture:
    """Peel a triangle mesh into a layered depth texture.

    Args:
        vertices: (n, 3) numbers, object space.
        faces: (m, 3) vertex numbers.
        resolution: texels along the longest side of the bounding box, 16 to 4096.
        device: 'cpu' (default) or a CUDA device.
        quality: of the exact search: ``"exact"`` tests every triangle; ``"balanced"`` does so unless they are much
            finer than texels; ``"fast"`` tests texels.
        search: what the maps are made ready for now; another search makes what it needs when it is first used.

    Raises:
        InputError: an empty mesh, an index out of range, a vertex that is not finite, a value not allowed.
    """
    geometry = DeviceMesh(Mesh(vertices, faces), launch.resolve_device(device))
    return peel_mesh(geometry, resolution, quality=quality, search=search)


def peel_mesh(
    geometry: DeviceMesh,
    resolution: int = DEFAULT_RESOLUTION,
    *,
    quality: Quality = DEFAULT_QUALITY,
    search: str = DEFAULT_SEARCH,
    trusted: bool = False,
) -> LayeredDepthTexture:
    """:func:`peel` for a mesh that is on a device already; ``trusted`` if the resolution is finer than what is seen."""
    _checked("resolution", _RESOLUTION, resolution)
    _checked("quality", _QUALITY, quality)
    maps = LayeredDepthTexture(geometry, texel_frame(geometry.mesh, int(resolution)), quality, trusted)
    maps.view(search)
    return maps
