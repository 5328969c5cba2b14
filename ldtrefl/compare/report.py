"""What a comparison with the true frame says: every metric, as a table and as ``compare.json``."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.table import Table

from ldtrefl.compare.metrics import all_metrics
from ldtrefl.compare.metrics.base import Comparison
from ldtrefl.files.atomic_write import written_whole
from ldtrefl.frame.result import Frame
from ldtrefl.renderer import Renderer
from ldtrefl.scene.description import Scene

TEXEL_RESOLUTION = 256
"""Resolution of the maps whose texel is the unit of distance errors, for methods that have no such maps."""


@dataclass(frozen=True)
class Row:
    """What is reported of one method."""

    seconds: Mapping[str, float]
    """Per stage of the frame."""
    errors: Mapping[str, float]
    """Metric -> value; metrics that need what the method lacks are left out."""


def timed_frame(
    scene: Scene, method: str, device: str | None = None, options: Mapping[str, object] | None = None
) -> tuple[Renderer, Frame]:
    """A frame whose times hold every stage but compiling, and the renderer that made it.

    A first frame, by a renderer of its own, compiles the kernels and is thrown away.

    Raises:
        InputError: an unknown method, option or device, or a value that is not allowed.
    """
    Renderer(scene, method, device, **(options or {})).render()
    renderer = Renderer(scene, method, device, **(options or {}))
    return renderer, renderer.render()


def compared(frame: Frame, truth: Frame, renderer: Renderer, resolution: int = TEXEL_RESOLUTION) -> Row:
    """Every metric of a frame.

    Args:
        frame: the last frame that ``renderer`` made.
        truth: the true frame of the same scene and camera.
        renderer: the one that made ``frame``.
        resolution: of the method's maps, whose texel is the unit of distance errors.
    """
    texels = renderer.texel_sizes(resolution)
    mask, has_hits = truth.reflector_mask, frame.hits is not None and truth.hits is not None
    gbuffer = renderer.gbuffer if has_hits else None
    comparison = Comparison(frame.image, truth.image, mask, frame.hits, truth.hits, texels, gbuffer)
    values = {metric.name: metric.of(comparison) for metric in all_metrics()}
    return Row(frame.stats.seconds, {name: value for name, value in values.items() if value is not None})


def error_table(rows: Mapping[str, Row], title: str) -> Table:
    """A line a method, a column a metric that has a heading; ``-`` where a method lacks what the metric needs."""
    shown = [metric for metric in all_metrics() if metric.heading is not None]
    table = Table(title=title)
    for heading in ("method", "seconds", "stages", *(metric.heading for metric in shown)):
        justify = "left" if heading in ("method", "stages") else "right"
        table.add_column(heading, justify=justify, overflow="fold")  # type: ignore[arg-type]
    for name, row in rows.items():
        stages = " ".join(f"{stage} {seconds:.3f}" for stage, seconds in row.seconds.items())
        values = [format(row.errors[m.name], m.format) if m.name in row.errors else "-" for m in shown]
        table.add_row(name, f"{sum(row.seconds.values()):.3f}", stages, *values)
    return table


def write_json(path: Path, scene: str, reference: str, rows: Mapping[str, Row]) -> None:
    """Write ``compare.json``: the scene's file, the reference's name, and of each method seconds per stage and errors.

    JSON has no infinity and no NaN: null stands for them.

    Raises:
        InputError: the file cannot be written.
    """
    report: dict[str, object] = {"scene": scene, "reference": reference}
    for name, row in rows.items():
        errors = {key: value if np.isfinite(value) else None for key, value in row.errors.items()}
        report[name] = {"seconds": dict(row.seconds), **errors}
    with written_whole(path) as scratch:
        scratch.write_text(json.dumps(report) + "\n")
