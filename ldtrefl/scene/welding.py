"""Welding: which rows of numbers are equal, bit by bit.

A hash table with chains: a row's hash says which chain it belongs to, and along the chain rows are compared. Nothing is
rounded. Only the time depends on the hash.
"""

from __future__ import annotations

import secrets

import numpy as np
import warp as wp

from ldtrefl.device import launch

AHEAD = wp.constant(16)
"""Rows by which the memory of a row's chain is asked for ahead of it."""


@wp.func
def mixed(value: wp.uint64, more: wp.uint64):
    """A hash of two numbers (the finaliser of SplitMix64)."""
    x = (value ^ more) * wp.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> wp.uint64(30))) * wp.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> wp.uint64(27))) * wp.uint64(0x94D049BB133111EB)
    return x ^ (x >> wp.uint64(31))


FETCH = """
#if !defined(__CUDA_ARCH__)
    __builtin_prefetch((const int*)chains.data + chain);
#endif
"""


@wp.func_native(FETCH)
def fetch_chain(chains: wp.array(dtype=wp.int32), chain: int):
    """Have memory bring the beginning of a chain."""
    ...


@wp.func
def chain_of(keys: wp.array2d(dtype=wp.uint64), i: int, seed: wp.uint64, mask: wp.uint64) -> int:
    """The chain that a row belongs to."""
    hashed = seed
    for j in range(keys.shape[1]):
        hashed = mixed(hashed, keys[i, j])
    return int(hashed & mask)


@launch.kernel
def find_firsts(
    first: int,
    # In:
    keys: wp.array2d(dtype=wp.uint64),
    seed: wp.uint64,
    mask: wp.uint64,  # number of chains - 1
    # Out:
    chains_out: wp.array(dtype=wp.int32),  # first row of each chain of different rows
    next_out: wp.array(dtype=wp.int32),  # the next row of its chain
    firsts_out: wp.array(dtype=wp.int32),  # the first row that is equal to each
):
    """Find the first row equal to one row in its chain, or else add it to the chain. Rows are taken in order."""
    i = first + wp.tid()
    if i + AHEAD < keys.shape[0]:
        fetch_chain(chains_out, chain_of(keys, i + AHEAD, seed, mask))
    chain = chain_of(keys, i, seed, mask)
    found = int(-1)
    k = int(chains_out[chain])
    while k >= 0 and found < 0:
        differences = wp.uint64(0)
        for j in range(keys.shape[1]):
            differences = differences | (keys[i, j] ^ keys[k, j])
        if differences == wp.uint64(0):
            found = k
        k = next_out[k]
    if found < 0:
        next_out[i] = chains_out[chain]
        chains_out[chain] = i
        found = i
    firsts_out[i] = found


def first_of_equals(rows: np.ndarray) -> np.ndarray | None:
    """(n,) int32: the first row that is equal to each of (n, k) float64; None if no two are.

    -0 is equal to 0.
    """
    device = launch.resolve_device("cpu")
    count = len(rows)
    keys = np.ascontiguousarray(rows + 0.0).view(np.uint64)  # adding 0 makes -0 a 0
    chains = 1 << max(2 * count - 1, 1).bit_length()
    # A secret seed, so that no file can be made whose rows all fall into one chain.
    seed = wp.uint64(secrets.randbits(64))
    heads = wp.full(chains, -1, dtype=wp.int32, device=device)
    following = wp.empty(count, dtype=wp.int32, device=device)
    firsts = wp.empty(count, dtype=wp.int32, device=device)
    shared = wp.array(keys, dtype=wp.uint64, device=device, copy=False)
    launch.launch_in_order(find_firsts, count, [shared, seed, wp.uint64(chains - 1), heads, following, firsts], device)
    found = firsts.numpy()
    return None if np.array_equal(found, np.arange(count, dtype=np.int32)) else found
