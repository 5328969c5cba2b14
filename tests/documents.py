"""README, docs/ and their kin: their blocks of code, and the files that they name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("tools/*.md")])
PROGRAM = ".venv/bin/ldtrefl "


@dataclass(frozen=True)
class Block:
    """A piece of code in a page."""

    page: Path
    number: int
    """Of its kind, from 1 at the top of the page."""
    code: str

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)} {self.number}"


def blocks(language: str) -> list[Block]:
    """Every fenced block in this language, as it stands."""
    found = []
    for page in PAGES:
        codes = re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)
        found += [Block(page, number, code) for number, code in enumerate(codes, 1)]
    return found


def commands() -> list[Block]:
    """Every command line of the program itself, without what installs it."""
    found = []
    for page in PAGES:
        lines = [line.strip() for line in page.read_text().splitlines() if line.startswith("    ")]
        parts = [part.strip() for line in lines for part in line.split("&&") if part.strip().startswith(PROGRAM)]
        found += [Block(page, number, part.removeprefix(PROGRAM)) for number, part in enumerate(parts, 1)]
    return found


def named_files(page: Path) -> set[Path]:
    """Files that a page names: links, and words with a slash and an ending of ours, by their path from the top of the
    repository or of the package, or from the page's folder. ``NAME`` stands for any name."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
    links = {(page.parent / link).resolve() for link in re.findall(r"\]\((?!https?:)([^)#]+)", text)}
    text = re.sub(r"\]\([^)]*\)", "", text)
    words = re.findall(r"(?<![\w/.~-])((?:[\w.-]+/)+[\w.-]*\.(?:py|md|toml|json|png|h)|[A-Z]+\.md)\b", text)
    words += re.findall(r"`((?:[\w.-]+/)+)`", text)
    tops = (ROOT, ROOT / "ldtrefl", page.parent)
    meant = {word: [top / word for top in tops if (top / word).exists()] for word in words if "NAME" not in word}
    return links | {found[0] if found else ROOT / word for word, found in meant.items()}
