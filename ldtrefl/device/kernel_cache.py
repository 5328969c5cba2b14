"""Loading kernels without Warp's own messages, with one notice before the first is compiled.

Warp keeps compiled kernels in a folder (``WARP_CACHE_PATH``, or ``warp`` in the user's cache folder). Where that cannot
be written, kernels are compiled into a folder of this process, which is removed when the process ends.
"""

from __future__ import annotations

import atexit
import logging
import os
import shutil
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

import warp as wp

from ldtrefl.base.errors import InputError
from ldtrefl.base.standard_error import caught_stderr
from ldtrefl.device import build_ahead, warp_abi

ROOM_BYTES = 4 << 20
"""Bytes that must fit into the folder before a kernel is compiled: all kernels of a render take 1 MB. On a full disk
Warp's compiler leaves broken files or ends the process."""

NOTICE = "compiling kernels for the first time, which takes up to half a minute (they are kept in {})"
"""Measured: 4 s for `peel`, 8 s for a render on two cores that do nothing else, twice that where others have one."""

_log = logging.getLogger("ldtrefl")


class _State:
    """What the process has found out and made. ``lock`` guards it."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.loaded: set[tuple[wp.Kernel, str]] = set()  # with the names of their devices
        self.is_started = False
        self.is_announced = False  # whether the notice, or a warning in its place, was given
        self.is_checked = False  # whether Warp's own folder has been found good or bad
        self.own_folder: Path | None = None  # where kernels go if Warp's folder is bad
        self.log_level: int | None = None  # Warp's level while it is kept quiet


_state = _State()


def _after_fork_in_child() -> None:
    # The thread that held the lock does not exist here, and the parent removes its folder when it ends.
    _state.lock = threading.RLock()
    _state.own_folder, _state.is_checked = None, False
    if _state.log_level is not None:
        wp.config.log_level, _state.log_level = _state.log_level, None


os.register_at_fork(after_in_child=_after_fork_in_child)


def start_warp() -> None:
    """Initialise Warp, once.

    Raises:
        InputError: there is no folder that compiled kernels can be written to.
    """
    with _state.lock:
        if _state.is_started:
            return
        asked = wp.config.kernel_cache_dir
        with _quiet(), caught_stderr():
            try:
                wp.init()
            except OSError as error:
                if not wp.config.kernel_cache_dir or wp.config.kernel_cache_dir == asked:
                    raise
                # Warp does not start without its folder. For its own name it would append its version once more.
                _compile_elsewhere(wp.config.kernel_cache_dir, _reason(error))
                wp.config.kernel_cache_dir = str(_state.own_folder)
                wp.init()
        _state.is_started = True


def load(kernel: wp.Kernel, device: wp.Device) -> None:
    """Have a kernel ready on a device; compile it if Warp's cache does not hold it.

    Raises:
        InputError: it must be compiled, and no folder can be written.
    """
    key = (kernel, device.alias)
    if key in _state.loaded:
        return
    with _state.lock, _quiet():
        if key in _state.loaded:
            return
        if device.is_cpu:
            build_ahead.wait_for(kernel)
        is_compiled = warp_abi.is_compiled(kernel, device)
        if not is_compiled:
            _check_folder()
        if is_compiled is False and not _state.is_announced:
            _state.is_announced = True
            _log.info(NOTICE.format(_state.own_folder or wp.config.kernel_cache_dir))
        if is_compiled or _state.own_folder is None:
            try:
                # Of a damaged file LLVM prints in its own words what is wrong.
                with caught_stderr() if is_compiled else nullcontext():
                    _load(kernel, device)
                if is_compiled is False and device.is_cpu and wp.config.cache_kernels:
                    build_ahead.begin()
            except Exception as error:
                # A damaged file, or a folder that has become full: compile once more, elsewhere.
                if not is_compiled and not isinstance(error, OSError) and _has_room(wp.config.kernel_cache_dir):
                    raise
                warp_abi.forget_failure(kernel)
                _compile_elsewhere(wp.config.kernel_cache_dir, _reason(error))
                _load_elsewhere(kernel, device)
        else:
            _load_elsewhere(kernel, device)
        _state.loaded.add(key)


def folders() -> list[Path]:
    """The folders that hold the kernels which are loaded."""
    known = [_state.own_folder, wp.config.kernel_cache_dir]
    return [Path(folder) for folder in known if folder is not None]


def _load(kernel: wp.Kernel, device: wp.Device) -> None:
    """Load a kernel from Warp's folder; Warp compiles it if it is not there."""
    wp.load_module(kernel.module, device=device, max_workers=0)


