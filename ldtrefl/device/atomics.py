"""Atomic operations for kernels whose items share memory: Warp's own are plain ones on the CPU."""

from __future__ import annotations

import warp as wp

KEEP_LARGEST = """
#if defined(__CUDA_ARCH__)
    atomicMax((long long*)(values.data + index), (long long)value);
#else
    auto* place = values.data + index;
    auto seen = __atomic_load_n(place, __ATOMIC_RELAXED);
    while (seen < value &&
        !__atomic_compare_exchange_n(place, &seen, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {}
#endif
"""


@wp.func_native(KEEP_LARGEST)
def keep_largest(values: wp.array(dtype=wp.int64), index: int, value: wp.int64):
    """``values[index] = max(values[index], value)``, whoever else does the same: Warp's own is not atomic on the CPU.

    The largest does not depend on the order, so the image does not depend on the threads.
    """
    ...


TAKE_PLACE = """
#if defined(__CUDA_ARCH__)
    return atomicAdd((int*)count.data, 1);
#else
    return __atomic_fetch_add((int*)count.data, 1, __ATOMIC_RELAXED);
#endif
"""


@wp.func_native(TAKE_PLACE)
def take_place(count: wp.array(dtype=wp.int32)) -> wp.int32:
    """``count[0]``, which is then one more, whoever else does the same: Warp's own is not atomic on the CPU."""
    ...


ADD_TO = """
#if defined(__CUDA_ARCH__)
    atomicAdd((unsigned long long*)(values.data + index), (unsigned long long)value);
#else
    __atomic_fetch_add(values.data + index, value, __ATOMIC_RELAXED);
#endif
"""


@wp.func_native(ADD_TO)
def add_to(values: wp.array(dtype=wp.int64), index: int, value: wp.int64):
    """``values[index] += value``, whoever else does the same: Warp's own is not atomic on the CPU."""
    ...
