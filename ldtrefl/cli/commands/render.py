"""``ldtrefl render``: a scene, or a mesh, to a picture."""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.cli.options import (
    CacheFolder,
    Device,
    Lenient,
    Memory,
    Mirror,
    On,
    Samples,
    SceneFile,
    Size,
    Threads,
    Turn,
    Up,
    parsed_settings,
    scene_of,
    use_resources,
)
from ldtrefl.cli.picture_options import (
    AsLayers,
    Bits,
    Exposure,
    PictureOptions,
    Quality,
    ToneMapping,
    Transparent,
)
from ldtrefl.cli.printing import say, stage_times
from ldtrefl.cli.progress import progress_bar
from ldtrefl.files.map_cache import MapCache, keep_maps_in
from ldtrefl.frame.first_frame import foresee_a_frame
from ldtrefl.methods import find_method
from ldtrefl.renderer import Renderer
from ldtrefl.scene.load import is_scene_file
from ldtrefl.scene.mesh_scene import include_of, up_axis_of
from ldtrefl.scene.scene_text import check_scene_writable, save_scene

PLACE_IN_HELP = 10

app = typer.Typer()

Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", help="PNG, JPEG, WebP or EXR; the file's name with .png if not given."),
]
SavedScene = Annotated[
    Path | None, typer.Option("--save-scene", metavar="TOML", help="Write what a mesh is put on as a scene file.")
]


@app.command()
def render(
    scene: SceneFile,
    output: Output = None,
    on: On = None,
    up: Up = None,
    turn: Turn = 0.0,
    mirror: Mirror = None,
    size: Size = None,
    samples: Samples = None,
    lenient: Lenient = False,
    scene_file: SavedScene = None,
    method: Annotated[str | None, typer.Option(help="See `ldtrefl methods`; the scene's own if not given.")] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="OPTION=VALUE", help="An option of the method; may be repeated."),
    ] = None,
    exposure: Exposure = None,
    tone_mapping: ToneMapping = None,
    bits: Bits = None,
    quality: Quality = None,
    transparent: Transparent = False,
    layers: AsLayers = False,
    stats: Annotated[bool, typer.Option("--stats", help="Say what was done and what was skipped.")] = False,
    cache: CacheFolder = None,
    no_cache: Annotated[bool, typer.Option("--no-cache", help="Neither read nor keep maps on disk.")] = False,
    device: Device = None,
    threads: Threads = None,
    memory: Memory = None,
) -> None:
    """Render a scene, or a mesh, to a picture."""
    use_resources(memory, threads)
    foresee_a_frame(device)
    path = output or Path(scene.stem + (".exr" if layers else ".png"))
    picture = PictureOptions(path, exposure, tone_mapping, bits, quality, transparent, layers)
    if cache is not None and no_cache:
        raise InputError("--cache and --no-cache exclude each other")
    if scene_file is not None:
        check_scene_writable(scene_file)
        if is_scene_file(scene):
            raise InputError(f"--save-scene goes with a mesh file, {scene} is a scene file")
    with _maps_kept(cache, no_cache), budget.account():
        loaded = picture.of_scene(scene_of(scene, on, up, turn, mirror, size, lenient))
        if scene_file is not None:
            include = include_of(scene, up_axis_of(scene, up), turn, lenient=lenient)
            save_scene(scene_file, loaded, include)
        options = parsed_settings(settings) | ({} if samples is None else {"samples": samples})
        # Before they are passed on by name: one may be called as a parameter of Renderer is.
        find_method(loaded.reflection.method if method is None else method).configured(options)
        with progress_bar():
            frame = Renderer(loaded, method, device, **options).render()
            picture.write(frame, loaded.picture)
    total = sum(frame.stats.seconds.values())
    say(f"{path}: {frame.image.shape[1]} x {frame.image.shape[0]} in {total:.2f} s", stage_times(frame))
    if up is None and not is_scene_file(scene):
        say(f"its {up_axis_of(scene, up)} axis points up; --up names another")
    if stats:
        for line in _in_words(frame.stats.counters):
            say(line)


@contextmanager
def _maps_kept(folder: Path | None, no_cache: bool) -> Iterator[None]:
    """Keep maps on disk inside this block.

    Where the user's own cache folder cannot be used, a line on standard error says so, and no maps are kept. A
    ``folder`` that cannot be used is an error.
    """
    try:
        cache = None if no_cache else MapCache(folder)
    except InputError as error:
        if folder is not None:
            raise
        print(f"ldtrefl: no maps are kept on disk: {error}", file=sys.stderr)
        cache = None
    keep_maps_in(cache)
    try:
        yield
    finally:
        keep_maps_in(None)


def _in_words(counters: dict[str, int]) -> list[str]:
    """What was done and what was skipped, a line each."""
    n = defaultdict(int, counters)
    lines = [f"{n['reflector_pixels']} of {n['pixels']} pixels see a reflector"]
    if n["frames_kept"]:
        return [*lines, "nothing has changed since the last frame: it is kept"]
    if not n["reflector_pixels"]:
        return [*lines, "no reflector in view: nothing culled, peeled or traced"]
    if n["triangles_tested"]:
        share = 100.0 * n["triangles_culled"] / n["triangles_tested"]
        lines.append(
            f"{n['triangles_culled']} of {n['triangles_tested']} reflector triangles out of sight or without an object "
            f"in their reflection ({share:.0f}%)"
        )
    lines.append(f"{n['rays']} rays reflected" + (f", {n['rays_kept']} kept" if n["rays_kept"] else ""))
    pairs = n["searches"] + n["searches_saved"]
    if pairs:
        share = 100.0 * n["searches_saved"] / pairs
        lines.append(f"{n['searches_saved']} of {pairs} pairs of ray and object not searched ({share:.0f}%)")
    if n["searches"] and n["steps"]:
        lines.append(f"{n['searches']} searches, {n['steps'] / n['searches']:.1f} steps each")
    made = [f"{n['objects_peeled']} objects peeled"]
    made += [f"{n['objects_from_cache']} from the cache"] if n["objects_from_cache"] else []
    made += [f"{n['objects_skipped']} not needed"] if n["objects_skipped"] else []
    if any(name.startswith("objects_") for name in counters):
        lines.append(", ".join(made) + f"; {n['records']} records, {n['map_bytes'] / 1e6:.1f} MB")
    return lines
