"""The self-test of native threads: whether this version of Warp calls kernels as ``warp_abi.py`` has it."""

from __future__ import annotations

import os
import threading

import numpy as np
import warp as wp

from ldtrefl.device import kernel_cache, warp_abi
from ldtrefl.device.cpu_threads import SLICES_PER_THREAD, ThreadTeam
from ldtrefl.device.recorded_launch import record_launch

ITEMS = 1000
"""Items of the self-test's kernel: some for each slice of two threads, and not as many for each."""


@wp.struct
class MixedArguments:
    """An argument with a member of each kind, of different sizes."""

    flag: wp.uint8
    offset: wp.float64
    scale: wp.vec3
    values: wp.array(dtype=float)


@wp.kernel(module="unique", enable_backward=False)
def add_mixed_arguments(first: int, given: MixedArguments, values_out: wp.array(dtype=float)):
    """Each thread adds something of every member, and its item's value, to its item's result."""
    i = first + wp.tid()
    added = given.scale[0] + given.scale[1] * given.scale[2] + float(given.offset) + float(given.flag)
    values_out[i] = values_out[i] + given.values[i] + added


class _Result:
    """What was found out, once in a process."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.is_known = False
        self.fault: str | None = None


_result = _Result()


def _after_fork_in_child() -> None:
    # The thread that held the lock does not exist here.
    _result.lock = threading.Lock()


os.register_at_fork(after_in_child=_after_fork_in_child)


def why_not_native() -> str | None:
    """Why slices cannot be shared in native code with this Warp; None if they can. Tried once in a process.

    A small kernel is called natively for several ranges of items and compared with Warp's own launch: every item must
    have been done once, and none beyond.
    """
    with _result.lock:
        if not _result.is_known:
            try:
                _result.fault = _try_native_threads()
            except Exception as error:
                _result.fault = f"{type(error).__name__}: {' '.join(str(error).split())}"
            _result.is_known = True
        return _result.fault


def _try_native_threads() -> str | None:
    """Run the small kernel both ways: what is wrong, None if nothing is."""
    given, cpu = MixedArguments(), wp.get_device("cpu")
    given.flag, given.offset, given.scale = wp.uint8(3), wp.float64(0.5), wp.vec3(1.0, 2.0, 4.0)
    given.values = wp.array(np.arange(ITEMS, dtype=np.float32), dtype=float, device=cpu)
    expected, found = (wp.zeros(ITEMS, dtype=float, device=cpu) for _ in range(2))
    command = record_launch(add_mixed_arguments, [given, found], cpu)
    unknown = warp_abi.unknown_layout(command, kernel_cache.folders())
    if unknown is not None:
        return unknown
    team = ThreadTeam(2)
    try:
        run = team.prepare(add_mixed_arguments, [given, found], cpu)
        for first, items in ((0, ITEMS - 1), (1, 2 * SLICES_PER_THREAD), (ITEMS // 2, 5)):
            run(first, items)
            inputs = [first, given, expected]
            wp.launch(add_mixed_arguments, dim=items, inputs=inputs, device=cpu, record_tape=False)
    finally:
        team.end()
    same = np.array_equal(expected.numpy(), found.numpy())
    return None if same else "a kernel that was tried gave other values than Warp's own launch"
