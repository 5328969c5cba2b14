"""The page: one file of HTML with its style, its script and all pictures in it."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from .entries import TRUTH, Entry
from .measuring import SLOW, Figures, Outcome, SceneOutcome
from .pictures import GAIN, difference_uri, picture_uri
from .summary import EXACT, GOOD, Overall, fastest, overall, wins
from .words import escaped, megabytes, milliseconds, number, paragraphs, ratio

FOLDER = Path(__file__).parent

OVERALL_COLUMNS = (
    "method",
    "scenes",
    "SSIM, median",
    "worst",
    "to one reflection, median",
    "worst",
    f"first frame / {TRUTH}",
    f"later frame / {TRUTH}",
    "memory, MB",
    "worst in",
)

SCENE_COLUMNS = (
    "method",
    "first frame, ms",
    "later frame, ms",
    "memory kept, MB",
    "at most, MB",
    "SSIM",
    "to one reflection",
    "FLIP",
    "wrong hits, %",
)


@dataclass(frozen=True)
class Circumstances:
    """What the figures hold for."""

    machine: str
    threads: int
    size: tuple[int, int]
    missing: tuple[str, ...]
    """Scenes that are left out, and why."""


def page(outcomes: Sequence[SceneOutcome], entries: Sequence[Entry], circumstances: Circumstances) -> str:
    """The whole page."""
    rows = [row for entry in entries if (row := overall(outcomes, entry))]
    links = "".join(f'<a href="#{_anchor(each.name)}">{html.escape(each.name)}</a>' for each in outcomes)
    parts = [
        "<h1>Mirror reflections by every method</h1>",
        _introduction(outcomes, circumstances),
        _answers(outcomes, entries, rows),
        "<h2>All methods over all scenes</h2>",
        _overall_table(rows, len(outcomes)),
        "<h2>What each fails at by design</h2>",
        _failings(entries),
        f"<h2>Scene by scene</h2><nav>{links}</nav>",
        *(_scene(each) for each in outcomes),
    ]
    style, script = ((FOLDER / name).read_text() for name in ("page.css", "page.js"))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">'
        f"<title>Mirror reflections by every method</title>\n<style>\n{style}</style></head>\n<body>\n"
        + "\n".join(parts)
        + f"\n<script>\n{script}</script>\n</body></html>\n"
    )


def _introduction(outcomes: Sequence[SceneOutcome], circumstances: Circumstances) -> str:
    width, height = circumstances.size
    missing = "".join(f"<br>Left out: {escaped(line)}" for line in circumstances.missing)
    return (
        f"<p>{len(outcomes)} scenes. The truth is <code>{TRUTH}</code>, ray casting over all triangles. SSIM, FLIP and "
        "wrong hits are of the pixels that see a mirror: SSIM 1 and FLIP 0 are equal to the truth. Methods that know "
        "one reflection only are held, besides, against a truth with one.</p>"
        f'<p class="quiet">Pictures within {width} x {height} pixels, one sample each. First frame: from a scene in '
        "memory to its picture, with all that is built for it. Later frame: the median of three more, the camera "
        "moved a little before each, all methods in turn; of methods whose first frame took more than "
        f"{SLOW / 1000:g} s, the first. Memory: what the process grows by in a first frame. "
        f"{html.escape(circumstances.machine)}; {circumstances.threads} threads.{missing}</p>"
    )


def _answers(outcomes: Sequence[SceneOutcome], entries: Sequence[Entry], rows: Sequence[Overall]) -> str:
    """What most readers come for."""
    count = len(outcomes)

    def named(those: Iterable[Overall]) -> str:
        taken = {row.label: "" if row.scenes == count else f" (takes {row.scenes} of {count})" for row in those}
        return ", ".join(_code(label) + words for label, words in taken.items()) or "none"

    exact = [row for row in rows if row.worst >= EXACT and row.label != TRUTH]
    but_for_more = [row for row in rows if row not in exact and (row.worst_of_one or 0.0) >= EXACT]
    kinds = {"first frame": lambda figures: figures.first, "later frames": lambda figures: figures.later}
    fast = [
        f"{kind}: " + ", ".join(f"{_code(label)} in {times}" for label, times in wins(outcomes, milliseconds_of))
        for kind, milliseconds_of in kinds.items()
    ]
    purposes = {entry.method.name: entry for entry in reversed(entries)}
    needs = [
        f"<li>{_code(name)}: {escaped(entry.purpose)}{_refused(entry, outcomes)}</li>"
        for name, entry in sorted(purposes.items())
    ]
    return (
        '<dl class="answers"><dt>Which method is exact?</dt>'
        f"<dd>{_code(TRUTH)}, by definition. With SSIM of {EXACT:g} or more in all scenes that it takes: "
        f"{named(exact)}; but for reflections of reflections: {named(but_for_more)}.</dd>"
        f"<dt>Which is fastest at SSIM {GOOD:g} or more?</dt>"
        f"<dd>Of {count} scenes, {'; '.join(fast)}.</dd>"
        "<dt>When to choose which, and what does each need of its mirrors?</dt>"
        f"<dd><ul>{''.join(needs)}</ul></dd></dl>"
    )


def _refused(entry: Entry, outcomes: Sequence[SceneOutcome]) -> str:
    count = sum(bool(outcome.by_label[entry.label].refusal) for outcome in outcomes)
    return f' <span class="quiet">Refuses {count} of the {len(outcomes)} scenes.</span>' if count else ""


def _overall_table(rows: Sequence[Overall], scenes: int) -> str:
    lines = []
    for row in rows:
        cells = [
            f"{row.scenes} of {scenes}",
            *(number(value, ".4f") for value in (row.median, row.worst, row.median_of_one, row.worst_of_one)),
            ratio(row.first),
            ratio(row.later),
            megabytes(row.peak),
        ]
        worst = f'<td class="words"><a href="#{_anchor(row.worst_in)}">{html.escape(row.worst_in)}</a></td>'
        lines.append(_row(row.label, cells, worst))
    return _table(OVERALL_COLUMNS, lines)


def _failings(entries: Sequence[Entry]) -> str:
    """What methods' files say: once of methods of which the same is said."""
    labels: dict[tuple[str, str], list[str]] = {}
    for entry in entries:
        for words in filter(None, entry.failings):
            labels.setdefault((entry.method.name, words), []).append(_code(entry.label))
    parts = [
        f"<article><h3>{', '.join(those)}</h3>{paragraphs(words)}</article>" for (_, words), those in labels.items()
    ]
    return f'<div class="methods">{"".join(parts)}</div>'


