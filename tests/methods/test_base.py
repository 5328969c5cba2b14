"""The contract of a method, by a toy without rays that paints the normal: options, shadows, what is asked and when."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import pytest
import warp as wp
from pydantic import Field
from pydantic.dataclasses import dataclass

import ldtrefl
from ldtrefl import methods
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.skip_options import skip_names
from ldtrefl.methods.base import CONFIG, CommonConfig, RaylessMethod, RayMethod
from ldtrefl.scene.description import Light, Lighting
from ldtrefl.tracing.scene_bvh import SceneBvh
from tests.frame import flat_mirror


class PaintedNormal(RaylessMethod):
    """The normal of the reflector as a colour.

    This line is not part of the description.
    """

    name = "normal"

    @dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(CommonConfig):
        """Options of ``normal``."""

        gain: Annotated[float, Field(gt=0.0, le=8.0)] = 1.0
        """What the colour is
        multiplied by."""

    config: Config
    asked: list[str]
    """What was asked of all methods of this class, in order."""

    def foresee(self, gbuffer: GBuffer, stats: Stats) -> None:
        self.asked.append("foresee")

    def reflect(self, gbuffer: GBuffer, stats: Stats) -> wp.array:
        self.asked.append("reflect")
        normal = gbuffer.surfaces[1].numpy()[gbuffer.reflector_pixels.numpy()]
        return wp.array(self.config.gain * (0.5 + 0.5 * normal), dtype=wp.vec3, device=self.scene.device)


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    found = {**methods.all_methods(), PaintedNormal.name: PaintedNormal}
    monkeypatch.setattr(methods, "all_methods", lambda: found)
    monkeypatch.setattr(PaintedNormal, "asked", [], raising=False)


def test_a_method_without_rays_paints_the_reflectors_pixels() -> None:
    """The ground faces +z: its reflection is (0.5, 0.5, 1), times the gain."""
    given = flat_mirror.scene()
    frame = ldtrefl.render(given, "normal", gain=2.0)
    mask = frame.reflector_mask
    assert mask.ravel()[flat_mirror.reflection(given).pixels].all() and mask.sum() > 500
    np.testing.assert_allclose(frame.reflection[mask], np.tile([1.0, 1.0, 2.0], (mask.sum(), 1)), rtol=1e-6)
    assert (frame.reflection[~mask] == 0.0).all()
    expected = flat_mirror.GROUND_DIRECT + flat_mirror.GROUND_MIRROR * [1.0, 1.0, 2.0]
    np.testing.assert_allclose(frame.image[mask], np.tile(expected, (mask.sum(), 1)), rtol=1e-6)
    assert frame.hits is None and frame.stats.counters["rays"] == 0
    assert PaintedNormal.asked == ["reflect"], "without shadows nothing is foreseen"


def test_its_shadows_are_the_renderers() -> None:
    light = Light(kind="directional", direction=(0.2, 0.3, -1), radiance=(2, 2, 2))
    lit = flat_mirror.scene(lights=(light,), lighting=Lighting(shadows=True))
    frame, truth = ldtrefl.render(lit, "normal"), ldtrefl.render(lit, "bvh")
    unlit = ldtrefl.render(flat_mirror.scene(lights=(light,)), "normal")
    assert PaintedNormal.asked == ["foresee", "reflect", "reflect"]
    # Direct light is the image without what is reflected; white ground and a light of 2 leave what rounds to 1e-6.
    mask = truth.reflector_mask
    direct = [made.image - flat_mirror.GROUND_MIRROR * made.reflection for made in (frame, truth)]
    np.testing.assert_allclose(direct[0][mask], direct[1][mask], atol=2e-6)
    np.testing.assert_array_equal(frame.image[~mask], truth.image[~mask])
    dark = mask & (np.abs(direct[0]).max(axis=-1) < 0.06)
    assert 50 < dark.sum() < 0.5 * mask.sum() and (unlit.image[mask] > frame.image[mask]).all()


def test_frames_and_moves_of_a_method_without_rays() -> None:
    renderer = ldtrefl.Renderer(flat_mirror.scene(), "normal")
    first = renderer.render()
    assert renderer.render().stats.counters["frames_kept"] == 1 and PaintedNormal.asked == ["reflect"]
    renderer.move("box", translate=(0.6, 0.2, 1.0))
    moved = renderer.render()
    np.testing.assert_array_equal(moved.image, ldtrefl.render(renderer.scene, "normal").image)
    assert (moved.image != first.image).any()


def test_nothing_is_asked_where_no_reflector_is_seen() -> None:
    away = ldtrefl.Camera(eye=(0, -5, 1), look_at=(0, -9, 1), width=8, height=8)
    frame = ldtrefl.render(flat_mirror.scene(camera=away), "normal")
    assert PaintedNormal.asked == [] and not frame.reflection.any()


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({"gian": 2.0}, r"unknown option of method normal 'gian'; did you mean 'gain'\?"),
        ({"resolution": 64}, r"unknown option of method normal 'resolution'"),
        ({"gain": -1.0}, r"method normal: gain: .*greater than 0, got -1"),
        ({"skip": "bound"}, r"method normal: skip: unknown skip 'bound'; did you mean 'bounds'\?"),
        ({"skip": 3}, r"method normal: skip: expected all, none, or names \(.*\), got 3"),
    ],
    ids=str,
)
def test_wrong_options_are_refused_in_one_line(options: dict[str, object], line: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=f"^{line}") as caught:
        ldtrefl.render(flat_mirror.scene(), "normal", **options)
    assert "\n" not in str(caught.value)


def test_what_a_method_says_of_itself() -> None:
    assert PaintedNormal.describe() == "The normal of the reflector as a colour."
    options = PaintedNormal.options()
    assert list(options) == ["skip", "samples", "adaptive", "filter_textures", "anisotropy", "gain"]
    assert options["gain"] == (1.0, "What the colour is multiplied by.")
    default, words = options["skip"]
    assert default == "all" and all(name in words for name in skip_names())
    assert PaintedNormal.configured({}).gain == 1.0 and PaintedNormal.configured({"gain": 3}).gain == 3.0
    assert isinstance(PaintedNormal.scene_tracer(PaintedNormal.configured({})), SceneBvh)


@pytest.mark.parametrize("name", sorted(methods.all_methods()))
def test_every_method_describes_itself_and_its_options(name: str) -> None:
    method = methods.find_method(name)
    assert method.name == name and method.describe().endswith(".") and issubclass(method.Config, CommonConfig)
    assert issubclass(method, RaylessMethod) != issubclass(method, RayMethod)
    assert "skip" in method.options()
    for option, (default, words) in method.options().items():
        assert words, f"{option} has no words"
        assert getattr(method.configured({}), option) == default
