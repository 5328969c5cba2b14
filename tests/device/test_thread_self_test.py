"""The self-test of native threads: this Warp passes it, and a wrong call or an error is found out."""

import pytest
import warp as wp

from ldtrefl.device import launch, thread_self_test, warp_abi
from ldtrefl.device.recorded_launch import record_launch
from ldtrefl.device.thread_self_test import MixedArguments, why_not_native


@launch.kernel
def add_one(first: int, given: MixedArguments, values_out: wp.array(dtype=float)):
    """Takes the arguments of the self-test's kernel, and does something else."""
    i = first + wp.tid()
    values_out[i] = values_out[i] + 1.0


def test_this_warp_is_known(not_self_tested: None) -> None:
    launch.resolve_device(None)
    assert why_not_native() is None


def test_it_runs_once(not_self_tested: None, monkeypatch: pytest.MonkeyPatch) -> None:
    launch.resolve_device(None)
    assert why_not_native() is None
    monkeypatch.delattr(thread_self_test, "_try_native_threads")
    assert why_not_native() is None


def test_a_wrong_call_is_found_out(not_self_tested: None, monkeypatch: pytest.MonkeyPatch) -> None:
    device = launch.resolve_device(None)
    wrong = record_launch(add_one, [MixedArguments(), wp.zeros(1, dtype=float, device=device)], device)
    address = warp_abi.entry_point(wrong)
    monkeypatch.setattr(warp_abi, "entry_point", lambda command: address)
    assert "other values" in str(why_not_native())


def test_what_raises_is_found_out(not_self_tested: None, monkeypatch: pytest.MonkeyPatch) -> None:
    launch.resolve_device(None)
    monkeypatch.delattr(warp_abi, "NativeCall")
    assert "NativeCall" in str(why_not_native())
