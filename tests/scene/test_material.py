"""Materials of the scene: what was given and what was not."""

from dataclasses import replace

import pytest

from ldtrefl.scene.description import Material
from ldtrefl.scene.material import is_given


def test_a_colour_that_was_not_given_is_known_whatever_its_value() -> None:
    assert not is_given(Material().emission) and is_given(Material(emission=0.0).emission)
    assert not is_given(Material().albedo) and is_given(Material(albedo=0.8).albedo)
    assert not is_given(replace(Material(), mirror=(1.0, 1.0, 1.0)).albedo)


@pytest.mark.parametrize(
    "change", [{"albedo": 0.8}, {"emission": 0.0}, {"mirror": 0.1}, {"fresnel": True}, {"double_sided": True}], ids=str
)
def test_the_key_tells_what_was_given(change: dict) -> None:
    assert Material().key == Material().key and Material(**change).key != Material().key
