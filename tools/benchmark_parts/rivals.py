"""Other people's ray tracers, as their users call them from Python.

Each is a class with the same few methods as ours (``ray_tracer.py``). Packages that are not installed, or do not start
here, are reported in one line and left out: ``pip install -e .[peers]`` brings them. Two need what pip does not bring:
Open3D loads libusb (Debian: ``libusb-1.0-0``), and Mitsuba's ``llvm`` variants an LLVM of version 16 or newer (Debian:
``libllvm19``); where it is not found by itself, DRJIT_LIBLLVM_PATH names the file.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from .ray_tracer import RayTracer
from .rays import EYE, FIELD, Rays

MOST_TRIANGLES = 4_000_000
"""Up to which all are run: three more trees of Embree's, of a gigabyte each, would be kept beside the first."""

SMALLEST_SCENE = np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32)
"""One triangle, to see whether a rival starts."""


class Rival(RayTracer):
    """A ray tracer of another library."""

    @classmethod
    def load(cls) -> None:
        """Import what is needed; raises whatever it raises."""
        raise NotImplementedError


class Embreex(Rival):
    """Embree 4 through embreex, robust; it traces ray by ray on one thread and builds on all."""

    name = "embreex"
    has_threads = False
    builds_on_all = True
    _scene: ModuleType
    _mesh: ModuleType

    @classmethod
    def load(cls) -> None:
        cls._scene = importlib.import_module("embreex.rtcore_scene")
        cls._mesh = importlib.import_module("embreex.mesh_construction")

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self._built = self._scene.EmbreeScene(robust=True)
        self._mesh.TriangleMesh(self._built, vertices, faces)
        # The tree is built at the first ray.
        self._built.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def closest(self, rays: Rays) -> dict[str, np.ndarray]:
        return self._built.run(rays.origins, rays.directions, output=1)

    def occluded(self, rays: Rays) -> np.ndarray:
        return self._built.run(rays.origins, rays.directions, query="OCCLUDED") >= 0

    def prepared(self, rays: Rays) -> Callable[[], object]:
        query = "OCCLUDED" if rays.any_hit else "INTERSECT"
        return lambda: self._built.run(rays.origins, rays.directions, query=query)

    def hits(self, rays: Rays) -> tuple[np.ndarray, np.ndarray]:
        found = self.closest(rays)
        return np.where(found["primID"] >= 0, found["tfar"], np.float32(np.inf)), found["primID"]


class Open3d(Rival):
    """Open3D's RaycastingScene (Embree 4)."""

    name = "Open3D"
    most_triangles = MOST_TRIANGLES
    _threads: ClassVar[int] = 0
    _o3d: ModuleType

    @classmethod
    def load(cls) -> None:
        cls._o3d = importlib.import_module("open3d")

    @classmethod
    def set_threads(cls, threads: int) -> None:
        cls._threads = threads

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self._built = self._o3d.t.geometry.RaycastingScene(nthreads=self._threads)
        self._built.add_triangles(self._o3d.core.Tensor(vertices), self._o3d.core.Tensor(faces.astype(np.uint32)))
        self._built.cast_rays(self._o3d.core.Tensor(np.ones((1, 6), np.float32)))

    def _rays(self, rays: Rays) -> Any:
        return self._o3d.core.Tensor(np.concatenate([rays.origins, rays.directions], axis=1))

    def closest(self, rays: Rays) -> dict[str, np.ndarray]:
        return {k: v.numpy() for k, v in self._built.cast_rays(self._rays(rays), nthreads=self._threads).items()}

    def occluded(self, rays: Rays) -> np.ndarray:
        return self._built.test_occlusions(self._rays(rays), nthreads=self._threads).numpy()

    def prepared(self, rays: Rays) -> Callable[[], object]:
        ready = self._rays(rays)
        if rays.any_hit:
            return lambda: self._built.test_occlusions(ready, nthreads=self._threads)
        return lambda: self._built.cast_rays(ready, nthreads=self._threads)

    def hits(self, rays: Rays) -> tuple[np.ndarray, np.ndarray]:
        found = self.closest(rays)
        missed = np.isinf(found["t_hit"])
        return found["t_hit"], np.where(missed, -1, found["primitive_ids"].astype(np.int64)).astype(np.int32)