def _scene(outcome: SceneOutcome) -> str:
    shown = {label: found for label, found in outcome.by_label.items() if found.figures is not None}
    truth = shown[TRUTH].picture
    best = fastest(outcome, lambda figures: figures.later)
    rows = [_figures(label, found.figures, label == best) for label, found in shown.items() if found.figures]
    cards = "".join(_card(label, found, outcome) for label, found in outcome.by_label.items())
    height, width = truth.shape[:2]
    note = f"Green: the fastest in later frames of those with SSIM {GOOD:g} or more. Wrong hits: reflected rays that "
    note += "end on another object than they should, or wrongly on none or on one, in percent of all."
    return (
        f'<section><h2 id="{_anchor(outcome.name)}">{html.escape(outcome.name)}</h2>'
        f'<p class="quiet">{html.escape(outcome.about)}</p>'
        f'<div class="side">{_wipe(list(shown), width, height)}<div>{_table(SCENE_COLUMNS, rows)}'
        f'<p class="quiet">{note}</p></div></div>'
        '<div class="legend"><span>Difference of luminance: darker than the truth by '
        f"{100 / GAIN:g}% of white</span><i></i><span>brighter by {100 / GAIN:g}%; grey: equal</span></div>"
        f'<div class="sheet">{cards}</div></section>'
    )


def _wipe(labels: list[str], width: int, height: int) -> str:
    """Two pictures over each other; the script fills them in."""
    others = [label for label in labels if label != TRUTH]

    def choice(side: str, chosen: str) -> str:
        options = "".join(f"<option{' selected' if label == chosen else ''}>{label}</option>" for label in labels)
        return f'<label>{side.capitalize()}<select class="{side}">{options}</select></label>'

    return (
        f'<div class="wipe"><div class="choice">{choice("left", TRUTH)}{choice("right", (others or labels)[0])}</div>'
        f'<div class="stage" style="aspect-ratio: {width} / {height}"><img class="right" alt="" draggable="false">'
        '<img class="left" alt="" draggable="false"><div class="edge"></div></div>'
        '<input type="range" min="0" max="100" step="0.5" value="50" aria-label="Where the left picture ends"></div>'
    )


def _card(label: str, found: Outcome, outcome: SceneOutcome) -> str:
    if found.figures is None:
        refusal = f'<div class="refusal">Not made for this scene: {escaped(found.refusal)}</div>'
        return f"<article><h3>{_code(label)}</h3>{refusal}</article>"
    truth = outcome.by_label[TRUTH].picture
    height, width = truth.shape[:2]
    size = f'width="{width}" height="{height}" style="height: auto"'
    name = html.escape(label)
    head = f"<article><h3>{_code(label)}{'' if label != TRUTH else 'the truth'}</h3>"
    words = f"{html.escape(outcome.name)} by {name}"
    head += f'<img data-method="{name}" {size} alt="{words}" src="{picture_uri(found.picture)}">'
    if label == TRUTH:
        return head + "</article>"
    return (
        f'{head}<img {size} alt="its difference from the truth" src="{difference_uri(found.picture, truth)}">'
        f'<span class="quiet">SSIM {number(found.figures.ssim, ".4f")}</span></article>'
    )


def _figures(label: str, figures: Figures, is_best: bool) -> str:
    cells = [
        milliseconds(figures.first),
        milliseconds(figures.later),
        megabytes(figures.kept),
        megabytes(figures.peak),
        number(figures.ssim, ".4f"),
        number(figures.ssim_of_one, ".4f"),
        number(figures.flip, ".4f"),
        number(figures.wrong, ".2f"),
    ]
    return _row(label, cells, is_best=is_best)


def _table(columns: Sequence[str], rows: Sequence[str]) -> str:
    head = "".join(f'<th scope="col"{_of_words(column)}>{escaped(column)}</th>' for column in columns)
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table></div>'


def _of_words(column: str) -> str:
    return ' class="words"' if column == OVERALL_COLUMNS[-1] else ""


def _row(label: str, cells: Sequence[str], last: str = "", is_best: bool = False) -> str:
    best = ' class="best"' if is_best else ""
    return f'<tr{best}><th scope="row">{_code(label)}</th>{"".join(f"<td>{cell}</td>" for cell in cells)}{last}</tr>'


def _code(label: str) -> str:
    return f"<code>{html.escape(label)}</code>"


def _anchor(name: str) -> str:
    return html.escape(name.replace("/", "-"))
