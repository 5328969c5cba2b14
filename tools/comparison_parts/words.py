"""Words and numbers as HTML."""

from __future__ import annotations

import html
import re


def escaped(text: str) -> str:
    """A text as it is, with what stands between backquotes as code."""
    return re.sub(r"(`{1,2})(.+?)\1", r"<code>\2</code>", html.escape(text, quote=True))


def paragraphs(text: str) -> str:
    """Paragraphs with empty lines between, and lists of which each item begins with "- "."""
    found = []
    for block in re.split(r"\n\s*\n", text.strip()):
        before, *items = re.split(r"^- ", block, flags=re.MULTILINE)
        if before.strip():
            found.append(f"<p>{escaped(' '.join(before.split()))}</p>")
        if items:
            listed = [f"<li>{escaped(' '.join(item.split()))}</li>" for item in items]
            found.append(f"<ul>{''.join(listed)}</ul>")
    return "".join(found)


def number(value: float | None, form: str) -> str:
    """A number in Python's format ``form``; a dash if there is none."""
    if value is None or value != value:
        return "-"
    return "∞" if value == float("inf") else format(value, form)


def milliseconds(value: float) -> str:
    """Three digits or all that stand before the point."""
    return number(value, ".0f" if value >= 100 else ".1f" if value >= 10 else ".2f")


def megabytes(value: float) -> str:
    """Millions of bytes."""
    return number(value / 1e6, ".0f" if value >= 1e7 else ".1f")


def ratio(value: float) -> str:
    """How many times as large."""
    return number(value, ".0f" if value >= 100 else ".1f" if value >= 10 else ".2f")