def _load_elsewhere(kernel: wp.Kernel, device: wp.Device) -> None:
    """Load a kernel from our own folder; afterwards the setting of Warp's folder is as it was."""
    before = wp.config.kernel_cache_dir
    wp.config.kernel_cache_dir = str(_state.own_folder)
    try:
        _load(kernel, device)
    finally:
        wp.config.kernel_cache_dir = before


def _check_folder() -> None:
    """Find out, once, whether Warp's folder can take what is compiled."""
    if _state.is_checked or _state.own_folder is not None:
        return
    try:
        _write_probe(Path(wp.config.kernel_cache_dir))
    except OSError as error:
        _compile_elsewhere(wp.config.kernel_cache_dir, _reason(error))
    _state.is_checked = True


def _has_room(folder: str) -> bool:
    """Whether a folder can take what is compiled."""
    try:
        _write_probe(Path(folder))
    except OSError:
        return False
    return True


def _write_probe(folder: Path) -> None:
    """Write ``ROOM_BYTES`` bytes into a file of a folder, and remove it.

    Raises:
        OSError: they cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder) as probe:
        probe.write(bytes(ROOM_BYTES))
        probe.flush()
        os.fsync(probe.fileno())


def _compile_elsewhere(folder: str, reason: str) -> None:
    """Make a folder of our own for kernels in place of Warp's, and warn of it.

    Raises:
        InputError: none can be made.
    """
    if _state.own_folder is not None:
        return
    made = None
    try:
        made = Path(tempfile.mkdtemp(prefix="ldtrefl-kernels-"))
        _write_probe(made)
    except OSError as error:
        if made is not None:
            shutil.rmtree(made, ignore_errors=True)
        raise InputError(
            f"compiled kernels cannot be kept in {folder} ({reason}), nor in a temporary folder ({_reason(error)}); "
            f"set WARP_CACHE_PATH to a folder with {ROOM_BYTES >> 20} MB of room"
        ) from error
    build_ahead.stop()
    _state.own_folder = made
    atexit.register(_remove, made, os.getpid())
    _state.is_announced = True
    _log.warning(
        f"the kernel cache {folder} cannot be used ({reason}): kernels are compiled for this run alone, which takes up "
        "to half a minute; mend that folder, or set WARP_CACHE_PATH to another"
    )


def _remove(folder: Path, process: int) -> None:
    """Remove the folder at the end of the process that made it, and not of one that was forked from that."""
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)


def _reason(error: Exception) -> str:
    """What an error says, in one line."""
    words = error.strerror if isinstance(error, OSError) and error.strerror else str(error) or type(error).__name__
    return " ".join(words.split())


@contextmanager
def _quiet() -> Iterator[None]:
    """Have Warp print nothing but errors inside this block: it would greet and report every kernel on standard output.

    Nothing is changed where the user has set another log level than Warp's default. The caller holds the lock.
    """
    if wp.config.log_level != wp.LOG_INFO:
        yield
        return
    _state.log_level, wp.config.log_level = wp.config.log_level, wp.LOG_ERROR
    try:
        yield
    finally:
        if wp.config.log_level == wp.LOG_ERROR:
            wp.config.log_level = _state.log_level
        _state.log_level = None
