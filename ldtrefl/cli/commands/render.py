"""``ldtrefl render``: a scene, or a mesh, to a picture."""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.cli.option_groups import grouped
from ldtrefl.cli.options import CacheFolder, Resources, Samples, SceneWanted, parsed_settings
from ldtrefl.cli.picture_options import PictureOptions
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


@dataclass(frozen=True)
class MapsKept:
    """Where maps are kept between runs."""

    cache: CacheFolder = None
    no_cache: Annotated[bool, typer.Option("--no-cache", help="Neither read nor keep maps on disk.")] = False

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Keep maps on disk inside this block.

        Where the user's own cache folder cannot be used, a line on standard error says so, and no maps are kept.

        Raises:
            InputError: both are given, or ``cache`` cannot be used.
        """
        if self.cache is not None and self.no_cache:
            raise InputError("--cache and --no-cache exclude each other")
        try:
            found = None if self.no_cache else MapCache(self.cache)
        except InputError as error:
            if self.cache is not None:
                raise
            print(f"ldtrefl: no maps are kept on disk: {error}", file=sys.stderr)
            found = None
        keep_maps_in(found)
        try:
            yield
        finally:
            keep_maps_in(None)


@app.command()
@grouped
def render(
    wanted: SceneWanted,
    picture: PictureOptions,
    method: Annotated[str | None, typer.Option(help="See `ldtrefl methods`; the scene's own if not given.")] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="OPTION=VALUE", help="An option of the method; may be repeated."),
    ] = None,
    samples: Samples = None,
    scene_file: Annotated[
        Path | None,
        typer.Option("--save-scene", metavar="TOML", help="Write what a mesh is put on as a scene file."),
    ] = None,
    stats: Annotated[bool, typer.Option("--stats", help="Say what was done and what was skipped.")] = False,
    *,
    maps: MapsKept,
    resources: Resources,
) -> None:
    """Render a scene, or a mesh, to a picture."""
    resources.use()
    foresee_a_frame(resources.device)
    path, file = picture.checked_path(wanted.scene), wanted.scene
    if scene_file is not None:
        check_scene_writable(scene_file)
        if is_scene_file(file):
            raise InputError(f"--save-scene goes with a mesh file, {file} is a scene file")
    with maps.kept(), budget.account():
        loaded = picture.of_scene(wanted.loaded())
        if scene_file is not None:
            include = include_of(file, up_axis_of(file, wanted.up), wanted.turn, lenient=wanted.lenient)
            save_scene(scene_file, loaded, include)
        options = parsed_settings(settings) | ({} if samples is None else {"samples": samples})
        # Before they are passed on by name: one may be called as a parameter of Renderer is.
        find_method(loaded.reflection.method if method is None else method).configured(options)
        with progress_bar():
            frame = Renderer(loaded, method, resources.device, **options).render()
            picture.write(path, frame, loaded.picture)
    total = sum(frame.stats.seconds.values())
    say(f"{path}: {frame.image.shape[1]} x {frame.image.shape[0]} in {total:.2f} s", stage_times(frame))
    if wanted.up is None and not is_scene_file(file):
        say(f"its {up_axis_of(file, wanted.up)} axis points up; --up names another")
    if stats:
        for line in _in_words(frame.stats.counters):
            say(line)


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