class MitsubaLlvm(Rival):
    """Mitsuba 3's ``llvm_ad_rgb``: Embree, eight or sixteen rays at a time from compiled code."""

    name = "Mitsuba llvm"
    most_triangles = MOST_TRIANGLES
    variant: ClassVar[str] = "llvm_ad_rgb"
    _mi: ModuleType
    _dr: ModuleType
    _point: Any
    _vector: Any
    _ray: Any

    @classmethod
    def load(cls) -> None:
        cls._mi, cls._dr = importlib.import_module("mitsuba"), importlib.import_module("drjit")
        cls._mi.set_variant(cls.variant)
        # Mitsuba's names mean the variant that was set last.
        cls._point, cls._vector, cls._ray = cls._mi.Point3f, cls._mi.Vector3f, cls._mi.Ray3f
        cls._dr.eval(cls._dr.arange(cls._mi.Float, 4) + 1)

    @classmethod
    def set_threads(cls, threads: int) -> None:
        cls._dr.set_thread_count(threads)

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self._mi.set_variant(self.variant)
        self._built = self._mi.load_dict({"type": "scene", "mesh": self._mesh(vertices, faces)})
        self.prepared(Rays("", *SMALLEST_SCENE[:1], np.ones((3, 3), np.float32)))()

    def _mesh(self, vertices: np.ndarray, faces: np.ndarray) -> Any:
        mesh = self._mi.Mesh("mesh", len(vertices), len(faces))
        arrays = self._mi.traverse(mesh)
        for name, values in (("vertex_positions", vertices), ("faces", faces.astype(np.uint32))):
            arrays[name] = type(arrays[name])(values.ravel())
        arrays.update()
        return mesh

    def _rays(self, rays: Rays) -> Any:
        origins, directions = self._point(rays.origins.T), self._vector(rays.directions.T)
        self._dr.eval(origins, directions)
        return self._ray(origins, directions)

    def closest(self, rays: Rays) -> tuple[np.ndarray, ...]:
        found = self._built.ray_intersect_preliminary(self._rays(rays), coherent=False)
        self._dr.eval(found.t, found.prim_index, found.prim_uv)
        return found.t.numpy(), found.prim_index.numpy(), found.prim_uv.numpy()

    def occluded(self, rays: Rays) -> np.ndarray:
        return self._built.ray_test(self._rays(rays), coherent=False).numpy()

    def prepared(self, rays: Rays) -> Callable[[], object]:
        ready = self._rays(rays)

        def trace() -> None:
            # Declared coherent, they are traced one by one, and take three times as long.
            if rays.any_hit:
                answer = self._built.ray_test(ready, coherent=False)
            else:
                answer = self._built.ray_intersect_preliminary(ready, coherent=False).t
            self._dr.eval(answer)
            self._dr.sync_thread()

        return trace

    def hits(self, rays: Rays) -> tuple[np.ndarray, np.ndarray]:
        t, triangle, _ = self.closest(rays)
        return t, np.where(np.isinf(t), -1, triangle.astype(np.int64)).astype(np.int32)


class MitsubaScalar(MitsubaLlvm):
    """Mitsuba 3's ``scalar_rgb``. Python can only hand it one ray at a time, so what is timed is a whole picture by its
    ``depth`` integrator, film and all, and of primary rays alone."""

    name = "Mitsuba scalar"
    variant = "scalar_rgb"
    is_default = False

    @classmethod
    def load(cls) -> None:
        cls._mi = importlib.import_module("mitsuba")
        cls._mi.set_variant(cls.variant)

    @classmethod
    def set_threads(cls, threads: int) -> None:
        cls._dr = importlib.import_module("drjit")
        cls._dr.set_thread_count(threads)

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self._mi.set_variant(self.variant)
        self._shape = self._mesh(vertices, faces)
        self._built = self._mi.load_dict({"type": "scene", "mesh": self._shape})

    def takes(self, rays: Rays) -> bool:
        return rays.size is not None

    def takes_arrays(self, rays: Rays) -> bool:
        return False

    def prepared(self, rays: Rays) -> Callable[[], object]:
        self._mi.set_variant(self.variant)
        assert rays.size is not None
        columns, rows = rays.size
        film = {"type": "hdrfilm", "width": columns, "height": rows, "rfilter": {"type": "box"}, "pixel_format": "rgb"}
        camera = {
            "type": "perspective",
            "fov": FIELD,
            "fov_axis": "y",
            "near_clip": 1e-3,
            "to_world": self._mi.ScalarTransform4f().look_at(origin=EYE.tolist(), target=[0, 0, 0], up=[0, 0, 1]),
            "film": film,
            "sampler": {"type": "independent", "sample_count": 1},
        }
        scene = self._mi.load_dict({"type": "scene", "mesh": self._shape, "sensor": camera})
        integrator = self._mi.load_dict({"type": "depth"})
        return lambda: integrator.render(scene, seed=0, spp=1)


RIVALS: tuple[type[Rival], ...] = (Embreex, Open3d, MitsubaLlvm, MitsubaScalar)


def available(names: Sequence[str]) -> tuple[list[type[Rival]], list[str]]:
    """The rivals of these names that start here, and a line for each that does not."""
    found, notes = [], []
    for rival in RIVALS:
        if rival.name not in names:
            continue
        try:
            rival.load()
            rival(*SMALLEST_SCENE)
        except Exception as error:
            notes.append(f"{rival.name}: cannot run here: {type(error).__name__}: {str(error).splitlines()[0]}")
            continue
        found.append(rival)
    return found, notes
