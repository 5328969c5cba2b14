"""Ray against layered depth texture: the searches there are."""

from __future__ import annotations

from ldtrefl.ldt.exact.walk import EXACT
from ldtrefl.ldt.linear.march import LINEAR

TRACERS = {tracer.name: tracer for tracer in (EXACT, LINEAR)}
"""By the name that the option ``search`` takes."""
