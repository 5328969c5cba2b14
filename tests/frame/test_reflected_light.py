"""A method's answer: what it holds beside the radiance, for methods with rays and without."""

import dataclasses

import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.reflected_light import ReflectedLight


def test_an_answer_without_rays_is_radiance_alone() -> None:
    radiance = wp.zeros(3, dtype=wp.vec3, device=launch.resolve_device(None))
    answers = [ReflectedLight(radiance) for _ in range(2)]
    assert answers[0].radiance is radiance and answers[0].hits is None and answers[0].followed is None
    assert answers[0].resolutions == {} and answers[0].resolutions is not answers[1].resolutions
    assert answers[0] != answers[1], "answers are told apart by what they are, not by what they hold"
    with pytest.raises(dataclasses.FrozenInstanceError):
        answers[0].radiance = radiance  # type: ignore[misc]
