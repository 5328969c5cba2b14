"""A launch that Warp has recorded and not made yet, to be run for ranges of its items by one thread or by many."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import warp as wp

from ldtrefl.device import kernel_cache

RangeLaunch = Callable[[int, int], None]
"""Runs a kernel for a range of items: the number of the first one, and how many. Returns when all are done."""


def record_launch(kernel: wp.Kernel, arguments: Sequence[object], cpu: wp.Device) -> wp.Launch:
    """Record a launch of ``kernel(first, *arguments)`` on the CPU, for one item; the kernel is loaded.

    Raises:
        InputError: the kernel must be compiled, and no folder can be written.
    """
    kernel_cache.load(kernel, cpu)
    return wp.launch(kernel, dim=1, inputs=[0, *arguments], device=cpu, record_cmd=True)


def on_this_thread(command: wp.Launch) -> RangeLaunch:
    """Run a recorded launch on the thread that asks for it."""

    def run(first: int, items: int) -> None:
        command.set_param_at_index(0, first)
        command.set_dim(items)
        command.launch()

    return run
