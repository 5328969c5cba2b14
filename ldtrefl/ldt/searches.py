"""The searches for a ray in a layered depth texture, by name: each is a tracer."""

from __future__ import annotations

from ldtrefl.ldt.exact.walk import EXACT
from ldtrefl.ldt.linear.march import LINEAR

TRACERS = {tracer.name: tracer for tracer in (EXACT, LINEAR)}
"""Each search by the name that the option ``search`` takes."""
