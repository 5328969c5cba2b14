"""The comparison of lights with Mitsuba, where it is."""

import dataclasses

import pytest
from light_comparison import LIGHTS, compared, lit_things


@pytest.mark.usefixtures("with_mitsuba")
@pytest.mark.parametrize("name", ["sphere", "rectangle beside things"])
def test_means_are_mitsubas(name: str) -> None:
    """The tool asks for 1%; in a small picture edges count for more, as ours has a ray through each pixel's middle."""
    scene = lit_things(LIGHTS[name])
    scene = scene.with_camera(dataclasses.replace(scene.camera, width=144, height=96))
    found = compared(name, scene, 128)
    assert abs(found.all) < 0.02 and abs(found.penumbra) < 0.04 and found.penumbra_pixels > 100
