"""What signals do to the program, from its first line to its last."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.conftest import SMALL_SCENE


@pytest.fixture
def scene_folder(tmp_path: Path) -> Path:
    """A folder that holds ``scene.toml``."""
    (tmp_path / "scene.toml").write_text(SMALL_SCENE)
    return tmp_path


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.parametrize("delay", [0.0, 0.3, 1.0])
def test_signals_end_it_without_a_traceback(scene_folder: Path, number: int, status: int, delay: float) -> None:
    """From the moment that our own code runs; before, the interpreter is starting."""
    marked = (
        # What a background job of a shell ignores, and its children with it, counts again.
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"
        "import sys; sys.argv = ['ldtrefl', 'compare', 'scene.toml', '--methods', 'ldt,bvh,envmap'];"
        "import ldtrefl.__main__ as program; handle = program._handle;"
        "program._handle = lambda *a: (handle(*a), print('ready', flush=True));"
        "sys.exit(program.main())"
    )
    child = subprocess.Popen(
        [sys.executable, "-c", marked],
        cwd=scene_folder,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "WARP_CACHE_PATH": str(scene_folder / "kernels")},  # so that it is still compiling
    )
    assert child.stdout is not None and child.stdout.readline() == "ready\n"
    time.sleep(delay)
    child.send_signal(number)
    _, said = child.communicate(timeout=60)
    # Until everything is imported SIGTERM has nothing to tidy up, and ends the process by itself.
    assert child.returncode in ({status, -number} if number == signal.SIGTERM else {status}), said
    assert all(line.startswith("ldtrefl: compiling kernels") for line in said.splitlines()), said
    assert not list(scene_folder.rglob(".*"))


def test_signals_that_the_caller_ignores_stay_ignored(scene_folder: Path) -> None:
    code = (
        "import signal; [signal.signal(n, signal.SIG_IGN) for n in (signal.SIGHUP, signal.SIGINT)];"
        "import ldtrefl.__main__ as program; program.main(); import os; os.kill(os.getpid(), signal.SIGHUP);"
        "os.kill(os.getpid(), signal.SIGINT); print('still here')"
    )
    done = subprocess.run([sys.executable, "-c", code, "methods"], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "still here" in done.stdout


def test_a_process_does_what_was_registered_for_its_end(scene_folder: Path) -> None:
    """Its memory is not freed piece by piece, but standard output is written and ``atexit`` heeded."""
    code = (
        "import atexit, sys; atexit.register(print, 'at the end', flush=True);"
        "import ldtrefl.__main__ as program; program.run()"
    )
    for arguments, status in ((["info", "scene.toml"], 0), (["info", "nothing.toml"], 2)):
        command = [sys.executable, "-c", code, *arguments]
        done = subprocess.run(command, cwd=scene_folder, capture_output=True, text=True, check=False)
        assert done.returncode == status, done.stderr
        assert done.stdout.endswith("at the end\n") and ("camera" in done.stdout) == (status == 0)


def test_the_program_imports_no_library_that_a_command_may_not_need() -> None:
    """They take half of its start."""
    code = "import sys, ldtrefl.cli.program; print(*{'networkx', 'scipy', 'skimage', 'trimesh'} & {*sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
