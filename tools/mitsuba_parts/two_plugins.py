"""A surface for Mitsuba: one that lights are seen in, by its plugins as they are or made to mean what ours mean.

Lights are points and directions, which a smooth mirror of Mitsuba never meets; ours shows them in it as a surface of a
little roughness does. So a surface has a plugin for lights, and another for mirrored rays.

Three things Mitsuba's plugins mean otherwise. They mask microfacets for the two ways apart (separable Smith) and lose
what these reflect twice; ours mask them for both together (height-correlated), and add what is lost. And what is left
for the base of a dielectric is not what its microfacets leave. ``Layers`` puts a surface together as ours is, from
Mitsuba's microfacets and its diffuse base: the factors on them are made of Mitsuba's own masking, and of how much
its own microfacets reflect. None of our numbers and nothing of our code is in them.
"""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .mitsuba_scene import mitsuba

NAME = "two_plugins"
COSINES = 128
"""Of the way to the viewer, for which it is found how much a rough mirror reflects."""
LEAST_COSINE = 1e-3
"""Stands for 0, where no microfacet would be seen."""
SAMPLES = 128
"""Along each side of the square of samples for one of them: twice as many change nothing by 1e-3."""


@dataclass(frozen=True)
class Layers:
    """A surface's parts."""

    roughness: float
    low: tuple[float, float, float]
    """What the microfacets reflect at normal incidence."""
    microfacets: dict[str, object]
    """The plugin of these alone."""
    base: dict[str, object] | None = None
    """The plugin of what is beneath them, to which light comes that they do not reflect to the viewer."""


@dataclass(frozen=True)
class Surface:
    """What Mitsuba is given for a surface of ours."""

    lights: dict[str, object]
    """The plugin that mirrors and scatters lights."""
    rays: dict[str, object] | None = None
    """The plugin that sends mirrored rays on; None for a surface that sends none."""
    layers: Layers | None = None
    """What takes the place of ``lights`` if the models are to be the same; None for a plugin that is taken as it is."""


def bsdf_of(surface: Surface, *, is_layered: bool) -> Any:
    """A surface as Mitsuba has it, by its plugin as it is or put together as ours is."""
    mi = mitsuba()
    _register()
    given: dict[str, object] = {"type": NAME}
    if surface.rays is not None:
        given["rays"] = _two_sided(surface.rays)
    if surface.layers is None or not is_layered:
        return mi.load_dict({**given, "lights": _two_sided(surface.lights)})
    layers = surface.layers
    given |= {"lights": _two_sided(layers.microfacets), "roughness": layers.roughness}
    if layers.base is not None:
        given["base"] = _two_sided(layers.base)
    return mi.load_dict({**given, "low": mi.ScalarColor3f(*layers.low)})


def _two_sided(plugin: dict[str, object]) -> dict[str, object]:
    return {"type": "twosided", "nested": plugin}


def _masked_together(distribution: Any, wi: Any, wo: Any) -> Any:
    """Height-correlated Smith masking over the separable one, both ways above the surface.

    Of the masking G for one way, Smith's is G = 1 / (1 + L). Separable it is G_i G_o, correlated 1 / (1 + L_i + L_o)
    (E. Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", 2014, equation 99).
    """
    dr = importlib.import_module("drjit")
    half = dr.normalize(wi + wo)
    of_i, of_o = distribution.smith_g1(wi, half), distribution.smith_g1(wo, half)
    return dr.rcp(of_i + of_o - of_i * of_o)


def _microfacets_of(roughness: float) -> Any:
    """Mitsuba's GGX microfacets; alpha is the square of the roughness."""
    mi = mitsuba()
    return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, roughness**2)


@functools.cache
def _white(roughness: float) -> Any:
    """Mitsuba's rough mirror that reflects everything once."""
    white = {"type": "roughconductor", "distribution": "ggx", "alpha": roughness**2, "material": "none"}
    return mitsuba().load_dict(white)


