"""The contract of a reflection method: from a G-buffer to the radiance that its reflector pixels reflect.

A method is a class with a ``name`` and a ``Config``. It is made once per renderer, so it may keep what it has made of
meshes, and asked once per frame, or once for each band of a large one. It keeps nothing of a frame: what the next frame
may use again is kept by the renderer (``frame/history.py``). It is never asked by two threads at once.

A ``RaylessMethod`` is handed the G-buffer, and answers for its ``reflector_pixels``. A ``RayMethod`` is handed the rays
that leave those pixels, too. Shadows are asked of the renderer's tracer, which the method's class chooses. A method
that paints the shading normal is whole with these lines::

    class Normals(RaylessMethod):
        \"\"\"The shading normal in place of the reflection.\"\"\"

        name = "normals"

        def reflect(self, gbuffer: GBuffer, stats: Stats) -> wp.array:
            _, normals = gbuffer.surfaces  # of all pixels, in device space, whose axes are the world's
            colors = 0.5 + 0.5 * normals.numpy()[gbuffer.reflector_pixels.numpy()]
            return wp.array(colors, dtype=wp.vec3, device=self.scene.device)

``envmap.py`` shows a ``Config`` of one's own, and a kernel.
"""

from __future__ import annotations

import abc
import ast
import dataclasses
import inspect
import itertools
import textwrap
from collections.abc import Collection
from typing import Annotated, Any, ClassVar

import warp as wp
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as pydantic_dataclass

from ldtrefl.base.errors import InputError, first_fault, unknown_name
from ldtrefl.device.stats import Stats
from ldtrefl.frame.antialiasing import Sampling
from ldtrefl.frame.bounces import BounceLimits
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import Reusable
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.frame.searched_pixels import CameraSearch
from ldtrefl.frame.skip_options import SkipChoice, skip_names, skip_options_of
from ldtrefl.scene.description import MAX_SAMPLES, Camera, Scene
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.tracing.scene_bvh import SceneBvh
from ldtrefl.tracing.tracer import BoundTracer, SceneTracer
from ldtrefl.world.device_scene import DeviceScene

DEFAULT_SAMPLES = 4
"""Samples of a pixel that differs from its neighbours, if nothing is said."""

CONFIG = ConfigDict(extra="forbid")
"""How every method's ``Config`` is checked."""


@pydantic_dataclass(frozen=True, kw_only=True, config=CONFIG)
class CommonConfig:
    """The options that every method has."""

    # Described by ``Field``, because docstrings are read from the class that a method has.
    skip: Annotated[
        SkipChoice,
        Field(description=f"What is left out: all that can be, none, or a list of {', '.join(skip_names())}."),
    ] = "all"
    samples: Annotated[
        Annotated[int, Field(strict=True, ge=1, le=MAX_SAMPLES)] | None,
        Field(description=f"The most samples of a pixel, 1 to {MAX_SAMPLES}; the scene's number, or 4, if not given."),
    ] = None
    adaptive: Annotated[
        Annotated[bool, Field(strict=True)],
        Field(description="Whether a pixel that does not differ from its neighbours is sampled once."),
    ] = True
    filter_textures: Annotated[
        Annotated[bool, Field(strict=True)] | None,
        Field(
            description="Textures are shown as means over what pixels cover; if not given, where samples are several."
        ),
    ] = None
    anisotropy: Annotated[
        Annotated[int, Field(strict=True, ge=1, le=64)],
        Field(description="How much longer than wide a filter of textures may be, 1 to 64: 1 is trilinear."),
    ] = 16

    def sampling(self, scene: Scene) -> Sampling:
        """How often the pixels of a scene's image are sampled."""
        return Sampling(self.samples or scene.reflection.samples or DEFAULT_SAMPLES, self.adaptive)

    def probes(self, scene: Scene) -> int:
        """The most probes that a texture of a scene is filtered by; 0: it is not."""
        filters = self.filter_textures
        if filters is None:
            filters = self.sampling(scene).samples > 1
        return self.anisotropy if filters else 0


@pydantic_dataclass(frozen=True, kw_only=True, config=CONFIG)
class RayConfig(CommonConfig):
    """The options of methods that follow rays; what is not given is the scene's."""

    max_bounces: Annotated[
        Annotated[int, Field(strict=True, ge=1, le=64)] | None,
        Field(description="Reflections of a ray, 1 to 64; the scene's number if not given."),
    ] = None
    least_weight: Annotated[
        Annotated[float, Field(ge=0.0, le=1.0)] | None,
        Field(description="A ray ends at a mirror if less than this share of what follows would arrive, 0 to 1."),
    ] = None

    def limits(self, scene: Scene) -> BounceLimits:
        """When rays end in a scene."""
        most, least = self.max_bounces, self.least_weight
        by_scene = scene.reflection
        return BounceLimits(
            by_scene.max_bounces if most is None else most, by_scene.least_weight if least is None else least
        )


