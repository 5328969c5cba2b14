"""The BVHs of a scene, one for each mesh.

They answer the rays of ray casting, and the shadow rays of every method that has no tracer of its own.
"""

from __future__ import annotations

from ldtrefl.device.stats import Stats
from ldtrefl.tracing.bvh import BVH, BvhView, Raycaster
from ldtrefl.tracing.tracer import BoundTracer, array_of_views
from ldtrefl.world.device_scene import DeviceScene


class SceneBvh:
    """A ``SceneTracer`` that builds the BVHs of all meshes when the first is needed."""

    def __init__(self) -> None:
        self._bound: BoundTracer | None = None

    def bound(self, scene: DeviceScene, objects: set[int], stats: Stats) -> BoundTracer:
        """The tracer over all objects, of this scene and of all that come from it by moves."""
        if self._bound is None:
            with stats.stage("build", scene.device):
                meshes = dict.fromkeys(entry.geometry for entry in scene.objects)
                trees = {mesh: Raycaster.of(mesh) for mesh in meshes}
                views = [trees[entry.geometry].view() for entry in scene.objects]
                self._bound = BoundTracer(BVH, array_of_views(views, BvhView, scene.device), list(trees.values()))
        return self._bound