def _share_reflected(roughness: float, value: Callable[[Any, Any], Any]) -> np.ndarray:
    """(COSINES,) how much microfacets reflect of light from everywhere, at cosines of the way to the viewer, 0 to 1.

    ``value`` says what they reflect for interactions and the ways of light, of which Mitsuba's rough mirror chooses
    many for each cosine.
    """
    mi, dr = mitsuba(), importlib.import_module("drjit")
    plugin, context = _white(roughness), mi.BSDFContext()
    lane = dr.arange(mi.UInt32, COSINES * SAMPLES**2)
    cosine = dr.maximum(mi.Float(lane // SAMPLES**2) / (COSINES - 1), LEAST_COSINE)
    across, down = lane % SAMPLES, (lane // SAMPLES) % SAMPLES
    met = dr.zeros(mi.SurfaceInteraction3f, COSINES * SAMPLES**2)
    met.wi = mi.Vector3f(dr.sqrt(1.0 - dr.square(cosine)), 0.0, cosine)
    # Most of them near the rim of the square, from where the steep microfacets are drawn that hide each other.
    sides = [(2.0 * mi.Float(side) + 1.0) / SAMPLES - 1.0 for side in (across, down)]
    where = mi.Point2f(*(0.5 + 0.5 * dr.mulsign(1.0 - dr.square(1.0 - dr.abs(side)), side) for side in sides))
    weight = 4.0 * (1.0 - dr.abs(sides[0])) * (1.0 - dr.abs(sides[1]))
    wo = plugin.sample(context, met, 0.5, where)[0].wo
    density = plugin.pdf(context, met, wo)
    share = dr.select((wo.z > 0.0) & (density > 0.0), weight * value(met, wo) / density, 0.0)
    return np.array(share).reshape(COSINES, -1).mean(axis=1)


@functools.cache
def reflected_once(roughness: float) -> np.ndarray:
    """(COSINES,) how much microfacets that reflect everything, and mask both ways together, reflect once."""
    mi, distribution = mitsuba(), _microfacets_of(roughness)

    def value(met: Any, wo: Any) -> Any:
        return _white(roughness).eval(mi.BSDFContext(), met, wo).x * _masked_together(distribution, met.wi, wo)

    return _share_reflected(roughness, value)


class _Table:
    """Values at cosines from 0 to 1, in Mitsuba."""

    def __init__(self, values: np.ndarray) -> None:
        self._mi, self._dr = mitsuba(), importlib.import_module("drjit")
        self._values = self._mi.Float(values.astype(np.float32))

    def at(self, _cosine: Any) -> Any:
        """Between two values."""
        mi, dr = self._mi, self._dr
        place = dr.clip(dr.abs(_cosine), 0.0, 1.0) * (COSINES - 1)
        left = dr.minimum(mi.UInt32(place), COSINES - 2)
        ends = [dr.gather(mi.Float, self._values, left + i) for i in range(2)]
        return dr.lerp(*ends, place - mi.Float(left))


@functools.cache
def _register() -> None:
    mi = mitsuba()
    mi.register_bsdf(NAME, _two_plugins(mi, importlib.import_module("drjit")))


def _two_plugins(mi: Any, dr: Any) -> Any:
    """A maker of BSDFs of a plugin for lights, with or without a base beneath it, and one for mirrored rays."""

    class TwoPlugins(mi.BSDF):  # type: ignore[misc]
        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self._lights: Any = properties["lights"]
            self._rays: Any = properties["rays"] if "rays" in properties else None
            self._base: Any = properties["base"] if "base" in properties else None
            self._is_layered = "roughness" in properties
            if self._is_layered:
                roughness = float(properties["roughness"])
                self._distribution, self._low = _microfacets_of(roughness), mi.Color3f(properties["low"])
                self._once = _Table(reflected_once(roughness))
            if self._base is not None:
                context = mi.BSDFContext()
                mirrored = _share_reflected(roughness, lambda met, wo: self._mirrored(context, met, wo).x)
                self._left = _Table(1.0 - mirrored)
            flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [flags]
            self.m_flags = flags

        def eval(self, context: Any, met: Any, wo: Any, active: Any = True) -> Any:
            if not self._is_layered:
                return self._lights.eval(context, met, wo, active)
            value = self._mirrored(context, met, wo, active)
            if self._base is not None:
                value += self._left.at(met.wi.z) * self._base.eval(context, met, wo, active)
            return value

        def _mirrored(self, context: Any, met: Any, wo: Any, active: Any = True) -> Any:
            """What microfacets reflect once, masked together, and what they reflect more often (E. Turquin, "Practical
            multiple scattering compensation for microfacet models", 2019, equation 16)."""
            once = self._lights.eval(context, met, wo, active)
            side = mi.Vector3f(1.0, 1.0, dr.sign(met.wi.z))
            again = 1.0 + self._low * (dr.rcp(self._once.at(met.wi.z)) - 1.0)
            return once * _masked_together(self._distribution, met.wi * side, wo * side) * again

        def sample(self, context: Any, met: Any, one: Any, two: Any, active: Any = True) -> Any:
            """The mirrored ray and how much it counts; no random choice is made."""
            if self._rays is None:
                return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)
            mirrored = mi.BSDFContext()
            mirrored.type_mask = int(mi.BSDFFlags.DeltaReflection)
            return self._rays.sample(mirrored, met, one, two, active)

    return TwoPlugins
