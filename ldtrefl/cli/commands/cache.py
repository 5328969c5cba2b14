"""``ldtrefl cache``: the maps that are kept on disk between runs."""

from __future__ import annotations

import typer

from ldtrefl.cli.options import CacheFolder
from ldtrefl.cli.printing import say
from ldtrefl.files.map_cache import MapCache

PLACE_IN_HELP = 60

app = typer.Typer(name="cache", add_completion=False, help="The maps that are kept on disk between runs.")


@app.command()
def info(cache: CacheFolder = None) -> None:
    """Say where maps are kept, how many, and how large."""
    maps = MapCache(cache)
    files = maps.files()
    total = sum(size for _, size, _ in files)
    say(f"{maps.folder}: {len(files)} files, {total / 1e6:.1f} MB of at most {maps.limit / 1e6:.0f} MB")


@app.command()
def clear(cache: CacheFolder = None) -> None:
    """Remove all kept maps."""
    maps = MapCache(cache)
    say(f"{maps.folder}: {maps.clear()} files removed")
