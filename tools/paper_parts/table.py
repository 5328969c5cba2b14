"""A table of figures, theirs beside ours, as Markdown and as JSON have it."""

from __future__ import annotations

from dataclasses import dataclass

Cell = str | int | float | None
"""A name, a figure, or None where a paper prints none or we have none."""

GEFORCE_7800 = "NVIDIA GeForce 7800"
"""The GPU of three of the papers."""


@dataclass(frozen=True)
class Table:
    """What a paper prints, and what is found here."""

    title: str
    hardware: str
    """Theirs; "" where the table is ours alone."""
    text: str
    """How the figures were made, and where the two differ."""
    columns: list[str]
    rows: list[list[Cell]]


def markdown(table: Table) -> str:
    """The section of a page."""
    head = [f"## {table.title}", ""]
    head += [f"Theirs: {table.hardware}.", ""] if table.hardware else []
    lines = [table.columns, ["---"] * len(table.columns), *([shown(cell) for cell in row] for row in table.rows)]
    return "\n".join([*head, table.text, "", *(f"| {' | '.join(line)} |" for line in lines), ""])


def shown(cell: Cell) -> str:
    """A cell as it is printed: figures with three digits and more, those between 0 and 1 with four places."""
    if cell is None:
        return "-"
    if isinstance(cell, float):
        return f"{cell:.4f}" if abs(cell) < 1.0 else f"{cell:.1f}" if abs(cell) < 1000.0 else f"{cell:,.0f}"
    return f"{cell:,}" if isinstance(cell, int) else cell
