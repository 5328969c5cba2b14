"""Kernels are loaded wherever Warp's cache can or cannot be written, and without touching the user's settings."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import SMALL_SCENE

TRACE = """
import numpy as np
import ldtrefl
ldtrefl.set_threads(1)
caster = ldtrefl.Raycaster([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
hits = caster.trace([[0.2, 0.2, 3.0], [2.0, 2.0, 3.0]], [[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]])
assert hits.t.tolist() == [3.0, np.inf], hits.t
import os, warp as wp
print(wp.config.kernel_cache_dir, os.path.isdir(wp.config.kernel_cache_dir))
"""

SETTINGS = """
import os, sys
import warp as wp
def settings():
    return {name: value for name, value in vars(wp.config).items() if not name.startswith("__")}
level = int(sys.argv[1])
if level:
    wp.config.log_level = level
def check(what):
    changed = {name: (value, settings()[name]) for name, value in before.items() if settings()[name] != value}
    assert not changed and settings().keys() == before.keys(), (what, changed)
    assert dict(os.environ) == environment, what
before, environment = settings(), dict(os.environ)
import ldtrefl
from ldtrefl.device import launch
check("import")
launch.resolve_device(None)
before["kernel_cache_dir"] = wp.config.kernel_cache_dir  # as wp.init() does
check("start")
scene = ldtrefl.load_scene(sys.argv[2])
for method in ("ldt", "bvh"):
    ldtrefl.render(scene, method)
check("render")
"""


def run(command: list[str], cache: Path | str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *command],
        capture_output=True,
        text=True,
        env=os.environ | {"WARP_CACHE_PATH": str(cache)} | environment,
        timeout=300,
        check=False,
    )


def assert_works_elsewhere(done: subprocess.CompletedProcess[str], cache: Path | str, why: str) -> None:
    """The kernels ran; one line said that they were not kept; the folder that they were in is gone."""
    assert done.returncode == 0, done.stderr
    lines = done.stderr.splitlines()
    assert len(lines) == 1 and f"kernel cache {cache}" in lines[0] and why in lines[0], done.stderr
    assert "WARP_CACHE_PATH" in lines[0]


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system with room for 64 kB."""
    folder = tmp_path / "tiny"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(folder)]
    try:
        mounted = subprocess.run(mount, capture_output=True, check=False).returncode == 0
    except OSError:
        mounted = False
    if not mounted:
        pytest.skip("file systems cannot be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.parametrize("level", [0, 10, 30, 40])
def test_settings_of_warp_stay_as_they_are(level: int, tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SMALL_SCENE)
    done = subprocess.run(
        [sys.executable, "-c", SETTINGS, str(level), str(scene)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    # By default Warp greets and reports each kernel: nobody asked for that. Who asked for more hears it.
    assert level == 10 or done.stdout == ""


def test_an_empty_cache_is_announced_once(tmp_path: Path) -> None:
    command = ["-m", "ldtrefl", "info", "genus3"]
    first, second = (run(command, tmp_path) for _ in range(2))
    assert first.returncode == second.returncode == 0
    assert first.stdout == second.stdout and "closed" in first.stdout
    lines = first.stderr.splitlines()
    assert len(lines) == 1 and lines[0].startswith("ldtrefl: compiling kernels"), first.stderr
    assert str(tmp_path) in lines[0] and second.stderr == ""


def test_a_library_logs_it(tmp_path: Path) -> None:
    logged = "import logging\nlogging.basicConfig(level=logging.INFO)\n" + TRACE
    first, second = (run(["-c", logged], tmp_path) for _ in range(2))
    assert len(first.stderr.splitlines()) == 1 and "INFO:ldtrefl:compiling kernels" in first.stderr
    assert (second.returncode, second.stderr) == (0, "")


def test_a_file_in_place_of_the_folder(tmp_path: Path) -> None:
    cache = tmp_path / "file"
    cache.touch()
    done = run(["-c", TRACE], cache)
    assert_works_elsewhere(done, cache, "Not a directory")
    # Warp does not start without a folder: it keeps ours for as long as the process lives.
    folder, exists = done.stdout.split()
    assert exists == "True" and not Path(folder).parent.exists()


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs /proc")
def test_a_folder_that_cannot_be_made() -> None:
    assert_works_elsewhere(run(["-c", TRACE], "/proc/none"), "/proc/none", "")


def test_a_full_disk(tiny_disk: Path) -> None:
    done = run(["-c", TRACE], tiny_disk)
    assert_works_elsewhere(done, tiny_disk, "No space left")
    assert done.stdout.split()[0].startswith(str(tiny_disk)), "the setting is the user's again"


def test_no_room_anywhere(tiny_disk: Path) -> None:
    done = run(["-m", "ldtrefl", "info", "plane"], tiny_disk, TMPDIR=str(tiny_disk))
    lines = done.stderr.splitlines()
    assert done.returncode == 2 and len(lines) == 1, done.stderr
    assert lines[0].startswith("ldtrefl: ") and "WARP_CACHE_PATH" in lines[0] and "No space left" in lines[0]


def test_damaged_kernels(tmp_path: Path) -> None:
    first = run(["-c", TRACE], tmp_path)
    assert (first.returncode, first.stderr) == (0, ""), "a library says nothing of compiling unless it is asked"
    objects = list(tmp_path.rglob("*.o"))
    assert objects
    for length in (0, 100):
        for path in objects:
            path.write_bytes(path.read_bytes()[:length])
        assert_works_elsewhere(run(["-c", TRACE], tmp_path), tmp_path, "Failed to load")


def test_a_kernel_that_cannot_be_compiled_says_so(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        """
import warp as wp
from ldtrefl.device import launch
@launch.kernel
def broken(first: int, numbers: wp.array(dtype=int)):
    numbers[first + wp.tid()] = nothing_of_that_name
device = launch.resolve_device(None)
launch.launch(broken, 1, [wp.zeros(1, dtype=int, device=device)], device)
"""
    )
    done = run([str(script)], tmp_path / "cache")
    assert done.returncode == 1 and "nothing_of_that_name" in done.stderr and "kernel cache" not in done.stderr
