"""Zhang, Hsieh and Shen, "Real-Time Reflections Using Layered Depth Textures": Tables 1 and 2."""

from __future__ import annotations

from benchmark_parts.paper import TABLE_1_COLUMNS, TABLE_2_COLUMNS, paper_tables, table_1_rows, table_2_rows

from .table import GEFORCE_7800, Table

HARDWARE = f"2.19 GHz Intel, {GEFORCE_7800}"
ROUNDS = 7
QUICK_ROUNDS = 2


def tables(quick: bool) -> list[Table]:
    """Both tables."""
    found = paper_tables(quick, QUICK_ROUNDS if quick else ROUNDS)
    return [
        Table(
            "Zhang et al., Table 1: layers, and milliseconds to peel a model",
            HARDWARE,
            "Where we do not have a model another stands for it. Ours are six maps of 256 x 256 texels.",
            TABLE_1_COLUMNS,
            [list(row) for row in table_1_rows(found)],
        ),
        Table(
            "Zhang et al., Table 2: milliseconds for reflections",
            HARDWARE,
            "Pictures of 768 x 512. Of ours culling, searching and shading count, with one sample of each pixel.",
            TABLE_2_COLUMNS,
            [list(row) for row in table_2_rows(found)],
        ),
    ]
