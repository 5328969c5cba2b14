"""The layered depth textures of a scene: the tracer that peels a mesh when rays can meet it for the first time.

Maps are kept by mesh and resolution. A frame uses exactly the resolutions that are chosen for it, whatever is kept, so
that it has the bits of a first frame.

A mirror is searched triangle by triangle: rays start on its own triangles, and what a patch is off by, every further
bounce makes larger. So is a mesh that the camera's rays are searched for in: one tree serves them and the reflections.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ldtrefl.base.notices import warn_once
from ldtrefl.device.stats import Stats
from ldtrefl.ldt.options import DEFAULT_RESOLUTION, LinearSteps, Quality
from ldtrefl.ldt.peel import peel_mesh
from ldtrefl.ldt.searches import TRACERS
from ldtrefl.ldt.texture import LayeredDepthTexture
from ldtrefl.scene.closed_check import is_closed
from ldtrefl.tracing.tracer import BoundTracer, array_of_shared_views
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.device_scene import DeviceScene

RESOLUTIONS_KEPT = 4
"""Resolutions at which the maps of a mesh are kept: a camera that comes near and goes back peels nothing twice. A frame
uses exactly what is chosen for it. The price is that a mesh is peeled again where finer maps would have done."""


@dataclass(frozen=True)
class MapOptions:
    """How maps are made and searched."""

    search: str
    quality: Quality
    linear_steps: LinearSteps
    binary_steps: int
    resolution: int | None
    """Texels along a mesh's longest side where nothing else is chosen; None for the default."""


@dataclass(frozen=True)
class MapKey:
    """Which maps are meant."""

    mesh: DeviceMesh
    resolution: int
    quality: Quality
    trusted: bool


@dataclass(frozen=True, eq=False)
class _Bound:
    """A tracer, and what it was made of."""

    maps: dict[DeviceMesh, LayeredDepthTexture | None]
    """The maps of each mesh; None where none are needed."""
    mesh_of: np.ndarray
    """The scene's: which object has which mesh."""
    tracer: BoundTracer


