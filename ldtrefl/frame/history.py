"""The history of a renderer's frames: the one owner of all that is kept from frame to frame.

Whether the camera is the same, and which objects have moved, is decided here and nowhere else. While the camera stays,
what stands still is drawn once and what moves is drawn over it; reflected rays that nothing has changed for are taken
from the last frame (``refollow.py``); a frame in which nothing at all has changed is handed out again.

What is kept is replaced at once, at the end of a step, so that a frame that is stopped on the way leaves nothing half
done.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.frame.camera_shading import Shaded
from ldtrefl.frame.drawn_objects import DrawnObjects
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.frame.searched_pixels import CameraSearch, numbers_of
from ldtrefl.frame.visibility import draw_gbuffer, resolved
from ldtrefl.frame.zbuffer import CornerRoom, Drawing
from ldtrefl.scene.description import Camera
from ldtrefl.world.camera import whole_image
from ldtrefl.world.device_scene import DeviceScene


@dataclass(frozen=True, eq=False)
class Antialiased:
    """Pixels that have been sampled more than once or have such neighbours, and those at the border of the image."""

    pixels: wp.array
    """(n,) int32."""
    radiance: wp.array
    """(n,) vec3: of all their samples."""
    counts: np.ndarray
    """(h, w) uint16: how often each pixel of the image was sampled."""


@dataclass(frozen=True, eq=False)
class FrameParts:
    """What a frame, or a band of one, is composed of."""

    gbuffer: GBuffer
    shaded: Shaded
    reflected: ReflectedLight
    stages: tuple[str, ...]
    """The names of the stages that were timed."""
    antialiased: Antialiased | None = None
    """What is not as it is at the pixels' centres, if pixels may have more samples."""


@dataclass(frozen=True, eq=False)
class _View:
    """A scene as it stood, and the camera that looked at it."""

    scene: DeviceScene
    camera: Camera

    def moved(self, scene: DeviceScene, camera: Camera) -> frozenset[int] | None:
        """The numbers of the objects that have moved since; None if the camera is another one."""
        return scene.moved_since(self.scene) if camera == self.camera else None


@dataclass(frozen=True, eq=False)
class _Still:
    """A z-buffer of the objects that have stood still for some frames."""

    view: _View
    drawing: Drawing
    moving: frozenset[int]
    """The objects that are not in it."""
    searched: frozenset[int]
    """Of those that are, which the camera's rays were searched for in."""


@dataclass(frozen=True, eq=False)
class Reusable:
    """What a method may use again of the last frame, which the same camera saw."""

    reflected: ReflectedLight
    moved: frozenset[int]
    """The numbers of the objects that have moved since."""


class FrameHistory:
    """What is kept from frame to frame of one renderer."""

    def __init__(self, *, keeps: bool) -> None:
        """Keep nothing between frames unless ``keeps``."""
        self._keeps = keeps
        self._view: _View | None = None
        """The scene and the camera of the last frame."""
        self._parts: FrameParts | None = None
        """The last frame, if it was made as a whole."""
        self._reflected: ReflectedLight | None = None
        """What the last frame reflected. It is kept longer than ``_parts``: the next frame may use it again."""
        self._still: _Still | None = None
        self._spare_radiance: wp.array | None = None
        """Of the last frame's pixels, to be written over: memory that is new to the process is slow to write."""

    @property
    def last_view(self) -> tuple[DeviceScene, Camera] | None:
        """The scene and the camera of the last frame."""
        return None if self._view is None else (self._view.scene, self._view.camera)

    @property
    def last_gbuffer(self) -> GBuffer | None:
        """What the camera saw in the last frame; None if there is none, or it was made in bands."""
        return None if self._parts is None else self._parts.gbuffer

    def unchanged(self, scene: DeviceScene, camera: Camera) -> FrameParts | None:
        """The last frame, if this one is the same."""
        moved = self._moved(scene, camera)
        return self._parts if moved is not None and not moved else None

    def reusable(self, scene: DeviceScene, camera: Camera) -> Reusable | None:
        """What a method may use again; None if the camera is another one, or nothing was kept."""
        moved = self._moved(scene, camera)
        if moved is None or self._reflected is None:
            return None
        return Reusable(self._reflected, moved)

    def gbuffer(self, scene: DeviceScene, camera: Camera, search: CameraSearch | None) -> GBuffer:
        """Draw what ``camera`` sees of a scene, or search for it where ``search`` does.

        The last frame is dropped first, so that its memory is used again.
        """
        moved = self._moved(scene, camera)
        if self._parts is not None:
            self._spare_radiance = self._parts.shaded.radiance
        self._parts = None
        if moved is None or len(moved) == len(scene.objects):
            self._still = None
            return draw_gbuffer(scene, camera, search)
        still = self._still
        if still is None or not self._holds(still, scene, camera, search):
            still = self._still = _drawn_still(scene, camera, moved, search)
        drawing = still.drawing.over()
        drawing.draw(scene, DrawnObjects.of(scene, camera, np.array(sorted(still.moving))), search)
        return resolved(drawing, scene)

    @staticmethod
    def _holds(still: _Still, scene: DeviceScene, camera: Camera, search: CameraSearch | None) -> bool:
        """Whether what was drawn still stands as it stood, and is drawn and searched as it would be now."""
        moved = still.view.moved(scene, camera)
        if moved is None or not moved <= still.moving:
            return False
        return still.searched == frozenset(numbers_of(search).tolist()) - still.moving

    def take_spare_radiance(self) -> wp.array | None:
        """An array for the radiance of a frame's pixels, if there is one of an earlier frame that nobody reads."""
        spare, self._spare_radiance = self._spare_radiance, None
        return spare

    def keep(self, scene: DeviceScene, camera: Camera, parts: FrameParts) -> None:
        """Remember a frame that was made as a whole."""
        self._view, self._parts = _View(scene, camera), parts
        self._reflected = None if parts.reflected.followed is None else parts.reflected

    def forget(self) -> None:
        """Drop everything: the next frame is too large to be kept."""
        self._view = self._parts = self._reflected = self._still = self._spare_radiance = None

    def keep_view(self, scene: DeviceScene, camera: Camera) -> None:
        """Remember what was seen in a frame that was made in bands, and nothing else of it."""
        self.forget()
        self._view = _View(scene, camera)

    def _moved(self, scene: DeviceScene, camera: Camera) -> frozenset[int] | None:
        """The objects that have moved since the last frame; None if nothing of it can be used again."""
        if not self._keeps or self._view is None:
            return None
        return self._view.moved(scene, camera)


def _drawn_still(scene: DeviceScene, camera: Camera, moving: frozenset[int], search: CameraSearch | None) -> _Still:
    """Draw all objects that stand still. There is room for the corners of the others: any of them may be drawn."""
    stand = np.delete(np.arange(len(scene.objects)), list(moving))
    searched = frozenset(numbers_of(search).tolist()) - moving
    drawing = Drawing(camera, whole_image(camera), CornerRoom.of(scene, np.array(sorted(searched), np.int64)))
    drawing.draw(scene, DrawnObjects.of(scene, camera, stand), search)
    return _Still(_View(scene, camera), drawing, moving, searched)
