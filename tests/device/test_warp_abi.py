"""What is private to Warp: layouts that are not known are told apart, and structs are copied as Warp lays them out."""

import ctypes
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.device import kernel_cache, launch, warp_abi
from ldtrefl.device.recorded_launch import record_launch
from ldtrefl.device.thread_self_test import MixedArguments
from tests.device.launches import add_number


class OtherBounds(ctypes.Structure):
    """Launch bounds with one member more."""

    _fields_ = (*warp_abi.BOUNDS_FIELDS, ("stride", ctypes.c_size_t))


def with_another(command: Any, **replaced: Any) -> Any:
    """A recorded launch as a Warp of another layout might give it."""
    names = ("kernel", "params", "hooks", "block_dim")
    return SimpleNamespace(**{name: getattr(command, name) for name in names} | replaced)


def test_unknown_layouts_are_not_called(tmp_path: Path) -> None:
    device = launch.resolve_device(None)
    command = record_launch(add_number, [wp.zeros(10, dtype=int, device=device)], device)
    folders = kernel_cache.folders()
    assert warp_abi.unknown_layout(command, folders) is None
    bounds, *arguments = command.params
    name = command.kernel.module.get_module_identifier(block_dim=1)
    source = next(path for path in (folder / name / f"{name}.cpp" for folder in folders) if path.exists()).read_text()
    (tmp_path / name).mkdir()
    (tmp_path / name / f"{name}.cpp").write_text(re.sub(r"(_cpu_forward\()", r"\1void *workspace, ", source))
    unknown = {
        "other bounds": with_another(command, params=[OtherBounds(), *arguments]),
        "no bounds": with_another(command, params=arguments),
        "hidden argument": with_another(command, params=[bounds, *arguments, ctypes.c_void_p()]),
        "long numbers": with_another(command, params=[bounds, ctypes.c_int64(0), *arguments[1:]]),
        "blocks": with_another(command, block_dim=256),
        "no hooks": with_another(command, hooks=None),
        "no entry": with_another(command, hooks=SimpleNamespace(forward=None)),
        "renamed": with_another(command, hooks=SimpleNamespace(run=command.hooks.forward)),
    }
    for what, other in unknown.items():
        assert warp_abi.unknown_layout(other, folders), what
    assert warp_abi.unknown_layout(command, [tmp_path]) == "a kernel's entry point takes other arguments"
    assert warp_abi.unknown_layout(command, [tmp_path / "none"])


def test_other_trees_than_are_known_are_not_read(tmp_path: Path) -> None:
    """Whatever is changed in what Warp's header says of its trees; a header that is not there, or no text."""
    assert warp_abi.bvh_is_known()
    header = tmp_path / "bvh.h"
    for part in warp_abi.BVH_LAYOUT:
        header.write_text(warp_abi.BVH_HEADER.read_text().replace(part, part.swapcase()))
        assert not warp_abi.bvh_is_known(header), part
    assert not warp_abi.bvh_is_known(tmp_path / "none")
    header.write_bytes(b"\xff\xfe\xfa")
    assert not warp_abi.bvh_is_known(header)


def test_structs_without_their_memory() -> None:
    device = launch.resolve_device(None)
    structs = []
    for k in range(3):
        one = MixedArguments()
        one.flag, one.offset, one.scale = wp.uint8(k), wp.float64(k + 0.25), wp.vec3(k, k + 1, k + 2)
        one.values = wp.zeros(4 + k, dtype=float, device=device)
        structs.append(one)
    public = wp.array(structs, dtype=MixedArguments, device=device).numpy()
    made = warp_abi.array_of_structs(structs, MixedArguments, device)
    for name in ("flag", "offset", "scale"):
        np.testing.assert_array_equal(made.numpy()[name], public[name])
    np.testing.assert_array_equal(made.numpy()["values"]["data"], public["values"]["data"])
    assert warp_abi.array_bytes(made) == made.numpy().nbytes
    assert len(warp_abi.array_of_structs([], MixedArguments, device)) == 0
