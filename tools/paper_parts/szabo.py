"""Szabo, "Adaptive Tessellation in Screen Space Curved Reflections" (2013): Figs. 8 and 9."""

from __future__ import annotations

from ldtrefl.methods import find_method

from .table import Cell, Table
from .tessellated import picture

HARDWARE = "Intel Core2Duo, NVIDIA GeForce GTX 260"
SCENE = "paper/tablecloth"
LEVELS = 4
"""Rounds of its Fig. 7."""

QUICK_LEVELS = 2
THRESHOLDS = {
    1.0: "no tessellation",
    0.1: "too high",
    0.01: "perfectly acceptable from 0.1 to 0.01",
    0.001: "finer than is needed",
    0.0: "full tessellation",
}
"""Of its Fig. 8, with its words."""

OURS = float(find_method("tessellation").options()["threshold"][0])
"""The threshold of ``tessellation`` if nothing is said."""

ADAPTIVE = 0.001
"""The threshold for Fig. 9, which does not say its own."""


def tables(quick: bool) -> list[Table]:
    """Both figures."""
    return [_by_threshold(quick), _by_level(quick)]


def _by_threshold(quick: bool) -> Table:
    levels = QUICK_LEVELS if quick else LEVELS
    rows: list[list[Cell]] = []
    for threshold, said in sorted({**THRESHOLDS, OURS: "-"}.items(), reverse=True):
        found = picture(SCENE, quick, threshold, levels)
        rows.append([f"{threshold:g}", said, found.ssim, found.vertices, found.milliseconds, found.holes])
    text = (
        f"`scenes/{SCENE}.toml` by `tessellation` with the paper's rule of subdivision, up to {levels} levels. Theirs "
        "is a row of pictures, of which the text says what stands here. SSIM is that over the ball, against one "
        "reflection by the ray caster; vertices are those searched for, each time an edge asks for its middle; "
        "milliseconds are those of placing and drawing them, once; holes are pixels."
    )
    columns = ["threshold", "theirs", "ours: SSIM", "vertices", "ms", "holes"]
    return Table("Szabo, Fig. 8: quality by threshold", HARDWARE, text, columns, rows)


def _by_level(quick: bool) -> Table:
    most = QUICK_LEVELS if quick else LEVELS
    rows: list[list[Cell]] = []
    for level in range(most + 1):
        full, none = picture(SCENE, quick, 0.0, level), picture(SCENE, quick, 1.0, 0)
        adaptive = picture(SCENE, quick, ADAPTIVE, level)
        share = adaptive.vertices / full.vertices
        rows.append([level, full.vertices, adaptive.vertices, none.vertices, share, full.ssim, adaptive.ssim])
    text = (
        f"The same scene; adaptive is threshold {ADAPTIVE:g}. Theirs is a plot, which says that adaptive tessellation "
        "needs fewer vertices than full."
    )
    columns = ["level", "full", "adaptive", "none", "adaptive / full", "SSIM of full", "of adaptive"]
    return Table("Szabo, Fig. 9: vertices by level of tessellation", HARDWARE, text, columns, rows)
