"""What the benchmark finds, as it stands in ``tools/results/benchmark.json``. Times are milliseconds."""

from __future__ import annotations

from typing import TypedDict

from timing import Summary

Times = dict[str, dict[str, dict[str, Summary]]]
"""By number of threads, form of call ("numpy": arrays in and out; "kernel": the kernel alone) and tracer."""


class Errors(TypedDict, total=False):
    """How wrong a tracer's answers are. Of any-hit rays the first two alone are known."""

    wrong_hits: float
    """Percent of true hits."""
    wrong_misses: float
    """Percent of true hits."""
    median: float
    """Texels of a 128 map between a hit and the true one."""
    p99: float
    p999: float
    same_triangle: float
    """Percent of the rays that hit and should."""


class KindRow(TypedDict):
    """One kind of rays on one mesh."""

    rays: int
    hits: int
    any_hit: bool
    undecided: int
    """Rays within rounding of an edge, which nobody judges."""
    milliseconds: Times
    errors: dict[str, Errors]
    """By tracer."""


class RaysRow(TypedDict):
    """All kinds of rays on one mesh."""

    mesh: str
    triangles: int
    kinds: dict[str, KindRow]


class BuildRow(TypedDict):
    """Building on one mesh."""

    mesh: str
    triangles: int
    milliseconds: Times
    bytes: dict[str, int]
    """What is kept beside the mesh, by builder."""


class Memory(TypedDict):
    """Bytes by which a process grows when it builds, or makes frames."""

    kept: int
    peak: int


class MemoryRow(TypedDict):
    """Memory while building on one mesh."""

    mesh: str
    triangles: int
    mesh_bytes: int
    builders: dict[str, Memory]


class ErrorPoint(TypedDict):
    """A frame by one method with one parameter: its time and its error over the mirror."""

    scene: str
    curve: str
    """The method."""
    label: str
    """The parameter."""
    threads: int
    milliseconds: Summary
    ssim: float
    flip: float
    relmse: float
    is_usual: bool
    """Whether the parameter is the one that the method has if none is given."""
    memory: Memory | None
    """Of a renderer and two frames of it, where it was measured."""


class ErrorTarget(TypedDict):
    """What ``error`` asks for in one scene, and what comes of it."""

    scene: str
    search: str
    error: float | None
    """Pixels; None means the usual resolution."""
    pixels_p50: float | None
    pixels_p99: float | None
    bytes: int
    peel: float
    march: float


class Peeling(TypedDict):
    """Peeling one model of the paper's Table 1, or the model that stands for it here."""

    model: str
    triangles: int
    layers: int
    milliseconds: float


class PaperModel(TypedDict):
    """A row of the paper's Table 1."""

    paper: Peeling
    ours: Peeling


class PaperScene(TypedDict):
    """A row of the paper's Table 2: milliseconds by stage there, by search here."""

    paper: dict[str, float]
    ours: dict[str, float]


class PaperTables(TypedDict):
    """Tables 1 and 2 of the paper beside ours, by model and by scene."""

    table_1: dict[str, PaperModel]
    table_2: dict[str, PaperScene]


class FrameTime(TypedDict):
    """Whole frames of a scene, the camera moved before each."""

    milliseconds: Summary
    first: float
    """Of the first frame, with all that is built, loaded and compiled for it."""
    stages: dict[str, float]
    """Medians, where the stages are known."""


class FrameRow(TypedDict):
    """Whole frames of one scene, made in turn."""

    scene: str
    triangles: int
    size: tuple[int, int]
    bounces: int
    threads: int
    makers: dict[str, FrameTime]
    """By who makes them; ``ldt before`` is ``ldt`` of another checkout."""
    unlike: float | None
    """Percent of pixels by which Mitsuba's picture with our lights is off from that of ``bvh``."""


class StartRow(TypedDict):
    """Milliseconds of ``ldtrefl render scenes/teapot.toml``, from process to picture, by checkout."""

    what: str
    checkouts: dict[str, Summary]


class Result(TypedDict, total=False):
    """Everything. The keys of parts that were not run are missing."""

    machine: str
    threads: list[int]
    tracers: list[str]
    notes: list[str]
    statistic: str
    quick: bool
    rays: list[RaysRow]
    build: list[BuildRow]
    memory: list[MemoryRow]
    error_against_time: list[ErrorPoint]
    stages: dict[str, dict[str, float]]
    """By method, threads and frame: by stage."""
    error_targets: list[ErrorTarget]
    scaling: dict[str, float]
    """Time with one thread over that with two, by work."""
    paper: PaperTables
    rival_frames: list[FrameRow]
    """Beside Mitsuba's."""
    frames_before: list[FrameRow]
    """Beside those of another checkout."""
    start: list[StartRow]
