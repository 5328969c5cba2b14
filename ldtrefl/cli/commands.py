"""The command line, and nothing else.

Exit status: 0 done, 2 the input is wrong, 130 stopped by Ctrl-C, 1 anything else; in each case but the first one line
on standard error, and a traceback only for a fault of our own. A reader that has gone, as in ``| head``, is none.
"""

import json
import os
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any, TextIO

import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text
from typer.exceptions import TyperException

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError, printable
from ldtrefl.base.standard_error import log_on_stderr
from ldtrefl.compare import metrics
from ldtrefl.compare.difference import difference_image
from ldtrefl.compare.layer_picture import draw_layers
from ldtrefl.device import launch
from ldtrefl.device.progress import progress_to
from ldtrefl.files.atomic_write import writable_folder, written_whole
from ldtrefl.files.map_cache import MapCache, keep_maps_in
from ldtrefl.files.picture_writing import check_writable, save_image
from ldtrefl.ldt.options import DEFAULT_RESOLUTION
from ldtrefl.ldt.peel import peel_mesh
from ldtrefl.methods import all_methods, find_method
from ldtrefl.renderer import Frame, Renderer
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Scene
from ldtrefl.scene.load import load_scene
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.readers.mesh_files import load_mesh
from ldtrefl.scene.toml_text import check_regular, parse_toml
from ldtrefl.world.device_mesh import DeviceMesh

PROGRESS_AFTER = 1.0
"""Seconds before a progress bar is shown."""

TEXEL_RESOLUTION = 256
"""Map resolution whose texel is the unit of distance errors for methods without maps."""

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    no_args_is_help=False,
    help="Reflections on curved objects by layered depth textures, compared with ray tracing.",
)

cache_commands = typer.Typer(add_completion=False, help="The maps that are kept on disk between runs.")
app.add_typer(cache_commands, name="cache")

CacheFolder = Annotated[
    Path | None, typer.Option("--cache", metavar="DIR", help="Keep maps here; the user's cache folder if not given.")
]
SceneFile = Annotated[Path, typer.Argument(metavar="SCENE", help="A scene file (TOML).")]
Settings = Annotated[
    list[str] | None, typer.Option("--set", metavar="OPTION=VALUE", help="An option of the method; may be repeated.")
]
Memory = Annotated[
    str | None,
    typer.Option(
        "--memory",
        metavar="SIZE",
        help="Memory that the scene may take, such as 8G or 512M; LDTREFL_MEMORY or else 4G if not given.",
    ),
]
Device = Annotated[str | None, typer.Option(help="'cpu' (default) or a CUDA device such as 'cuda:0'.")]
Threads = Annotated[int | None, typer.Option(help="CPU threads; all cores if not given.")]


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; the exit status."""
    fault = ""
    try:
        with log_on_stderr():
            result = app(arguments, standalone_mode=False, prog_name="ldtrefl")
            status = result if isinstance(result, int) else 0
    except (InputError, TyperException) as error:
        status, fault = 2, error.format_message() if isinstance(error, TyperException) else str(error)
    except (KeyboardInterrupt, typer.Abort):
        status = 130
    except _ReaderGone:
        status = 0
    except MemoryError:
        status, fault = 1, "there is not enough memory on this machine"
    except OSError as error:  # a file's is an InputError
        status, fault = 1, f"{error.filename or 'standard output'}: {error.strerror or error}"
    if not _flushed(sys.stdout) and status == 0:
        status, fault = 1, "standard output cannot be written"
    if fault:
        with suppress(OSError):
            print(f"ldtrefl: {printable(' '.join(fault.split()))}", file=sys.stderr, flush=True)
    _flushed(sys.stderr)
    return status


def _flushed(stream: TextIO) -> bool:
    """Whether all has been written. If not, it is given up, so that the interpreter's end says nothing of it."""
    try:
        stream.flush()
    except (OSError, ValueError) as error:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        return isinstance(error, BrokenPipeError)
    return True


@app.command()
def render(
    scene: SceneFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="PNG or EXR; SCENE's name with .png if not given.")
    ] = None,
    method: Annotated[str | None, typer.Option(help="See `ldtrefl methods`; the scene's own if not given.")] = None,
    settings: Settings = None,
    stats: Annotated[bool, typer.Option("--stats", help="Say what was done and what was skipped.")] = False,
    cache: CacheFolder = None,
    no_cache: Annotated[bool, typer.Option("--no-cache", help="Neither read nor keep maps on disk.")] = False,
    device: Device = None,
    threads: Threads = None,
    memory: Memory = None,
) -> None:
    """Render a scene to a picture."""
    launch.set_threads(threads)
    _allow_memory(memory)
    path = check_writable(output or Path(scene.stem + ".png"))
    if cache is not None and no_cache:
        raise InputError("--cache and --no-cache exclude each other")
    with _maps_kept(cache, no_cache), budget.account():
        loaded = load_scene(scene)
        with _progress():
            frame = Renderer(loaded, method, device, **_options(settings)).render()
            save_image(path, frame.image)
    total = sum(frame.stats.seconds.values())
    console = _console()
    console.print(f"{path}: {frame.image.shape[1]} x {frame.image.shape[0]} in {total:.2f} s", _stages(frame))
    if stats:
        for line in _in_words(frame.stats.counters):
            console.print(line)


