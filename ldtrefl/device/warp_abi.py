"""All that is private to Warp, in one place.

Warp promises nothing about what stands here, and its next version may differ. So everything is guarded.
``unknown_layout`` says, before any native code is called, what is not as it was in the versions that this was written
for (1.18 and 1.19 agree). ``thread_self_test.py`` then runs a small kernel and compares. If anything is amiss, launches
go by Warp's public functions (``python_threads.py``). The other functions have a slower public way, or an answer that
means "not known".
"""

from __future__ import annotations

import ctypes
import re
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol, cast

import warp as wp

BOUNDS_FIELDS = (("shape", ctypes.c_uint32 * 1), ("size", ctypes.c_size_t), ("coord_mult", ctypes.c_size_t))
"""Warp's ``launch_bounds_t`` of a kernel of one dimension, as ``CALL_KERNEL`` fills it."""

ENTRY_POINT = re.compile(
    r"WP_API void \w+_cpu_forward\(\s*wp::launch_bounds_t<1> ?\* ?\w+,\s*wp_args_\w+ ?\* ?\w+\s*\)"
)
"""A kernel's entry point in the C++ that Warp writes: bounds, and a structure of arguments, both by address."""

CALL_KERNEL = """
    struct Warp {
        // Run a kernel of one dimension for items 0 to items - 1; wp.tid() is the item.
        static void call_kernel(uint64_t entry_point, uint64_t items, void* arguments) {
            wp::launch_bounds_t<1> bounds = {};
            bounds.shape[0] = (uint32_t)items;
            bounds.size = items;
            bounds.coord_mult = 1;
            ((void (*)(wp::launch_bounds_t<1>*, void*))entry_point)(&bounds, arguments);
        }
    };
"""
"""C++ for the body of a ``wp.func_native``."""


READ_BVH = """
    struct WarpBvh {
        enum { DEPTH = BVH_QUERY_STACK_SIZE };  // nodes from the root to a leaf, at most

        struct Node {
            wp::BVHPackedNodeHalf low, high;  // sides of its box: x, y and z

            CUDA_CALLABLE bool is_leaf() const { return low.b != 0; }
            // Of a leaf the first of its ``items``, and the one after its last; of any other node its two children.
            CUDA_CALLABLE int first() const { return (int)low.i; }
            CUDA_CALLABLE int second() const { return (int)high.i; }
        };

        const wp::BVHPackedNodeHalf *lows, *highs;
        const int* items;  // in the order of the leaves
        int root;

        static CUDA_CALLABLE WarpBvh of(uint64_t id) {
            const wp::BVH& bvh = *(const wp::BVH*)id;
            return {bvh.node_lowers, bvh.node_uppers, bvh.primitive_indices, *bvh.root};
        }
        CUDA_CALLABLE Node node(int number) const {
            return {wp::bvh_load_node(lows, number), wp::bvh_load_node(highs, number)};
        }
    };
"""
"""C++ for the body of a ``wp.func_native``: the tree of a ``wp.Bvh``. Use it only if :func:`bvh_is_known`."""

BVH_LAYOUT = (
    """
struct BVHPackedNodeHalf {
    float x;
    float y;
    float z;
    // For non-leaf nodes:
    // - 'lower.i' represents the index of the left child node.
    // - 'upper.i' represents the index of the right child node.
    //
    // For leaf nodes:
    // - 'lower.i' indicates the start index of the primitives in 'primitive_indices'.
    // - 'upper.i' indicates the index just after the last primitive in 'primitive_indices'
    unsigned int i : 31;
    unsigned int b : 1;
};
""",
    "    BVHPackedNodeHalf* node_lowers;\n    BVHPackedNodeHalf* node_uppers;\n",
    "    int* primitive_indices;\n",
    "    int* root;\n",
    "inline BVH bvh_get(uint64_t id) { return *(BVH*)(id); }\n",
    "inline wp::BVHPackedNodeHalf bvh_load_node(const wp::BVHPackedNodeHalf* nodes, int index)",
    "#define BVH_QUERY_STACK_SIZE (32)\n",
)
"""What Warp's header says of a ``wp.Bvh``, as ``READ_BVH`` has it."""

BVH_HEADER = Path(wp.__file__).parent / "native" / "bvh.h"
"""Warp's own, which kernels are compiled with."""


def bvh_is_known(header: Path = BVH_HEADER) -> bool:
    """Whether the nodes of a ``wp.Bvh`` are laid out as ``READ_BVH`` reads them. If not, its queries are the way."""
    try:
        text = header.read_text()
    except (OSError, UnicodeError):
        return False
    return all(part in text for part in BVH_LAYOUT)


def unknown_layout(command: wp.Launch, folders: Sequence[Path]) -> str | None:
    """What is unknown about how a recorded CPU launch is called; None if all is known. No native code is called.

    Args:
        command: the launch.
        folders: the kernel caches in which the C++ of its kernel may be.
    """
    try:
        bounds, *arguments = command.params
        fields = tuple((name, type_) for name, type_ in type(bounds)._fields_)
        if fields != BOUNDS_FIELDS:
            return f"launch bounds are {', '.join(name for name, _ in fields)}"
        if len(arguments) != len(command.kernel.adj.args):
            return f"{len(arguments)} values for {len(command.kernel.adj.args)} parameters"
        if not callable_natively(command):
            return "a kernel has no entry point, or its block several threads, or an int is no int32"
        if not ENTRY_POINT.search(_generated_source(command, folders)):
            return "a kernel's entry point takes other arguments"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return None


