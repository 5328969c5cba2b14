"""The BVHs of a scene, one for each mesh.

They answer the rays of ray casting, and the shadow rays of every method that has no tracer of its own.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ldtrefl.device.stats import Stats
from ldtrefl.tracing.bvh import BVH, Raycaster
from ldtrefl.tracing.bvh_walk import BvhView
from ldtrefl.tracing.tracer import BoundTracer, array_of_shared_views
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.device_scene import DeviceScene


class SceneBvh:
    """A ``SceneTracer`` that builds the BVHs of all meshes when the first is needed.

    A deformed mesh is another mesh, and gets a tree of its own. To refit the old one would be faster, but the picture
    would then depend on what was rendered before.
    """

    def __init__(self) -> None:
        self._trees: dict[DeviceMesh, Raycaster] = {}
        self._mesh_of: np.ndarray | None = None
        """The scene's, when the tracer was bound: which object has which mesh."""
        self._bound: BoundTracer | None = None

    def bound(self, scene: DeviceScene, objects: Collection[int], stats: Stats) -> BoundTracer:
        """The tracer over all objects."""
        if self._bound is None or self._mesh_of is not scene.mesh_of:
            with stats.stage("build", scene.device):
                self._trees = {mesh: self._trees.get(mesh) or Raycaster.of(mesh) for mesh in scene.meshes}
                self._mesh_of, trees = scene.mesh_of, list(self._trees.values())
                views = array_of_shared_views([tree.view() for tree in trees], scene.mesh_of, BvhView, scene.device)
                self._bound = BoundTracer(BVH, views, trees)
        return self._bound
