"""The benchmark's error against time: that every method is in it, what it draws, and how it measures memory."""

from typing import get_args, get_type_hints

import numpy as np
from benchmark_parts.error_report import LEAST_ERROR, STYLES, error_plot, error_tables
from benchmark_parts.growth import growth_of
from benchmark_parts.method_runs import BALL, PROJECTIONS, WALL, every_run
from benchmark_parts.result import ErrorPoint
from matplotlib.backends.backend_agg import FigureCanvasAgg

from ldtrefl.methods import all_methods, find_method

MEGABYTE = 2**20


def points(quick: bool = False) -> list[ErrorPoint]:
    """All runs, with figures of no meaning; the usual ones have memory of 5 MB, 7 at the peak."""
    return [
        {
            "scene": run.scene,
            "curve": run.curve,
            "label": run.label,
            "threads": 1,
            "milliseconds": {"median": 10.0 + i, "min": 10.0, "max": 90.0},
            "ssim": 1.0,
            "flip": 0.0,
            "relmse": 0.0,
            "is_usual": run.is_usual,
            "memory": {"kept": 5_000_000, "peak": 7_000_000} if run.is_usual else None,
        }
        for i, run in enumerate(every_run(quick))
    ]


def test_every_method_and_projection_runs_with_its_usual_parameter() -> None:
    for quick in (False, True):
        usual = [run for run in every_run(quick) if run.is_usual]
        assert {run.method for run in usual} == set(all_methods())
        assert {run.method for run in usual if run.scene == BALL} == set(all_methods()) - {"planar"}
        assert {run.method for run in usual if run.scene == WALL} == {"bvh", "ldt", "planar", "envmap"}
        for scene in (BALL, WALL):
            assert {f"envmap {name}" for name in PROJECTIONS} <= {run.curve for run in usual if run.scene == scene}
    assert get_args(get_type_hints(find_method("envmap").Config)["projection"]) == PROJECTIONS


def test_methods_take_the_parameters_and_images_of_their_runs() -> None:
    for run in every_run(quick=False):
        find_method(run.method).configured(run.options)
    ball, wall = (next(run for run in every_run(True) if run.scene == scene) for scene in (BALL, WALL))
    for run in (ball, wall):
        scene = run.scene_of(96, 64)
        assert (scene.camera.width, scene.camera.height) == (96, 64)
        assert [entry.is_reflector for entry in scene.objects] == [True, False]


def test_plot_shows_every_curve_and_its_legend_hides_none() -> None:
    figure = error_plot(points())
    FigureCanvasAgg(figure).draw()
    assert [panel.get_title() for panel in figure.axes] == [BALL.capitalize(), WALL.capitalize()]
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == list(STYLES)
    assert not any(legend.get_window_extent().overlaps(panel.get_window_extent()) for panel in figure.axes)
    for panel in figure.axes:
        low, high = panel.get_ylim()
        assert low < LEAST_ERROR < high


def test_tables_have_memory_where_it_was_measured() -> None:
    lines = error_tables({"error_against_time": points(quick=True)})
    assert any(line.startswith("| planar | - |") and line.endswith("| 5 | 7 |") for line in lines)
    assert any(line.startswith("| fermat-uv | 2 steps |") and line.endswith("| - | - |") for line in lines)


def test_growth_is_what_is_kept_and_the_most_there_was() -> None:
    def make() -> np.ndarray:
        scratch = np.ones(100 * MEGABYTE, np.uint8)
        kept = np.ones(50 * MEGABYTE, np.uint8)
        del scratch
        return kept

    growth = growth_of(make)
    assert abs(growth["kept"] / MEGABYTE - 50) < 3
    assert abs(growth["peak"] / MEGABYTE - 150) < 5