@app.command()
def compare(
    scene: SceneFile,
    methods: Annotated[str, typer.Option(help="Method names, comma-separated.")] = "ldt,envmap",
    reference: Annotated[str, typer.Option(help="The method that counts as the truth.")] = "bvh",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for images; SCENE's name + '-compare' if not given.")
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="METHOD.OPTION=VALUE", help="An option of one method.")
    ] = None,
    device: Device = None,
    threads: Threads = None,
    memory: Memory = None,
) -> None:
    """Render a scene by several methods; print errors and write images and difference pictures."""
    launch.set_threads(threads)
    _allow_memory(memory)
    names = [name.strip() for name in methods.split(",") if name.strip()]
    options = _method_options(settings, [reference, *names])
    folder = writable_folder(output or Path(scene.stem + "-compare"), make=True)
    loaded = load_scene(scene)
    rows: dict[str, dict[str, Any]] = {}
    with _progress():
        _, truth = _timed_frame(loaded, reference, device, options.get(reference, {}))
        save_image(folder / f"{reference}.png", truth.image)
        for name in names:
            renderer, frame = _timed_frame(loaded, name, device, options.get(name, {}))
            resolution = options.get(name, {}).get("resolution", TEXEL_RESOLUTION)
            rows[name] = _errors(frame, truth, renderer, resolution)
            save_image(folder / f"{name}.png", frame.image)
            save_image(folder / f"{name}-difference.png", difference_image(frame.image, truth.image))
    with written_whole(folder / "compare.json") as scratch:
        scratch.write_text(json.dumps(_finite({"scene": str(scene), "reference": reference, **rows})) + "\n")
    title = f"{scene} against {reference} ({truth.reflector_mask.sum()} reflector pixels)"
    _console().print(_error_table(rows, printable(title)))
    _console().print(f"{reference}: {sum(truth.stats.seconds.values()):.3f} s", _stages(truth))
    _console().print(f"images in {folder}")


@app.command()
def peel(
    mesh: Annotated[str, typer.Argument(metavar="MESH", help="A mesh file, or the name of a procedural shape.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Draw the layers to this picture.")] = None,
    resolution: Annotated[int, typer.Option(help="Texels along the longest side.")] = DEFAULT_RESOLUTION,
    device: Device = None,
    threads: Threads = None,
    memory: Memory = None,
) -> None:
    """Look at a layered depth texture: layers per face, fragments, bytes and time."""
    launch.set_threads(threads)
    _allow_memory(memory)
    path = None if output is None else check_writable(output)
    target = launch.resolve_device(device)
    geometry = DeviceMesh(_mesh_or_shape(mesh), target)
    peel_mesh(geometry, 16, search="linear")  # compiles the kernels, so that the time below is peeling's own
    start = time.perf_counter()
    maps = peel_mesh(geometry, resolution, search="linear")
    seconds = time.perf_counter() - start
    if path is not None:
        save_image(path, draw_layers(maps))
    console = _console()
    console.print(f"{mesh}: {len(geometry.mesh.faces)} triangles at {' x '.join(map(str, maps.frame.size))} texels")
    console.print("layers per face: " + ", ".join(f"{face} {count}" for face, count in maps.layers().items()))
    console.print("crossings per axis: " + ", ".join(f"{axis} {count}" for axis, count in maps.crossings().items()))
    console.print(f"fragments: {maps.fragment_count}, bytes: {maps.nbytes}, time: {1000 * seconds:.1f} ms")
    if path is not None:
        console.print(f"layers drawn to {path}")


@app.command()
def info(
    file: Annotated[str, typer.Argument(metavar="SCENE|MESH", help="A scene or mesh file, or a shape's name.")],
    memory: Memory = None,
) -> None:
    """Say what a scene or a mesh holds."""
    _allow_memory(memory)
    if Path(file).suffix.lower() == ".toml":
        with budget.account() as account:
            loaded = load_scene(file)
        _scene_info(loaded, account.taken)
    else:
        _mesh_info(_mesh_or_shape(file))
    if note := launch.threading_note():
        _console().print(note)


