"""What a comparison with the true frame says: every metric and the errors of every bounce, as tables and as
``compare.json``."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.table import Table

from ldtrefl.compare.bounces import BounceErrors, errors_by_bounce
from ldtrefl.compare.metrics import all_metrics
from ldtrefl.compare.metrics.base import Comparison
from ldtrefl.files.atomic_write import written_whole
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.result import Frame


@dataclass(frozen=True)
class Row:
    """What is reported of one method."""

    seconds: Mapping[str, float]
    """Per stage of the frame."""
    errors: Mapping[str, float]
    """Metric -> value; metrics that need what the method lacks are left out."""
    bounces: tuple[BounceErrors, ...] = ()
    """Of the reflected rays; empty for methods without rays."""


def compared(frame: Frame, truth: Frame, texel_sizes: np.ndarray, gbuffer: GBuffer | None) -> Row:
    """Every metric of a frame, and the errors of its bounces.

    Args:
        frame: the method's.
        truth: the true frame of the same scene and camera.
        texel_sizes: (objects,) world units: the length of a texel of each object's maps, the unit of distance errors.
        gbuffer: what the camera saw; may be None for methods without rays.
    """
    mask = truth.reflector_mask
    comparison = Comparison(frame.image, truth.image, mask, frame.hits, truth.hits, texel_sizes, gbuffer)
    values = {metric.name: metric.of(comparison) for metric in all_metrics()}
    errors = {name: value for name, value in values.items() if value is not None}
    if frame.hits is None or truth.hits is None:
        return Row(frame.stats.seconds, errors)
    return Row(frame.stats.seconds, errors, errors_by_bounce(frame.hits, truth.hits, texel_sizes, mask))


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
    """Write ``compare.json``: the scene's file, the reference's name, and of each method seconds per stage, errors, and
    the errors of each bounce.

    JSON has no infinity and no NaN: null stands for them.

    Raises:
        InputError: the file cannot be written.
    """
    report: dict[str, object] = {"scene": scene, "reference": reference}
    for name, row in rows.items():
        errors = {key: value if np.isfinite(value) else None for key, value in row.errors.items()}
        bounces = {"bounces": [dataclasses.asdict(bounce) for bounce in row.bounces]} if row.bounces else {}
        report[name] = {"seconds": dict(row.seconds), **errors, **bounces}
    with written_whole(path) as scratch:
        scratch.write_text(json.dumps(report) + "\n")
