"""The searches there are, by name."""

from ldtrefl.ldt.options import DEFAULT_SEARCH
from ldtrefl.ldt.searches import TRACERS


def test_every_search_is_found_by_its_name() -> None:
    assert set(TRACERS) == {"exact", "linear"} and DEFAULT_SEARCH in TRACERS
    assert all(tracer.name == name for name, tracer in TRACERS.items())
