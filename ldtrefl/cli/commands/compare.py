"""``ldtrefl compare``: a scene by several methods, and how far each is from the truth."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from ldtrefl.base.errors import InputError, NotForThisScene, printable
from ldtrefl.cli.option_groups import grouped
from ldtrefl.cli.options import Resources, Samples, SceneWanted, parsed_settings
from ldtrefl.cli.printing import say, stage_times
from ldtrefl.cli.progress import progress_bar
from ldtrefl.compare.bounces import bounce_table
from ldtrefl.compare.difference import difference_image
from ldtrefl.compare.report import Row, compared, error_table, write_json
from ldtrefl.files.atomic_write import writable_folder
from ldtrefl.files.picture_writing import save_image
from ldtrefl.frame.first_frame import foresee_a_frame
from ldtrefl.frame.result import Frame
from ldtrefl.methods import all_methods, find_method
from ldtrefl.renderer import Renderer
from ldtrefl.scene.description import MAX_SAMPLES, Scene

PLACE_IN_HELP = 20

TEXEL_RESOLUTION = 256
"""Resolution of the maps whose texel is the unit of distance errors, for methods that have no such maps."""

ALL = "all"
"""Asks for every method but the truth; those that are not made for the scene are left out."""

app = typer.Typer()


@app.command()
@grouped
def compare(
    wanted: SceneWanted,
    methods: Annotated[str, typer.Option(help="Method names, comma-separated; all: every method.")] = "ldt,envmap",
    reference: Annotated[str, typer.Option(help="The method that counts as the truth.")] = "bvh",
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder for images; the file's name + '-compare' if not given."),
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="METHOD.OPTION=VALUE", help="An option of one method.")
    ] = None,
    samples: Samples = None,
    reference_samples: Annotated[
        int | None,
        typer.Option(min=1, max=MAX_SAMPLES, help="The same of the truth; as many as the others if not given."),
    ] = None,
    *,
    resources: Resources,
) -> None:
    """Render a scene, or a mesh, by several methods; print errors and write images and difference pictures."""
    resources.use()
    device, scene = resources.device, wanted.scene
    foresee_a_frame(device)
    takes_all = methods.strip() == ALL
    names = [name for name in all_methods() if name != reference] if takes_all else _names_in(methods)
    options = _options_by_method(settings, [reference, *names])
    for name, count in [*((name, samples) for name in options), (reference, reference_samples)]:
        if count is not None:
            options[name] = {**options[name], "samples": count}
    folder = writable_folder(output or Path(scene.stem + "-compare"), make=True)
    loaded = wanted.loaded()
    rows: dict[str, Row] = {}
    refusals: list[InputError] = []
    with progress_bar():
        _, truth = timed_frame(loaded, reference, device, options[reference])
        save_image(folder / f"{reference}.png", truth.image)
        for name in names:
            try:
                renderer, frame = timed_frame(loaded, name, device, options[name])
            except NotForThisScene as refusal:
                if not takes_all:
                    raise
                refusals.append(refusal)
                continue
            resolution = options[name].get("resolution")
            texels = resolution if isinstance(resolution, int) else TEXEL_RESOLUTION
            gbuffer = None if frame.hits is None else renderer.gbuffer  # drawn again for it if the image is large
            rows[name] = compared(frame, truth, renderer.texel_sizes(texels), gbuffer)
            save_image(folder / f"{name}.png", frame.image)
            save_image(folder / f"{name}-difference.png", difference_image(frame.image, truth.image))
    write_json(folder / "compare.json", str(scene), reference, rows)
    title = f"{scene} against {reference} ({truth.reflector_mask.sum()} reflector pixels)"
    say(error_table(rows, printable(title)))
    for why in refusals:
        say(f"left out: {why}")
    by_bounce = {name: row.bounces for name, row in rows.items() if len(row.bounces) > 1}
    if by_bounce:
        say(bounce_table(by_bounce, "where rays end, bounce by bounce"))
    say(f"{reference}: {sum(truth.stats.seconds.values()):.3f} s", stage_times(truth))
    say(f"images in {folder}")


def timed_frame(
    scene: Scene, method: str, device: str | None = None, options: Mapping[str, object] | None = None
) -> tuple[Renderer, Frame]:
    """A frame whose times hold every stage but compiling, and the renderer that made it.

    A first frame, by a renderer of its own, compiles the kernels and is thrown away.

    Raises:
        InputError: an unknown method, option or device, or a value that is not allowed.
    """
    Renderer(scene, method, device, **(options or {})).render()
    renderer = Renderer(scene, method, device, **(options or {}))
    return renderer, renderer.render()


def _names_in(methods: str) -> list[str]:
    """The names in a list with commas."""
    return [name.strip() for name in methods.split(",") if name.strip()]


def _options_by_method(settings: list[str] | None, names: list[str]) -> dict[str, dict[str, object]]:
    """``["ldt.resolution=256"]`` -> ``{"ldt": {"resolution": 256}, "bvh": {}}``, for each of the methods ``names``.

    Raises:
        InputError: a method that is not one of them, or an option that it does not have or allow.
    """
    options: dict[str, dict[str, object]] = {name: {} for name in names}
    for key, value in parsed_settings(settings).items():
        method, dot, option = key.partition(".")
        if not dot or method not in names:
            raise InputError(f"--set {key}: expected METHOD.OPTION=VALUE, METHOD one of {', '.join(names)}")
        options[method][option] = value
    for name in names:
        find_method(name).configured(options[name])
    return options
