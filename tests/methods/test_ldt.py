"""The method ``ldt``: how fine its maps are, and that what it skips changes no bit."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from stress_cases.histories import difference

import ldtrefl
from ldtrefl.scene.description import Lighting, Object
from tests.frame_scenes import MIRROR, scene


def test_finer_maps_of_frames_before_change_nothing() -> None:
    near = dataclasses.replace(scene().camera, eye=(0.2, -1.6, 0.3), fov_y=20.0)
    renderer = ldtrefl.Renderer(scene(), "ldt", error=2.0)
    first, close = renderer.render(), renderer.render(near)
    assert close.stats.counters["objects_peeled"] > 0, "the near camera needs finer maps"
    assert difference(renderer.render(), first) == ""


def test_with_shadows_maps_are_as_fine_as_what_is_seen() -> None:
    """A far camera sees neither reflections nor shadows finer than its pixels."""
    light = ldtrefl.Light(kind="directional", direction=(0.3, 0.2, -1), radiance=(2, 2, 2))
    lit = scene(lights=(light,), lighting=Lighting(shadows=True))
    far = dataclasses.replace(lit.camera, eye=(0, -60, 20), fov_y=10.0)
    small = ldtrefl.Renderer(lit, "ldt", error=4.0).render(far)
    usual = ldtrefl.Renderer(lit, "ldt").render(far)
    meshes = len(lit.objects)
    assert small.stats.counters["objects_peeled"] == usual.stats.counters["objects_peeled"] == meshes, "each once"
    assert small.stats.counters["map_bytes"] < 0.5 * usual.stats.counters["map_bytes"]
    finest = ldtrefl.Renderer(lit, "ldt", error=0.01).render(far)
    np.testing.assert_array_equal(finest.image, usual.image)


@pytest.mark.parametrize("options", [{"error": 1.0}, {"error": 1.0, "max_bounces": 3}], ids=str)
@pytest.mark.parametrize("skip", ["bounds", "bounds,maps", "bounds,regions,attributes"])
def test_resolutions_do_not_depend_on_what_is_skipped(skip: str, options: dict[str, Any]) -> None:
    whole = scene(
        objects=(
            *scene().objects,
            Object(name="ring", shape="torus", scale=0.4, translate=(0.8, -2.0, 0.5), material=MIRROR),
        )
    )
    assert difference(ldtrefl.render(whole, "ldt", skip=skip, **options), ldtrefl.render(whole, "ldt", **options)) == ""


@pytest.mark.parametrize("shadows", [False, True])
def test_coarse_maps_hide_nothing_from_the_search_by_bounds(shadows: bool) -> None:
    """Patches of coarse maps stick out of the bounding sphere of their object; no skip may miss a hit on them."""
    rng = np.random.default_rng(4)
    dense = (("sphere", (400, 200)), ("torus_knot", (400, 40)), ("torus", (300, 100)))
    for error in (1.0, 8.0, 32.0):
        things = tuple(
            Object(
                shape=shape,
                params={"segments": segments},
                scale=float(rng.uniform(0.2, 0.6)),
                translate=tuple((rng.uniform(-1.8, 1.8, 3) - [0, 1, 0]).tolist()),
            )
            for shape, segments in dense
        )
        mirrors = (
            Object(shape="sphere", material=MIRROR),
            Object(shape="sphere", scale=0.5, translate=(1.6, 0.3, 0.2), material=MIRROR),
        )
        seen = scene(objects=(*mirrors, *things), lighting=Lighting(shadows=shadows))
        frames = [ldtrefl.render(seen, "ldt", error=error, skip=skip) for skip in ("all", "none", "bounds", "regions")]
        for other in frames[1:]:
            np.testing.assert_array_equal(frames[0].image, other.image)
