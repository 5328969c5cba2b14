"""The kernels that are foreseen for a first frame are those that it launches."""

import subprocess
import sys

import pytest

RENDER = """
import sys
import ldtrefl
from ldtrefl.device import build_ahead, kernel_cache, launch
from ldtrefl.frame.first_frame import foresee_a_frame
foresee_a_frame("cuda:0")
assert not build_ahead._state.known
foresee_a_frame(None)
assert build_ahead._state.known
scene = ldtrefl.load_scene("scenes/teapot.toml")
ldtrefl.render(scene, sys.argv[1])
launched = {kernel for kernel, _ in kernel_cache._state.loaded}
for name, kernels in (("idle", build_ahead._state.known - launched), ("missed", launched - build_ahead._state.known)):
    print(name, *sorted(f"{kernel.func.__module__}.{kernel.func.__name__}" for kernel in kernels))
"""

SOON_COMPILED = ("ldtrefl.device.", "ldtrefl.scene.", "ldtrefl.world.")
"""Where kernels are that the scene itself needs: small ones, and the first ones to be launched."""


@pytest.mark.parametrize("method", ["ldt", "bvh"])
def test_a_frame_launches_what_is_foreseen_and_little_else(method: str) -> None:
    """If this fails, a kernel was renamed, added or is no longer needed: the lists are ``OF_EVERY_SCENE`` of
    ``first_frame.py``, and what ``first_kernels`` of the method gives."""
    command = [sys.executable, "-c", RENDER, method]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (_, *idle), (_, *missed) = (line.split() for line in done.stdout.splitlines())
    assert idle == []
    assert [name for name in missed if not name.startswith(SOON_COMPILED)] == []
