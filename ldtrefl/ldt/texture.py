"""``LayeredDepthTexture``: the maps of an object and the tree over them, each made when it is first asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Protocol, TypeVar, cast

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from ldtrefl.base.errors import unknown_name
from ldtrefl.device import launch
from ldtrefl.files.fingerprint import fingerprint
from ldtrefl.files.map_cache import current_cache, key_of
from ldtrefl.files.map_file import Entry
from ldtrefl.ldt.exact.build import build_tree
from ldtrefl.ldt.exact.tree import Tree, TreeValues, TreeView
from ldtrefl.ldt.exact.tree_check import check_tree
from ldtrefl.ldt.fragments import Rasteriser
from ldtrefl.ldt.maps import ONE_A_TEXEL, Maps, MapsView, check_fragments, check_order
from ldtrefl.ldt.options import (
    BINARY_STEPS,
    DEFAULT_QUALITY,
    DEFAULT_SEARCH,
    TEXEL,
    LinearSteps,
    Quality,
    checked_binary_steps,
    checked_linear_steps,
)
from ldtrefl.ldt.saved_file import read_file, write_file
from ldtrefl.ldt.searches import TRACERS
from ldtrefl.ldt.texel_frame import FACE_NAMES, TexelFrame
from ldtrefl.tracing.batch import Hits, occluded_batch, trace_batch
from ldtrefl.tracing.tracer import array_of_views
from ldtrefl.world.device_mesh import DeviceMesh

WORTH_CACHING = 10_000
"""Triangles from which maps are kept on disk: fewer are peeled in the time of reading."""


class Packable(Protocol):
    """What can be kept in the cache on disk."""

    def packed(self) -> tuple[dict[str, np.ndarray], Mapping[str, object]]:
        """The arrays, and the values, that it can be made from again."""


Made = TypeVar("Made", bound=Packable)


class LayeredDepthTexture:
    """An object's surfaces in six orthographic maps (Zhang, Hsieh and Shen, section 3.3); see ``maps.py``.

    Made by :func:`ldtrefl.peel`. Object space is the object's own vertex coordinates. The sorted maps, which the linear
    search reads, and the tree of the exact search are each made when they are first asked for.
    """

    def __init__(
        self, geometry: DeviceMesh, frame: TexelFrame, quality: Quality = DEFAULT_QUALITY, trusted: bool = False
    ) -> None:
        """A texture of which nothing is made yet.

        Args:
            geometry: the mesh on its device.
            frame: the box of texels about it.
            quality: of the exact search.
            trusted: the texels are smaller than what can be seen, so that patches need no check.
        """
        self.geometry = geometry
        self.frame = frame
        self.quality: Quality = quality
        self.trusted = trusted
        self.from_cache = False
        """Whether what was asked for last came from the cache in use (``files/map_cache.py``)."""
        self._maps: Maps | None = None
        """The sorted maps, once they are made."""
        self._tree: Tree | None = None
        """The tree, once it is made."""
        self._rasteriser: Rasteriser | None = None
        """The mesh in its box of texels, once its fragments are counted."""

    @property
    def sorted_maps(self) -> Maps:
        """The sorted maps that the linear search reads."""
        if self._maps is None:
            self._maps = self._cached_or_made("maps", {}, self._make_maps, self._read_maps)
        return self._maps

    @property
    def tree(self) -> Tree:
        """The tree that the exact search goes down."""
        if self._tree is None:
            choices = {"quality": self.quality, "trusted": self.trusted}
            self._tree = self._cached_or_made("tree", choices, self._make_tree, self._read_tree)
        return self._tree

    def _make_maps(self) -> Maps:
        made = Maps.of(self.frame, self._counted_fragments().fragments())
        self._rasteriser = None  # it holds as much as the maps, and they count their fragments themselves
        return made

    def _read_maps(self, entry: Entry) -> Maps:
        check_fragments(self.frame, len(self.geometry.faces), entry.arrays)
        check_order(entry.arrays)
        return Maps.unpacked(self.frame, entry.arrays, self.geometry.vertices.device)

    def _make_tree(self) -> Tree:
        return build_tree(self.geometry, self.resolution, self.quality, trusted=self.trusted)

    def _read_tree(self, entry: Entry) -> Tree:
        values = cast(TreeValues, entry.values)
        check_tree(entry.arrays, values, len(self.geometry.faces))
        return Tree.unpacked(entry.arrays, values, self.geometry)

    def _counted_fragments(self) -> Rasteriser:
        if self._rasteriser is None:
            self._rasteriser = Rasteriser(self.geometry, self.frame)
        return self._rasteriser

    def _cached_or_made(
        self, kind: str, choices: Mapping[str, object], make: Callable[[], Made], read: Callable[[Entry], Made]
    ) -> Made:
        """What the cache in use has, or else what is made now, and then kept there.

        Args:
            kind: what is made of the mesh.
            choices: what else it depends on, beside the resolution.
            make: makes it.
            read: makes it from what the cache has.
        """
        cache, mesh = current_cache(), self.geometry.mesh
        if cache is None or mesh.is_deformed or len(mesh.faces) < WORTH_CACHING:
            return make()
        options = {"kind": kind, "resolution": self.resolution, "algorithm": fingerprint("ldt.texture")}
        key = key_of(mesh.surface_key, {**options, **choices})
        cached = cache.load_as(key, read)
        self.from_cache = cached is not None
        if cached is not None:
            return cached
        made = make()
        cache.store(key, *made.packed())
        return made

    @property
    def start(self) -> wp.array:
        """(texels + 1,) int32: first fragment of each texel, the three axes' maps in a row; a copy."""
        return wp.clone(self.sorted_maps.start)

    @property
    def depth(self) -> wp.array:
        """(fragments,) float32, texels along the map's axis, sorted in each texel; a copy."""
        return wp.clone(self.sorted_maps.depth)

    @property
    def reference(self) -> wp.array:
        """(fragments,) int32: triangle times 2, plus 1 if it faces up the axis; a copy."""
        return wp.clone(self.sorted_maps.reference)

    @property
    def resolution(self) -> int:
        """Texels along the object's longest side."""
        return max(self.frame.size)

    @property
    def fragment_count(self) -> int:
        """Fragments in the three maps; each serves two faces."""
        return self._counted_fragments().count if self._maps is None else self._maps.depth.size

    @property
    def record_count(self) -> int:
        """Fragments in the maps and records in the tree, of what is made so far."""
        fragments = 0 if self._maps is None else self.fragment_count
        return fragments + (0 if self._tree is None else self._tree.records)

    @property
    def nbytes(self) -> int:
        """Bytes that the maps and the tree take so far, the mesh not counted."""
        return sum(made.nbytes for made in (self._maps, self._tree) if made is not None)

    def counts(self, axis: int) -> np.ndarray:
        """(rows, columns) int32: fragments per texel of the map of ``axis``."""
        rows, columns = self.frame.map_shape(axis)
        first = self.frame.first_texels
        return np.diff(self.sorted_maps.start.numpy()[first[axis] : first[axis + 1] + 1]).reshape(rows, columns)

    def layers(self) -> dict[str, int]:
        """Per face, the most surfaces that face it over one texel: the layers that depth peeling would draw."""
        starts = self.sorted_maps.start.numpy()
        first = self.frame.first_texels
        upwards = np.concatenate([[0], np.cumsum(self.sorted_maps.reference.numpy() & 1)])
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
    ) -> TreeView | MapsView:
        """What kernels read for a search: a ``TreeView`` for ``"exact"``, a ``MapsView`` for ``"linear"``.

        Raises:
            InputError: an unknown search, or a number of steps that is not allowed.
        """
        if search not in TRACERS:
            raise unknown_name("search", search, TRACERS)
        if search == "exact":
            return self.tree.view
        maps, steps = self.sorted_maps, checked_linear_steps(linear_steps)
        samples = ONE_A_TEXEL if steps == TEXEL else steps
        return maps.view(self.frame, self.geometry, samples, checked_binary_steps(binary_steps))

    def trace(
        self,
        origins: ArrayLike | wp.array,
        directions: ArrayLike | wp.array,
        t_max: ArrayLike | wp.array | None = None,
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
        origins: ArrayLike | wp.array,
        directions: ArrayLike | wp.array,
        t_max: ArrayLike | wp.array | None = None,
        *,
        search: str = DEFAULT_SEARCH,
        linear_steps: LinearSteps = TEXEL,
        binary_steps: int = BINARY_STEPS,
    ) -> NDArray[np.bool_] | wp.array:
        """Whether rays meet the object at all; arguments and errors as :meth:`trace` has them.

        Returns:
            (...) bool; for Warp arrays (n,) int32, below 0 where nothing is met.
        """
        views = self._views(search, linear_steps, binary_steps)
        return occluded_batch(TRACERS[search], views, self.geometry, origins, directions, t_max)

    def _views(self, search: str, linear_steps: LinearSteps, binary_steps: int) -> wp.array:
        """:meth:`view` as kernels read it; what it points to is owned by this texture."""
        view = self.view(search, linear_steps=linear_steps, binary_steps=binary_steps)
        return array_of_views([view], TRACERS[search].view, self.geometry.vertices.device)

    def save(self, path: str | Path) -> None:
        """Write the maps and their mesh to one file, whole or not at all.

        Raises:
            InputError: the file cannot be written.
        """
        write_file(path, self.geometry.mesh, self.frame, self.sorted_maps)

    @classmethod
    def load(cls, path: str | Path, device: str | None = None) -> LayeredDepthTexture:
        """Read what :meth:`save` wrote.

        Raises:
            InputError: the file is missing, damaged, of another format, or larger than the memory allowed; or there is
                no such device.
        """
        target = launch.resolve_device(device)
        mesh, frame, arrays = read_file(path)
        loaded = cls(DeviceMesh(mesh, target), frame)
        loaded._maps = Maps.from_arrays(frame, arrays, target)
        return loaded
