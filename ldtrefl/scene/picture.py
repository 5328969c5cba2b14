"""How a scene's picture is developed from its radiance."""

from __future__ import annotations

from pydantic.dataclasses import dataclass

from ldtrefl.base.checked import CONFIG, refusing_in_one_line
from ldtrefl.files.tone_mapping import Exposure, ToneMapping


@refusing_in_one_line
@dataclass(frozen=True, kw_only=True, config=CONFIG)
class Picture:
    """What a display shows of radiance. It changes no radiance: ``Frame.image`` and EXR files are the same."""

    exposure: Exposure = 0.0
    """Stops: each shows everything twice as bright."""
    tone_mapping: ToneMapping = "none"
    """none (cut off at 1), agx (as Blender 4) or aces (ACES 1.3)."""
