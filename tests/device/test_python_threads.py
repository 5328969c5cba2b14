"""Launches over Python threads, as they are made where this version of Warp is not known."""

from pathlib import Path

import pytest
import warp as wp

import ldtrefl
from ldtrefl.cli.program import main
from ldtrefl.device import launch
from ldtrefl.device.python_threads import PythonThreads
from tests.conftest import SMALL_SCENE
from tests.device.launches import add_number, assert_all_launched, assert_all_launched_by_threads


@pytest.mark.parametrize("count", [1, 2, 7, 129, 100_003])
def test_every_item_once_with_an_unknown_warp(unknown_warp: None, count: int) -> None:
    for threads in (2, 3):
        ldtrefl.set_threads(threads)
        assert_all_launched(count, 5)
        assert isinstance(launch._state.teams[threads], PythonThreads)


def test_several_threads_with_an_unknown_warp(unknown_warp: None) -> None:
    ldtrefl.set_threads(2)
    assert_all_launched_by_threads()


def test_an_unknown_warp_gives_the_same_bits(
    unknown_warp: None, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SMALL_SCENE)
    scene = ldtrefl.load_scene(path)
    ldtrefl.set_threads(1)
    alone = ldtrefl.render(scene)
    ldtrefl.set_threads(2)
    together = ldtrefl.render(scene)
    assert isinstance(launch._state.teams[2], PythonThreads)
    assert alone.reflector_mask.any() and alone.image.tobytes() == together.image.tobytes()
    assert main(["info", str(path)]) == 0
    said = [line for line in capfd.readouterr().out.splitlines() if "threads: " in line]
    assert len(said) == 1 and "[made up]" in said[0]


def test_what_a_slice_raises_is_raised() -> None:
    launch.resolve_device(None)
    run = PythonThreads(2).prepare(add_number, ["not an array"], wp.get_device("cpu"))
    with pytest.raises(Exception, match="array"):
        run(0, 100)
