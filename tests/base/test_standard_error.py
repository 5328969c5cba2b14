"""What native libraries print on standard error is dropped, what others print is not, and descriptor 2 stays whole."""

import subprocess
import sys
from pathlib import Path

import pytest

HEAD = """
import os, sys, threading, time
from ldtrefl.base.standard_error import caught_stderr
def native(text):  # as a native library prints
    os.write(2, text.encode())
"""

THREADS = """
before = os.fstat(2)
stop = threading.Event()
def catch(k):
    for i in range(300):
        with caught_stderr():
            native(f"libpng error: {k} {i}\\n")
            with caught_stderr():
                time.sleep(0.0005 * (k % 2))
            try:
                with caught_stderr():
                    raise ValueError
            except ValueError:
                pass
def say():
    for i in range(2000):
        print(f"said {i}", file=sys.stderr)
        time.sleep(0.0002)
threads = [threading.Thread(target=catch, args=(k,)) for k in range(4)] + [threading.Thread(target=say)]
for thread in threads: thread.start()
for thread in threads: thread.join()
after = os.fstat(2)
native("end\\n")
sys.exit(0 if (before.st_dev, before.st_ino) == (after.st_dev, after.st_ino) else 3)
"""

FORKS = """
with caught_stderr():
    native("libpng error: x\\n")
    print("parent", file=sys.stderr, flush=True)
    child = os.fork()
    if child == 0:
        native("child in a block\\n")
        with caught_stderr():
            native("libpng warning: y\\n")
        native("child after it\\n")
        os._exit(0)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
sys.exit(status)
"""

DESCRIPTORS = """
with caught_stderr():
    native("libpng error: x\\n")
count = len(os.listdir("/proc/self/fd"))
for _ in range(50):
    with caught_stderr():
        native("libpng error: x\\n")
sys.exit(0 if len(os.listdir("/proc/self/fd")) == count else 4)
"""

WARP_BY_THREADS = """
import warnings
import ldtrefl
from ldtrefl.device import launch
threads = [threading.Thread(target=launch.resolve_device, args=(None,)) for _ in range(8)]
for thread in threads: thread.start()
for thread in threads: thread.join()
native("end\\n")
"""


def run(script: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", HEAD + script]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_several_threads_and_blocks_in_one_another() -> None:
    done = run(THREADS)
    assert done.returncode == 0, done.stderr[-500:]
    lines = done.stderr.splitlines()
    assert lines[-1] == "end" and sorted(lines[:-1]) == sorted(f"said {i}" for i in range(2000))


def test_forks_inside_a_block() -> None:
    done = run(FORKS)
    assert done.returncode == 0
    assert sorted(done.stderr.splitlines()) == ["child after it", "child in a block", "parent"]


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="needs /proc")
def test_no_descriptor_is_left_open() -> None:
    """But for the file that stands in for standard error, which the first block opens."""
    done = run(DESCRIPTORS)
    assert done.returncode == 0 and done.stderr == ""


def test_warp_starts_without_a_word() -> None:
    done = run(WARP_BY_THREADS)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "end\n")


@pytest.mark.parametrize("closing", ["2>&-", "2>/dev/full", ">&- 2>&-"])
def test_standard_error_that_takes_nothing(closing: str, tmp_path: Path) -> None:
    script = f"""
with caught_stderr():
    try: native("libpng error: x\\\\n")
    except OSError: pass
    try: print("lost", file=sys.stderr)
    except OSError: pass
import ldtrefl
ldtrefl.Raycaster([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
open({str(tmp_path / "reached")!r}, "w").close()
os._exit(0)
"""
    file = tmp_path / "script.py"
    file.write_text(HEAD + script.replace("\\\\n", "\\n"))
    done = subprocess.run(["sh", "-c", f'"{sys.executable}" "{file}" {closing}'], timeout=120, check=False)
    assert done.returncode == 0 and (tmp_path / "reached").exists()