class Method(abc.ABC):
    """What all methods share; each is a ``RaylessMethod`` or a ``RayMethod``."""

    name: ClassVar[str]
    Config: ClassVar[type] = CommonConfig
    """A frozen pydantic dataclass that comes from ``CommonConfig``, with a docstring under each field."""

    def __init__(self, scene: DeviceScene, config: CommonConfig, tracer: SceneTracer) -> None:
        self.scene = scene
        self.config = config
        self.tracer = tracer
        """The renderer's tracer."""
        self.skip = skip_options_of(config.skip)

    @classmethod
    def scene_tracer(cls, config: CommonConfig) -> SceneTracer:
        """The tracer that answers shadow rays, and the method's own rays if it has any; by default the ray caster."""
        return SceneBvh()

    @classmethod
    def needs_footprints(cls, config: CommonConfig) -> bool:
        """Whether the method asks for the footprints of rays (``geometry/footprint.py``)."""
        return False

    def place(self, scene: DeviceScene) -> None:
        """Go on with a scene in which some objects have moved, their meshes and all else the same."""
        self.scene = scene

    def first_kernels(self) -> list[wp.Kernel]:
        """Kernels that a first frame will need, those first that take longest to compile: they are compiled ahead."""
        return []

    def camera_search(self, scene: DeviceScene, camera: Camera, stats: Stats) -> CameraSearch | None:
        """The objects of ``scene`` that this frame's camera rays are to be searched for in, and by what; None to draw
        all. It may depend on the scene and the camera alone. Called before anything else of a frame."""
        return None

    def sample_tracer(self, scene: DeviceScene, objects: Collection[int], stats: Stats) -> BoundTracer:
        """What answers the camera's rays between the pixels' centres, which can meet these objects: it must see them
        as they are drawn."""
        return self.tracer.bound(scene, objects, stats)

    def foresee(self, gbuffer: GBuffer, stats: Stats) -> None:  # noqa: B027  (most methods have nothing to foresee)
        """Make the tracer ready for what the camera sees. Called before shadow rays are asked of it, only if the scene
        has shadows or occlusion."""

    @classmethod
    def describe(cls) -> str:
        """The first line of the method's docstring."""
        return (cls.__doc__ or "").strip().splitlines()[0]

    @classmethod
    def options(cls) -> dict[str, tuple[Any, str]]:
        """Option -> (default, what it does)."""
        fields = cls.Config.__pydantic_fields__  # type: ignore[attr-defined]
        words = _attribute_docstrings(cls.Config) | {
            name: field.description for name, field in fields.items() if field.description
        }
        return {
            entry.name: (entry.default, " ".join(words.get(entry.name, "").split()))
            for entry in dataclasses.fields(cls.Config)
        }

    @classmethod
    def configured(cls, options: dict[str, object]) -> Any:
        """A checked ``Config``.

        Raises:
            InputError: an option that the method does not have, or a value that is not allowed.
        """
        allowed = [entry.name for entry in dataclasses.fields(cls.Config)]
        for name in options:
            if name not in allowed:
                raise unknown_name(f"option of method {cls.name}", name, allowed)
        try:
            return TypeAdapter(cls.Config).validate_python(options)
        except ValidationError as error:
            raise first_fault(error, {}).within(f"method {cls.name}") from None
        except InputError as error:
            raise error.within(f"method {cls.name}") from None


def _attribute_docstrings(kind: type) -> dict[str, str]:
    """Field -> the docstring under it, read from the source of a class; pydantic would read it at every import."""
    (body,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    assert isinstance(body, ast.ClassDef)
    return {
        field.target.id: docstring.value.value
        for field, docstring in itertools.pairwise(body.body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(docstring, ast.Expr)
        and isinstance(docstring.value, ast.Constant)
        and isinstance(docstring.value.value, str)
    }


class RaylessMethod(Method):
    """A way to compute reflections without rays: from what the camera sees."""

    @abc.abstractmethod
    def reflect(self, gbuffer: GBuffer, stats: Stats) -> wp.array:
        """(m,) vec3: the radiance that reaches each of the G-buffer's ``reflector_pixels`` by way of the mirror, before
        the reflector's own reflectance. Called only if there are such pixels, or if ``skip`` does not name
        ``reflection``."""


class RayMethod(Method):
    """A way to compute reflections by rays."""

    keeps_bounces = False
    """Whether each bounce is to be kept as it was, too, for the layers of a picture."""

    @property
    def most_bounces(self) -> int:
        """How often a ray may be mirrored."""
        return self.config.limits(self.scene.scene).most if isinstance(self.config, RayConfig) else 1

    @abc.abstractmethod
    def reflect_rays(
        self, gbuffer: GBuffer, rays: RayBuffer, reusable: Reusable | None, stats: Stats
    ) -> ReflectedLight:
        """The reflections in what the camera sees, from the rays that leave its ``reflector_pixels``.

        Args:
            rays: one for each of these pixels, or several in a row, in the order of the pixels. They stay as they are.
            reusable: the last frame's answer, if the same camera saw it, and what has moved since.
        """
