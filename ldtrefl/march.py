"""Ray against layered depth texture: the searches there are."""

from __future__ import annotations

from ldtrefl.march_linear import LINEAR
from ldtrefl.tree_walk import EXACT

TRACERS = {tracer.name: tracer for tracer in (EXACT, LINEAR)}
"""By the name that the option ``search`` takes."""
