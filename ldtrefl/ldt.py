"""``LayeredDepthTexture``: an object's maps on the host side: trace, look, save and load."""

from __future__ import annotations

import os
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

from ldtrefl import launch
from ldtrefl.cubemap import FACE_NAMES, TexelFrame
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.errors import InputError, unknown_name
from ldtrefl.fragments import LdtView
from ldtrefl.march import TRACERS
from ldtrefl.mesh import Mesh
from ldtrefl.trace import Hits, trace_batch

FORMAT = 1
"""Of saved files; goes up when what they hold changes."""

LINEAR_STEPS = 512
"""Default of ``linear_steps``: about one a texel along the diagonal of a 256 map."""

BINARY_STEPS = 8
"""Default of ``binary_steps``: a texel's step is halved to less than a hundredth."""


@dataclass(frozen=True, eq=False)
class LayeredDepthTexture:
    """An object's surfaces in six orthographic maps (Zhang, Hsieh and Shen, section 3.3); see ``fragments.py``.

    Made by :func:`ldtrefl.peel`. Object space is the object's own vertex coordinates.
    """

    geometry: DeviceMesh
    frame: TexelFrame
    start: wp.array
    """(texels + 1,) int32: first fragment of each texel, the three axes' maps in a row."""
    depth: wp.array
    """(fragments,) float32, texels along the map's axis, sorted in each texel."""
    reference: wp.array
    """(fragments,) int32: triangle times 2, plus 1 if it faces up the axis."""

    @property
    def resolution(self) -> int:
        """Texels along the object's longest side."""
        return max(self.frame.size)

    @property
    def fragment_count(self) -> int:
        """Fragments in the three maps; each serves two faces."""
        return self.depth.shape[0]

    @property
    def nbytes(self) -> int:
        """Bytes that the maps take, the mesh not counted."""
        return sum(array.size * 4 for array in (self.start, self.depth, self.reference))

    def counts(self, axis: int) -> np.ndarray:
        """(rows, columns) int32: fragments per texel of the map of ``axis``."""
        rows, columns = self.frame.map_shape(axis)
        first = self.frame.first_texels
        return np.diff(self.start.numpy()[first[axis] : first[axis + 1] + 1]).reshape(rows, columns)

    def layers(self) -> dict[str, int]:
        """Per face, the most surfaces that face it over one texel: the layers that depth peeling would draw."""
        starts = self.start.numpy()
        first = self.frame.first_texels
        upwards = np.concatenate([[0], np.cumsum(self.reference.numpy() & 1)])
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

    def view(self, *, linear_steps: int = LINEAR_STEPS, binary_steps: int = BINARY_STEPS) -> Any:
        """The ``LdtView`` for kernels."""
        view = LdtView()
        view.start, view.depth, view.reference = self.start, self.depth, self.reference
        view.size = wp.vec3i(*self.frame.size)
        view.first_texel = wp.vec3i(*self.frame.first_texels[:3])
        view.texels_per_unit = self.frame.scale
        view.texel_offset = wp.vec3(*self.frame.offset)
        view.vertices, view.faces = self.geometry.vertices, self.geometry.faces
        view.linear_steps, view.binary_steps = linear_steps, binary_steps
        return view

    def trace(
        self,
        origins: Any,
        directions: Any,
        *,
        search: str = "linear",
        linear_steps: int = LINEAR_STEPS,
        binary_steps: int = BINARY_STEPS,
    ) -> Hits:
        """First hits of n rays given in object space.

        Args:
            origins: (n, 3) float32 numpy or Warp array.
            directions: (n, 3) float32, any length; ``t`` is in lengths of it.
            search: how the maps are searched: ``"linear"``.
            linear_steps, binary_steps: of the linear search.

        Raises:
            InputError: shapes that do not fit, or an unknown search.
        """
        if search not in TRACERS:
            raise unknown_name("search", search, TRACERS)
        device = self.start.device
        views = wp.array(
            [self.view(linear_steps=linear_steps, binary_steps=binary_steps)], dtype=LdtView, device=device
        )
        return trace_batch(TRACERS[search], views, self.geometry, origins, directions)

    def save(self, path: str | Path) -> None:
        """Write the maps and their mesh to one file, whole or not at all.

        Raises:
            InputError: the file cannot be written.
        """
        path = Path(path)
        arrays = {
            "format": np.int64(FORMAT),
            "vertices": self.geometry.mesh.vertices,
            "faces": self.geometry.mesh.faces,
            "normals": self.geometry.mesh.normals,
            "size": np.array(self.frame.size),
            "scale": np.float64(self.frame.scale),
            "offset": np.array(self.frame.offset),
            "start": self.start.numpy(),
            "depth": self.depth.numpy(),
            "reference": self.reference.numpy(),
        }
        try:
            with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}-", delete=False) as scratch:
                try:
                    np.savez(scratch, **arrays)
                    scratch.close()
                    os.replace(scratch.name, path)
                except BaseException:
                    Path(scratch.name).unlink(missing_ok=True)
                    raise
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror})") from error

    @classmethod
    def load(cls, path: str | Path, device: str | None = None) -> LayeredDepthTexture:
        """Read what :meth:`save` wrote.

        Raises:
            InputError: the file is missing, damaged, or of another format.
        """
        target = launch.resolve_device(device)
        try:
            with np.load(path, allow_pickle=False) as stored:
                if int(stored["format"]) != FORMAT:
                    raise InputError(f"{path}: format {int(stored['format'])}, this version reads {FORMAT}")
                mesh = Mesh(stored["vertices"], stored["faces"], stored["normals"])
                x, y, z = (int(n) for n in stored["size"])
                ox, oy, oz = (float(o) for o in stored["offset"])
                frame = TexelFrame((x, y, z), float(stored["scale"]), (ox, oy, oz))
                start, depth, reference = (stored[name] for name in ("start", "depth", "reference"))
        except InputError as error:
            raise error.within(str(path)) from None
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise InputError(f"{path}: not a layered depth texture that can be read ({error})") from error
        _check(frame, start, depth, reference, len(mesh.faces), path)
        return cls(
            DeviceMesh.upload(mesh, target),
            frame,
            wp.array(start, dtype=wp.int32, device=target),
            wp.array(depth, dtype=wp.float32, device=target),
            wp.array(reference, dtype=wp.int32, device=target),
        )


def _check(frame: TexelFrame, start: Any, depth: Any, reference: Any, triangles: int, path: Any) -> None:
    """Refuse maps whose numbers would send a kernel outside its arrays."""
    sound = (
        min(frame.size) >= 1
        and start.shape == (frame.first_texels[3] + 1,)
        and depth.shape == reference.shape == (int(start[-1]),)
        and int(start[0]) == 0
        and bool((np.diff(start) >= 0).all())
        and bool(np.isfinite(depth).all())
        and bool(((reference >= 0) & (reference >> 1 < triangles)).all())
    )
    if not sound:
        raise InputError(f"{path}: the maps are damaged")
