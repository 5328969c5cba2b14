"""The table and ``compare.json`` hold every metric that there is."""

import io
import json
from pathlib import Path

import pytest
from rich.console import Console

import ldtrefl
from ldtrefl.compare.bounces import BounceErrors
from ldtrefl.compare.metrics import all_metrics
from ldtrefl.compare.report import Row, compared, error_table, write_json
from tests.conftest import SMALL_SCENE


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Row]:
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    path.write_text(SMALL_SCENE)
    scene = ldtrefl.load_scene(path)
    truth, made = ldtrefl.render(scene, "bvh"), {}
    for method in ("ldt", "envmap"):
        renderer = ldtrefl.Renderer(scene, method)
        made[method] = compared(renderer.render(), truth, renderer.texel_sizes(256), renderer.gbuffer)
    return made


def test_every_metric_that_can_be_is_taken(rows: dict[str, Row]) -> None:
    assert list(rows["ldt"].errors) == [metric.name for metric in all_metrics()]
    # The cube map has no rays, so nothing is known of hits.
    assert list(rows["envmap"].errors) == [metric.name for metric in all_metrics() if "hits" not in metric.needs]
    assert [bounce.bounce for bounce in rows["ldt"].bounces] == [1] and rows["envmap"].bounces == ()
    assert rows["ldt"].errors["ssim"] > 0.999 > rows["envmap"].errors["ssim"]
    assert {"gbuffer", "peel", "march", "shade"} <= set(rows["ldt"].seconds)


def test_the_resolution_is_the_unit_of_distances(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SMALL_SCENE)
    scene = ldtrefl.load_scene(tmp_path / "scene.toml")
    renderer = ldtrefl.Renderer(scene, "ldt", search="linear", resolution=64)
    frame, truth = renderer.render(), ldtrefl.render(scene, "bvh")
    sizes = [renderer.texel_sizes(resolution) for resolution in (64, 256)]
    coarse, fine = (compared(frame, truth, texels, renderer.gbuffer).errors["p99"] for texels in sizes)
    assert fine == pytest.approx(4 * coarse) and coarse > 0


def test_the_table_has_a_column_for_each_heading(rows: dict[str, Row]) -> None:
    table = error_table(rows, "a title")
    headings = [metric.heading for metric in all_metrics() if metric.heading is not None]
    assert [column.header for column in table.columns] == ["method", "seconds", "stages", *headings]
    said = io.StringIO()
    Console(width=400, file=said).print(table)
    lines = said.getvalue().splitlines()
    ldt, envmap = (next(line for line in lines if f"│ {name} " in line) for name in ("ldt", "envmap"))
    assert f"{rows['ldt'].errors['ssim']:.4f}" in ldt and " - " not in ldt
    assert envmap.count(" - ") == sum("hits" in metric.needs for metric in all_metrics() if metric.heading is not None)


def test_json_has_every_bounce_and_no_infinity(tmp_path: Path) -> None:
    row = Row({"march": 0.5}, {"psnr": float("inf"), "p99": float("nan"), "ssim": 0.5})
    by_bounce = Row({}, {}, (BounceErrors(1, 9, 1, 2, 3), BounceErrors(2, 8, 4, 5, 6)))
    write_json(tmp_path / "compare.json", "scene.toml", "bvh", {"ldt": row, "other": by_bounce})
    names = ("bounce", "compared", "wrong_hits", "wrong_misses", "wrong_objects")
    assert json.loads((tmp_path / "compare.json").read_text()) == {
        "scene": "scene.toml",
        "reference": "bvh",
        "ldt": {"seconds": {"march": 0.5}, "psnr": None, "p99": None, "ssim": 0.5},
        "other": {
            "seconds": {},
            "bounces": [dict(zip(names, values, strict=True)) for values in ((1, 9, 1, 2, 3), (2, 8, 4, 5, 6))],
        },
    }
