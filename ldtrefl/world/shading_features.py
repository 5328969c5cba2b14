"""What of a scene shading must know of: kernels are built for that and no more."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class ShadingFeatures:
    """What a scene has that costs time in kernels. None of it costs any where a scene has it not."""

    looks: bool = False
    """Whether any object has a look."""
    dimmed_shadows: bool = False
    """Whether any object lets light through, by the alpha of its look, that rays ask for."""
    shadows: bool = False
    """Whether lights cast shadows."""
    soft_light: bool = False
    """Whether there are lights but directional ones and points, or ambient light is dimmed by what stands close: then
    several rays may be asked from each point, and lights be seen."""

    probes: int = 0
    """The most probes by which a texture is filtered; 0: textures are not filtered, or there are none."""
    footprints: bool = False
    """Whether rays carry their footprints."""

    def without_rays(self) -> ShadingFeatures:
        """The same where nothing is asked of a tracer."""
        return replace(self, dimmed_shadows=False, shadows=False)