@cache_commands.command("info")
def cache_info(cache: CacheFolder = None) -> None:
    """Say where maps are kept, how many, and how large."""
    kept = MapCache(cache)
    files = kept.files()
    total = sum(size for _, size, _ in files)
    _console().print(f"{kept.folder}: {len(files)} files, {total / 1e6:.1f} MB of at most {kept.limit / 1e6:.0f} MB")


@cache_commands.command("clear")
def cache_clear(cache: CacheFolder = None) -> None:
    """Remove all kept maps."""
    kept = MapCache(cache)
    _console().print(f"{kept.folder}: {kept.clear()} files removed")


@app.command()
def methods() -> None:
    """List every method and its options."""
    console = _console()
    for name, method in all_methods().items():
        console.print(Text.assemble((name, "bold"), f"  {method.describe()}"))
        for option, (default, words) in method.options().items():
            console.print(f"    {option} = {default!r}  {words}")


@contextmanager
def _maps_kept(folder: Path | None, no_cache: bool) -> Iterator[None]:
    """Keep maps on disk inside this block. Where the user's own folder is of no use there is no cache, and a line."""
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


def _allow_memory(size: str | None) -> None:
    budget.set_memory_limit(None if size is None else budget.size_of(size, "--memory"))
    budget.memory_limit()  # a wrong value in the environment is said before any work is done


class _ReaderGone(Exception):
    """Nobody reads our output any more; nothing is left to say to it."""


class _Printer(Console):
    """Prints names as they are: they come from files and may look like markup."""

    def __init__(self) -> None:
        # In a pipe there is no width to fit into: lines are not broken.
        width = None if sys.stdout.isatty() else 200
        super().__init__(highlight=False, markup=False, emoji=False, soft_wrap=True, width=width)

    def print(self, *objects: Any, **options: Any) -> None:
        """Print text without what a terminal would obey."""
        super().print(*(printable(entry) if isinstance(entry, str) else entry for entry in objects), **options)

    def on_broken_pipe(self) -> None:
        """Called by rich, which would end the process with status 1."""
        raise _ReaderGone


def _console() -> Console:
    return _Printer()


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


def _stages(frame: Frame) -> str:
    return ", ".join(f"{name} {seconds:.3f}" for name, seconds in frame.stats.seconds.items())


@contextmanager
def _progress() -> Iterator[None]:
    """A progress bar on standard error for what takes over a second; on a terminal only."""
    if not sys.stderr.isatty():
        yield
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    progress = Progress(*columns, console=Console(stderr=True), transient=True)
    task = progress.add_task("starting", total=1.0)
    begun = time.perf_counter()

    def show(stage: str, fraction: float) -> None:
        if time.perf_counter() - begun > PROGRESS_AFTER:
            progress.start()
        progress.update(task, description=stage, completed=fraction)

    try:
        with progress_to(show):
            yield
    finally:
        progress.stop()


def _options(settings: list[str] | None) -> dict[str, Any]:
    """``["resolution=256"]`` -> ``{"resolution": 256}``; values as in TOML, or else plain words."""
    options: dict[str, Any] = {}
    for setting in settings or []:
        name, equals, value = setting.partition("=")
        if not equals or not name.strip():
            raise InputError(f"--set {setting}: expected OPTION=VALUE")
        try:
            tables = parse_toml(f"value = {value}")
        except InputError as error:
            if not isinstance(error.__cause__, ValueError):  # beyond the limits of any value
                raise error.within(f"--set {name}") from None
            tables = {}
        options[name.strip()] = tables["value"] if tables.keys() == {"value"} else value.strip()
    return options


def _method_options(settings: list[str] | None, names: list[str]) -> dict[str, dict[str, Any]]:
    """``["ldt.resolution=256"]`` -> ``{"ldt": {"resolution": 256}}``, checked."""
    options: dict[str, dict[str, Any]] = {}
    for key, value in _options(settings).items():
        method, dot, option = key.partition(".")
        if not dot or method not in names:
            raise InputError(f"--set {key}: expected METHOD.OPTION=VALUE, METHOD one of {', '.join(names)}")
        options.setdefault(method, {})[option] = value
    for name in names:
        find_method(name).configured(options.get(name, {}))
    return options


def _timed_frame(scene: Scene, method: str, device: str | None, options: dict[str, Any]) -> tuple[Renderer, Frame]:
    """A frame timed with all its stages: a first one compiles the kernels and is thrown away."""
    Renderer(scene, method, device, **options).render()
    renderer = Renderer(scene, method, device, **options)
    return renderer, renderer.render()