def entry_point(command: wp.Launch) -> int:
    """The address of a recorded CPU kernel's code."""
    return ctypes.cast(command.hooks.forward, ctypes.c_void_p).value or 0


def callable_natively(command: wp.Launch) -> bool:
    """Whether ``CALL_KERNEL`` may call this kernel, with the number of an item written over its first argument."""
    return (
        command.block_dim == 1
        and type(command.params[0])._fields_ == BOUNDS_FIELDS
        and type(command.params[1]) is ctypes.c_int32
        and entry_point(command) != 0
    )


class NativeCall:
    """How ``CALL_KERNEL`` calls a kernel: the same for all recorded launches of it."""

    def __init__(self, command: wp.Launch) -> None:
        # The entry point reads the arguments one after another as in a C structure. Its size is in whole words.
        fields: list[tuple[str, Any]] = [(f"argument_{k}", type(value)) for k, value in enumerate(command.params[1:])]
        fields.append(("end", ctypes.c_uint64 * 0))
        self._type = type("Arguments", (ctypes.Structure,), {"_fields_": fields})
        self._hooks = command.hooks
        self.is_possible = callable_natively(command)
        self.entry_point = entry_point(command)
        self.argument_bytes = ctypes.sizeof(self._type)

    def is_for(self, command: wp.Launch) -> bool:
        """Whether a launch is of the same code: Warp may have loaded the kernel anew."""
        return command.hooks is self._hooks

    def arguments(self, command: wp.Launch) -> ctypes.Structure:
        """The arguments of a recorded launch, as the entry point reads them."""
        return self._type(*command.params[1:])


def _generated_source(command: wp.Launch, folders: Sequence[Path]) -> str:
    """The C++ that Warp wrote for a kernel, which it keeps beside the object file."""
    name = command.kernel.module.get_module_identifier(block_dim=command.block_dim)
    paths = [folder / name / f"{name}.cpp" for folder in folders]
    return next((path for path in paths if path.exists()), paths[0]).read_text()


def is_compiled(kernel: wp.Kernel, device: wp.Device) -> bool | None:
    """Whether Warp's kernel cache holds this kernel; None if that cannot be known."""
    try:
        module = kernel.module
        block_dim = 1 if device.is_cpu else module.options["block_dim"]
        folder = Path(wp.config.kernel_cache_dir) / module.get_module_identifier(block_dim=block_dim)
        made = module._get_compile_output_name(device, block_dim=block_dim)
        described = module._get_meta_name(block_dim=block_dim)
        return bool(wp.config.cache_kernels) and (folder / made).exists() and (folder / described).exists()
    except Exception:
        return None


def compile_for_cpu(kernel: wp.Kernel) -> None:
    """Compile a kernel into Warp's cache without loading it, if it is not there. If that fails, whoever loads it will
    compile it, and hear why that fails."""
    try:
        module = kernel.module
        module.get_module_hash(1)
        module._compile(wp.get_device("cpu"), options=module.resolved_options[1])
    except Exception:
        forget_failure(kernel)


@contextmanager
def headers_of_thread(thread: int | None) -> Iterator[None]:
    """Let this thread compile with the headers that another one has precompiled, in place of making its own for a
    second and a half. Kernels of the CPU differ in no option, so nothing is written there any more."""
    shared = False
    own = threading.get_ident()
    try:
        runtime = wp._src.context.runtime
        with runtime._pch_dirs_lock:
            if thread in runtime._pch_dirs and own not in runtime._pch_dirs:
                runtime._pch_dirs[own] = runtime._pch_dirs[thread]
                shared = True
    except Exception:
        shared = False
    try:
        yield
    finally:
        if shared:
            with runtime._pch_dirs_lock:
                runtime._pch_dirs.pop(own, None)


def forget_failure(kernel: wp.Kernel) -> None:
    """Let Warp try again to build a kernel that it could not build."""
    wp.set_module_options({}, module=kernel.module)


def array_of_structs(structs: Sequence[object], dtype: type, device: wp.Device) -> wp.array:
    """Values of a ``wp.struct`` class as an array that kernels read.

    They are copied bit by bit. ``wp.array`` takes five times as long, as it finds out what a struct is made of. Whoever
    keeps the array must keep the structs, too: they own the memory that it points to.
    """
    try:
        contents = [bytes(one.__ctype__()) for one in cast("Sequence[_StructValue]", structs)]
        size = int(cast("_StructType", dtype).numpy_dtype()["itemsize"])
    except (AttributeError, KeyError, TypeError):
        return wp.array(list(structs), dtype=dtype, device=device)
    if any(len(one) != size for one in contents):
        return wp.array(list(structs), dtype=dtype, device=device)
    made = wp.empty(len(contents), dtype=dtype, device="cpu")
    if contents:
        ctypes.memmove(made.ptr, b"".join(contents), size * len(contents))
    return made.to(device)


class _StructType(Protocol):
    """A class made by ``wp.struct``."""

    def numpy_dtype(self) -> dict[str, Any]: ...


class _StructValue(Protocol):
    """A value of such a class."""

    def __ctype__(self) -> ctypes.Structure: ...


def array_bytes(array: wp.array) -> int:
    """Bytes that the elements of an array take."""
    return array.size * wp.types.type_size_in_bytes(array.dtype)
