"""``ldtrefl peel``: what a layered depth texture looks like."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from ldtrefl.cli.option_groups import grouped
from ldtrefl.cli.options import Resources, mesh_or_shape
from ldtrefl.cli.printing import say
from ldtrefl.compare.layer_picture import draw_layers
from ldtrefl.device.launch import resolve_device
from ldtrefl.files.picture_writing import check_writable, save_image
from ldtrefl.ldt.options import DEFAULT_RESOLUTION
from ldtrefl.ldt.peel import peel_mesh
from ldtrefl.world.device_mesh import DeviceMesh

PLACE_IN_HELP = 30

SMALLEST_RESOLUTION = 16
"""Texels: maps that take no time, to compile the kernels."""

app = typer.Typer()


@app.command()
@grouped
def peel(
    mesh: Annotated[str, typer.Argument(metavar="MESH", help="A mesh file, or the name of a procedural shape.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Draw the layers to this picture.")] = None,
    resolution: Annotated[int, typer.Option(help="Texels along the longest side.")] = DEFAULT_RESOLUTION,
    *,
    resources: Resources,
) -> None:
    """Look at a layered depth texture: layers per face, fragments, bytes and time."""
    resources.use()
    path = None if output is None else check_writable(output)
    target = resolve_device(resources.device)
    geometry = DeviceMesh(mesh_or_shape(mesh), target)
    peel_mesh(geometry, SMALLEST_RESOLUTION, search="linear")  # compiles, so that the time below is peeling's own
    start = time.perf_counter()
    maps = peel_mesh(geometry, resolution, search="linear")
    seconds = time.perf_counter() - start
    if path is not None:
        save_image(path, draw_layers(maps))
    say(f"{mesh}: {len(geometry.mesh.faces)} triangles at {' x '.join(map(str, maps.frame.size))} texels")
    say("layers per face: " + ", ".join(f"{face} {count}" for face, count in maps.layers().items()))
    say("crossings per axis: " + ", ".join(f"{axis} {count}" for axis, count in maps.crossings().items()))
    say(f"fragments: {maps.fragment_count}, bytes: {maps.nbytes}, time: {1000 * seconds:.1f} ms")
    if path is not None:
        say(f"layers drawn to {path}")
