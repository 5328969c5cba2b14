"""``ldtrefl methods``: every method and its options."""

from __future__ import annotations

import typer
from rich.text import Text

from ldtrefl.cli.printing import say
from ldtrefl.methods import all_methods

PLACE_IN_HELP = 50

app = typer.Typer()


@app.command()
def methods() -> None:
    """List every method and its options."""
    for name, method in all_methods().items():
        say(Text.assemble((name, "bold"), f"  {method.describe()}"))
        for option, (default, words) in method.options().items():
            say(f"    {option} = {default!r}  {words}")
