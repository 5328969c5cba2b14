"""``ldtrefl compare``: pictures, table and JSON."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

import ldtrefl
from ldtrefl.cli.commands.compare import timed_frame
from ldtrefl.methods import all_methods
from tests.cli.conftest import Done
from tests.conftest import SMALL_SCENE


def test_it_writes_pictures_and_errors(run: Callable[..., Done], scene_folder: Path) -> None:
    done = run("compare", "scene.toml", "-o", "made", "--set", "ldt.resolution=64")
    assert done.status == 0 and not done.errors, done
    assert all(
        word in done.output for word in ("scene.toml against bvh", "envmap", "SSIM", "pixels p99", "images in made")
    )
    made = {path.name for path in (scene_folder / "made").iterdir()}
    pictures = {f"{name}{kind}.png" for name in ("ldt", "envmap") for kind in ("", "-difference")} | {"bvh.png"}
    assert made == pictures | {"compare.json"}
    report = json.loads((scene_folder / "made" / "compare.json").read_text())
    assert list(report) == ["scene", "reference", "ldt", "envmap"] and report["reference"] == "bvh"
    assert report["ldt"]["ssim"] > 0.99 and "wrong_hits" not in report["envmap"]
    assert (
        "bounce by bounce" not in done.output
        and len(report["ldt"]["bounces"]) == 1
        and "bounces" not in report["envmap"]
    )


def test_mirrors_in_mirrors_are_compared_bounce_by_bounce(run: Callable[..., Done], scene_folder: Path) -> None:
    """A second ball beside the first: rays go to and fro."""
    other = SMALL_SCENE[SMALL_SCENE.index("[[object]]") : SMALL_SCENE.rindex("[[object]]")]
    text = SMALL_SCENE + other.replace("[object.material]", "translate = [-2.1, 0.0, 0.0]\n[object.material]")
    (scene_folder / "balls.toml").write_text(text)
    done = run("compare", "balls.toml", "--methods", "ldt,envmap", "--set", "bvh.max_bounces=3")
    assert done.status == 0 and "bounce by bounce" in done.output and "rays compared" in done.output
    bounces = json.loads((scene_folder / "balls-compare" / "compare.json").read_text())["ldt"]["bounces"]
    assert [row["bounce"] for row in bounces] == [1, 2, 3]
    compared = [row["compared"] for row in bounces]
    assert compared == sorted(compared, reverse=True) and compared[2] > 0
    assert all(row[f"wrong_{what}"] == 0 for row in bounces for what in ("hits", "misses", "objects"))


def test_all_methods_and_those_that_refuse_the_scene(run: Callable[..., Done], scene_folder: Path) -> None:
    done = run("compare", "scene.toml", "--methods", "all", "-o", "made", "--samples", "1")
    report = json.loads((scene_folder / "made" / "compare.json").read_text())
    assert done.status == 0 and set(report) == {"scene", "reference", *all_methods()} - {"bvh", "planar"}
    assert "left out: object 'sphere': method planar is for flat mirrors" in " ".join(done.output.split())
    alone = run("compare", "scene.toml", "--methods", "planar")
    assert alone.status == 2 and alone.errors and "method planar is for flat mirrors" in alone.errors[0]


def test_any_method_may_be_the_truth(run: Callable[..., Done], scene_folder: Path) -> None:
    done = run("compare", "scene.toml", "--reference", "ldt", "--methods", "ldt")
    assert done.status == 0 and (scene_folder / "scene-compare" / "ldt-difference.png").is_file()
    assert json.loads((scene_folder / "scene-compare" / "compare.json").read_text())["ldt"]["psnr"] is None


def test_a_frame_that_is_timed_compiles_nothing_and_keeps_nothing(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SMALL_SCENE)
    renderer, frame = timed_frame(ldtrefl.load_scene(tmp_path / "scene.toml"), "ldt")
    assert "frames_kept" not in frame.stats.counters and frame.stats.counters["objects_peeled"] == 1
    assert np.array_equal(renderer.render().image, frame.image)


def test_a_mesh_is_compared_on_a_stage(run: Callable[..., Done], scene_folder: Path) -> None:
    (scene_folder / "thing.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    done = run("compare", "thing.obj", "--on", "mirror-ball", "--size", "48x32", "--methods", "ldt")
    assert done.status == 0 and not done.errors, done
    report = json.loads((scene_folder / "thing-compare" / "compare.json").read_text())
    assert report["ldt"]["ssim"] > 0.99