class SceneMaps:
    """A ``SceneTracer`` that searches in layered depth textures."""

    def __init__(self, options: MapOptions) -> None:
        self.options = options
        self.chosen: Mapping[DeviceMesh, int] = {}
        """Resolutions for the rays to come; a mesh that is not in it has the usual one."""
        self.searched_by_camera: frozenset[DeviceMesh] = frozenset()
        """The meshes that the frame's camera rays are searched for in."""
        self._maps: dict[MapKey, LayeredDepthTexture] = {}
        """Those used last at the end."""
        self._bound: _Bound | None = None

    @property
    def usual(self) -> int:
        """The resolution of maps that nothing is chosen for."""
        return self.options.resolution or DEFAULT_RESOLUTION

    def bound(self, scene: DeviceScene, objects: Collection[int], stats: Stats) -> BoundTracer:
        """The tracer, once the maps of these objects are peeled at the resolutions chosen."""
        maps, whole = self._maps, self._searched_whole(scene)
        with stats.stage("peel", scene.device):
            for mesh in _meshes_of(scene, objects):
                key = self._key(mesh, mesh in whole)
                if key not in maps:
                    maps[key] = self._peeled(key, stats)
                    if self.options.search == "linear":
                        _warn_if_open(scene, mesh)
                maps[key] = maps.pop(key)  # used last
            # Whatever was peeled for other frames has no part in this one.
            meshes = set(scene.meshes)
            for key in [key for key in maps if key.mesh not in meshes]:
                del maps[key]  # of a mesh that has been deformed since
            current = {mesh: maps.get(self._key(mesh, mesh in whole)) for mesh in scene.meshes}
            bound = self._bound
            if bound is None or bound.mesh_of is not scene.mesh_of or bound.maps != current:
                bound = self._bound = self._bind(scene, current)
        return bound.tracer

    def has_usual_maps(self, scene: DeviceScene, objects: Collection[int]) -> bool:
        """Whether the maps of these objects are made, at the usual resolution."""
        whole = self._searched_whole(scene)
        return all(self._usual_key(mesh, mesh in whole) in self._maps for mesh in _meshes_of(scene, objects))

    def meshes_without_maps(self, scene: DeviceScene) -> int:
        """Meshes that nothing has been peeled of."""
        return len(set(scene.meshes) - {key.mesh for key in self._maps})

    def drop_old_maps(self) -> None:
        """Of each mesh keep the maps at the ``RESOLUTIONS_KEPT`` that were used last."""
        count: dict[DeviceMesh, int] = {}
        for key in reversed(list(self._maps)):
            count[key.mesh] = count.get(key.mesh, 0) + 1
            if count[key.mesh] > RESOLUTIONS_KEPT:
                del self._maps[key]

    def _searched_whole(self, scene: DeviceScene) -> set[DeviceMesh]:
        """The meshes that are searched triangle by triangle, whatever the quality."""
        return _mirrors(scene) | self.searched_by_camera

    def _usual_key(self, mesh: DeviceMesh, is_whole: bool) -> MapKey:
        """The maps of a mesh for which nothing is chosen."""
        return MapKey(mesh, self.usual, "exact" if is_whole else self.options.quality, False)

    def _key(self, mesh: DeviceMesh, is_whole: bool) -> MapKey:
        """The maps of a mesh for the rays to come."""
        usual = self._usual_key(mesh, is_whole)
        resolution = self.chosen.get(mesh, self.usual)
        if self.options.search != "exact":
            return replace(usual, resolution=resolution)
        if usual.quality == "exact":
            return usual  # a tree over all triangles, whatever the resolution
        # Coarser than usual they are trusted; at the usual resolution the exact search's patches are checked.
        return replace(usual, resolution=min(resolution, self.usual), trusted=resolution < self.usual)

    def _peeled(self, key: MapKey, stats: Stats) -> LayeredDepthTexture:
        search = self.options.search
        peeled = peel_mesh(key.mesh, key.resolution, quality=key.quality, search=search, trusted=key.trusted)
        stats.count("objects_from_cache" if peeled.from_cache else "objects_peeled", 1)
        stats.count("records", peeled.record_count)
        stats.count("map_bytes", peeled.nbytes)
        return peeled

    def _bind(self, scene: DeviceScene, current: dict[DeviceMesh, LayeredDepthTexture | None]) -> _Bound:
        options, tracer = self.options, TRACERS[self.options.search]
        of_meshes = [
            tracer.view()
            if maps is None
            else maps.view(options.search, linear_steps=options.linear_steps, binary_steps=options.binary_steps)
            for maps in current.values()
        ]
        views = array_of_shared_views(of_meshes, scene.mesh_of, tracer.view, scene.device)
        return _Bound(current, scene.mesh_of, BoundTracer(tracer, views, of_meshes))


def _warn_if_open(scene: DeviceScene, mesh: DeviceMesh) -> None:
    """Say of the first object with this mesh that the paper's search may not be right about it, if that is so."""
    if not is_closed(mesh.mesh.vertices, mesh.faces):
        first = scene.scene.objects[int(np.argmax(scene.mesh_of == scene.meshes.index(mesh)))]
        warn_once(
            f"object '{first.called}' is open, or wound both ways: search=linear tells inside from outside, and may "
            "miss it or see it where it is not (search=exact does not)"
        )


def _mirrors(scene: DeviceScene) -> set[DeviceMesh]:
    """The meshes of all reflectors."""
    return {scene.meshes[number] for number in np.unique(scene.mesh_of[scene.is_reflector]).tolist()}


def _meshes_of(scene: DeviceScene, objects: Collection[int]) -> list[DeviceMesh]:
    """The meshes of these objects, each once, in the scene's order."""
    numbers = scene.mesh_of[np.fromiter(objects, np.int64, len(objects))]
    return [scene.meshes[number] for number in np.unique(numbers)]