def _errors(frame: Frame, truth: Frame, renderer: Renderer, resolution: int) -> dict[str, Any]:
    mask = truth.reflector_mask
    row: dict[str, Any] = {
        "seconds": frame.stats.seconds,
        "ssim": metrics.ssim(frame.image, truth.image, mask),
        "psnr": metrics.psnr(frame.image, truth.image, mask),
        "flip": metrics.flip(frame.image, truth.image, mask),
        "relmse": metrics.relmse(frame.image, truth.image, mask),
    }
    if frame.hits is not None and truth.hits is not None:
        row |= vars(metrics.hit_errors(frame.hits, truth.hits, renderer.texel_sizes(resolution), mask))
        assert renderer.gbuffer is not None
        pixels = metrics.reprojection_errors(frame.hits, truth.hits, renderer.gbuffer)
        row["pixels"] = float(np.percentile(pixels, 99)) if len(pixels) else float("nan")
    return row


def _error_table(rows: dict[str, dict[str, Any]], title: str) -> Table:
    table = Table(title=title)
    heads = ["method", "seconds", "stages", "SSIM", "PSNR", "FLIP", "wrong hit %", "wrong miss %", "wrong object %"]
    heads += ["texels p50", "p99", "pixels p99"]
    for head in heads:
        table.add_column(head, justify="left" if head in ("method", "stages") else "right", overflow="fold")
    formats = {
        "ssim": ".4f",
        "psnr": ".1f",
        "flip": ".4f",
        "wrong_hits": ".3f",
        "wrong_misses": ".3f",
        "wrong_objects": ".3f",
    }
    formats |= {"median": ".3f", "p99": ".2f", "pixels": ".3f"}
    for name, row in rows.items():
        stages = " ".join(f"{stage} {seconds:.3f}" for stage, seconds in row["seconds"].items())
        figures = [format(row[key], spec) if key in row else "-" for key, spec in formats.items()]
        table.add_row(name, f"{sum(row['seconds'].values()):.3f}", stages, *figures)
    return table


def _finite(value: Any) -> Any:
    """JSON has no infinity and no NaN: null stands for them."""
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _mesh_or_shape(name: str) -> Mesh:
    path = Path(name)
    if name in shapes.names() and not path.exists():
        return shapes.make(name)
    with suppress(OSError):  # there is none: the loader says so
        check_regular(path, "a mesh file")
    return load_mesh(name)


def _scene_info(scene: Scene, memory: int) -> None:
    camera, console = scene.camera, _console()
    console.print(f"camera: {camera.width} x {camera.height}, eye {list(camera.eye)}, fov_y {camera.fov_y}")
    kinds = [light.kind for light in scene.lights]
    console.print(f"lights: {', '.join(kinds) or 'none'}; shadows: {scene.lighting.shadows}")
    console.print(f"method: {scene.reflection.method}, max_bounces: {scene.reflection.max_bounces}")
    table = Table("object", "geometry", "triangles", "mirrors", "size in the world")
    for entry in scene.objects:
        mesh, matrix = entry.geometry, entry.world_from_object()
        low, high = mesh.bounds
        size = np.linalg.norm(matrix[:3, :3], axis=0) * (high - low)
        source = entry.shape or (Path(entry.mesh).name if isinstance(entry.mesh, str) else "mesh")
        row = (printable(entry.name), printable(source), str(len(mesh.faces)), "yes" if entry.is_reflector else "no")
        table.add_row(*row, " x ".join(f"{side:.3g}" for side in size))
    console.print(table)
    allowed = budget.in_words(budget.memory_limit())
    console.print(f"memory: about {budget.in_words(memory)} for its shapes, meshes and pictures, {allowed} allowed")


def _mesh_info(mesh: Mesh) -> None:
    console = _console()
    low, high = mesh.bounds
    textures = sum(part.texture is not None for part in mesh.parts)
    console.print(f"{len(mesh.faces)} triangles, {len(mesh.vertices)} vertices")
    console.print(f"from {low.tolist()} to {high.tolist()}")
    console.print(f"parts: {len(mesh.parts)}, textures: {textures}, UVs: {'no' if mesh.uvs is None else 'yes'}")
    maps = peel_mesh(DeviceMesh(mesh, launch.resolve_device(None)), 128, search="linear")
    crossings = ", ".join(f"{axis} {count}" for axis, count in maps.crossings().items())
    console.print(f"surfaces over one texel at 128: {crossings}")
    odd = sum(int((maps.counts(axis) % 2).sum()) for axis in range(3))
    console.print("closed: every texel has an even number" if odd == 0 else f"open: {odd} texels have an odd number")
