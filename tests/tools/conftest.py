"""What tests of tools share."""

import pytest
from mitsuba_parts.mitsuba_scene import mitsuba

import ldtrefl


@pytest.fixture
def with_mitsuba() -> None:
    """Skips the test where Mitsuba cannot be used."""
    try:
        mitsuba()
    except ldtrefl.InputError as error:
        pytest.skip(str(error))
