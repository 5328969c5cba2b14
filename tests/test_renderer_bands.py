"""Large images, which are rendered in bands of rows: the same bits, and a limit on memory."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from stress_cases.histories import difference

import ldtrefl
from ldtrefl import renderer as renderer_module
from ldtrefl.base import budget
from ldtrefl.compare.metrics import reprojection_errors
from ldtrefl.frame import visibility
from ldtrefl.scene.description import Camera, Lighting
from tests.frame_scenes import assert_as_fresh, scene


@pytest.mark.parametrize(
    ("method", "options"),
    [
        ("ldt", {}),
        ("ldt", {"max_bounces": 2}),
        ("ldt", {"search": "linear"}),
        ("bvh", {}),
        ("envmap", {"resolution": 64}),
        ("envmap", {"resolution": 64, "projection": "layered"}),
    ],
    ids=str,
)
def test_a_large_image_in_bands_has_the_same_bits(
    method: str, options: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    light = ldtrefl.Light(kind="directional", direction=(0.3, 0.2, -1), radiance=(2, 2, 2))
    # The camera stands between things, so that triangles cross its plane, and the last band is a short one.
    camera = Camera(eye=(0.2, -2.2, 0.3), look_at=(0, 0, 0), width=120, height=91, fov_y=100, up=(0.2, 0.1, 1))
    lit = scene(camera=camera, lights=(light,), lighting=Lighting(shadows=True))
    whole = ldtrefl.Renderer(lit, method, **options)
    truth = whole.render()
    assert whole.gbuffer is not None
    monkeypatch.setattr(renderer_module, "LARGEST_WHOLE", 5000)
    monkeypatch.setattr(visibility, "BAND_PIXELS", 2000)
    renderer = ldtrefl.Renderer(lit, method, **options)
    frame = renderer.render()
    assert difference(frame, truth) == "" and renderer.gbuffer is not None
    np.testing.assert_array_equal(renderer.gbuffer.triangles, whole.gbuffer.triangles)
    if truth.hits is not None and frame.hits is not None:
        errors = [reprojection_errors(truth.hits, hits, whole.gbuffer) for hits in (truth.hits, frame.hits)]
        assert len(errors[0]) > 100 and len(errors[0]) == len(errors[1]) and not errors[1].any()
    # A frame keeps what it is of, whatever comes after it; a small one after it is right.
    again = renderer.render()
    renderer.move("torus", translate=(-1.2, -1.3, 0.1))
    small = dataclasses.replace(camera, width=60, height=40)
    assert difference(renderer.render(small), ldtrefl.Renderer(renderer.scene, method, **options).render(small)) == ""
    assert difference(again, truth) == ""


def test_a_large_image_keeps_nothing_for_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    renderer = ldtrefl.Renderer(scene(), "ldt")
    renderer.render()
    monkeypatch.setattr(renderer_module, "LARGEST_WHOLE", 5000)
    monkeypatch.setattr(visibility, "BAND_PIXELS", 2000)
    renderer.render()
    assert "frames_kept" not in renderer.render().stats.counters
    kept = vars(renderer._history)
    assert kept["_view"] is not None and kept["_parts"] is kept["_reflected"] is kept["_still"] is None


def test_an_image_that_is_too_large_is_refused_in_a_line() -> None:
    huge = dataclasses.replace(scene().camera, width=16384, height=16384)
    renderer = ldtrefl.Renderer(scene(), "ldt")
    budget.set_memory_limit(1 << 30)
    with pytest.raises(ldtrefl.InputError, match=r"an image of 16384 x 16384 pixels needs 3\.\d GiB.*camera\.width"):
        renderer.render(huge)
    budget.set_memory_limit()
    assert_as_fresh(renderer, renderer.render())
