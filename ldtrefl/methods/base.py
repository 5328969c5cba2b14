"""The contract of a reflection method: from a G-buffer to an image of reflected radiance.

A method is a class with a ``name`` and a ``Config``. It is made once per renderer, so it may keep maps and trees
between frames, and asked once per frame, or once for each band of a large one. Whatever it keeps, a frame has the bits
that a new renderer gives it. It is never asked by two threads at once.
"""

from __future__ import annotations

import abc
import dataclasses
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as pydantic_dataclass

from ldtrefl.base.errors import InputError, first_fault, unknown_name
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.reflect import BoundTracer, FirstHits
from ldtrefl.frame.skips import Choice, chosen, names
from ldtrefl.tracing.bvh import BVH, BvhView, Raycaster
from ldtrefl.tracing.trace import array_of_views
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.device_scene import DeviceScene

CONFIG = ConfigDict(extra="forbid", use_attribute_docstrings=True)
"""How every method's ``Config`` is checked."""


@dataclass(frozen=True, eq=False)
class Reflection:
    """A method's answer."""

    radiance: wp.array
    """(h * w,) vec3: reflected radiance per pixel, before the reflector's own reflectance; 0 off the reflectors."""
    hits: FirstHits | None = None
    """Where the first rays ended, for methods that have rays."""


class Trees:
    """The BVHs of a scene, one a mesh, built when they are first needed."""

    def __init__(self) -> None:
        self._bound: tuple[BoundTracer, dict[DeviceMesh, Raycaster]] | None = None

    def bound(self, scene: DeviceScene, stats: Stats) -> BoundTracer:
        """The tracer over all objects, of this scene and of all that come from it."""
        if self._bound is None:
            with stats.stage("build", scene.device):
                meshes = dict.fromkeys(entry.geometry for entry in scene.objects)
                trees = {mesh: Raycaster.of(mesh) for mesh in meshes}
                views = [trees[entry.geometry].view() for entry in scene.objects]
                self._bound = BoundTracer(BVH, array_of_views(views, BvhView, scene.device)), trees
        return self._bound[0]


@pydantic_dataclass(frozen=True, kw_only=True, config=CONFIG)
class CommonConfig:
    """What every method's ``Config`` begins with."""

    # A description that classes inherit: attribute docstrings are the class's own.
    skip: Annotated[
        Choice, Field(description=f"What is left out: all that can be, none, or a list of {', '.join(names())}.")
    ] = "all"


class Method(abc.ABC):
    """A way to compute reflections."""

    name: ClassVar[str]
    Config: ClassVar[type]
    """A frozen pydantic dataclass, a docstring under each field."""

    def __init__(self, scene: DeviceScene, config: Any) -> None:
        self.scene = scene
        self.config = config
        self.skips = chosen(config.skip)

    def place(self, scene: DeviceScene) -> None:
        """Go on with a scene in which some objects have moved, their meshes and all else the same."""
        self.scene = scene

    @abc.abstractmethod
    def reflect(self, gbuffer: GBuffer, rays: Any, stats: Stats) -> Reflection:
        """The reflections in what the camera sees, from the ``RayBuffer`` of its pixels that see a reflector. Called
        only if there are any."""

    @abc.abstractmethod
    def shadow_tracer(self, gbuffer: GBuffer, stats: Stats) -> BoundTracer:
        """What answers shadow rays from what the camera sees. Called before ``reflect``, only if the scene has
        shadows."""

    def forget(self) -> None:  # noqa: B027  (most methods keep nothing of the kind)
        """Drop what is kept of the last frame's pixels: the next frame is too large for that."""

    @classmethod
    def describe(cls) -> str:
        """The first line of the method's docstring."""
        return (cls.__doc__ or "").strip().splitlines()[0]

    @classmethod
    def options(cls) -> dict[str, tuple[Any, str]]:
        """Option -> (default, what it does)."""
        fields = cls.Config.__pydantic_fields__  # type: ignore[attr-defined]
        return {
            entry.name: (entry.default, " ".join((fields[entry.name].description or "").split()))
            for entry in dataclasses.fields(cls.Config)
        }

    @classmethod
    def configured(cls, options: dict[str, Any]) -> Any:
        """A checked ``Config``.

        Raises:
            InputError: an option that the method does not have, or a value that is not allowed.
        """
        for name in options:
            if name not in cls.options():
                raise unknown_name(f"option of method {cls.name}", name, cls.options())
        try:
            return TypeAdapter(cls.Config).validate_python(options)
        except ValidationError as error:
            raise first_fault(error, {}).within(f"method {cls.name}") from None
        except InputError as error:
            raise error.within(f"method {cls.name}") from None
