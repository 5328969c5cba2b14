"""The program: ``ldtrefl`` and ``python -m ldtrefl``. Signals and streams are set up before anything heavy is imported.

Ctrl-C ends it with status 130 at any time, SIGTERM with 143 and SIGHUP with 129, without a traceback; files that are
being written are removed first.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any, NoReturn

INTERRUPTED = 130
"""Exit status after Ctrl-C: 128 and the number of the signal, as shells have it."""
PATIENCE = 0.5
"""Seconds in which a signal should have ended the command."""


def run() -> NoReturn:
    """The program as a process: run the command line, and end.

    What was registered for the end is done. Then the system takes all memory back at once: the interpreter would look
    for garbage first, and free a million objects one by one, for a third of a second.
    """
    status = main()
    atexit._run_exitfuncs()
    os._exit(status)


def main() -> int:
    """Run the command line; the exit status."""
    _open_missing_streams()
    _handle("SIGINT", _leave_at_once)
    # What is imported stays: to look for garbage among it, again and again, takes a quarter of the imports' time.
    gc.disable()
    from ldtrefl.cli import program  # noqa: PLC0415  nearly a second, in which Ctrl-C must not end in a traceback

    gc.freeze()
    gc.enable()
    _watch_over_compiler()
    _handle("SIGTERM", _leave_cleanly)
    _handle("SIGHUP", _leave_cleanly)
    try:
        _handle("SIGINT", signal.default_int_handler)
        return program.main()
    except KeyboardInterrupt:  # before the command begins, or after its end
        return INTERRUPTED
    finally:
        _handle("SIGINT", _leave_at_once)
        gc.unfreeze()  # who goes on may want it all freed: libraries complain of what is left at an ordinary end


def _open_missing_streams() -> None:
    """Open what the caller has closed (``>&-``): else the next file that is opened is taken for standard output."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number: this one
    # Names that are no text in this encoding are written as escapes.
    sys.stdout = sys.stdout or open(1, "w", encoding="utf-8", closefd=False)
    sys.stderr = sys.stderr or open(2, "w", encoding="utf-8", closefd=False)
    sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]


def _handle(name: str, handler: Callable[[int, FrameType | None], Any]) -> None:
    """Set a handler, unless the system has no such signal or the caller wants it ignored (``nohup``)."""
    number = getattr(signal, name, None)
    if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
        signal.signal(number, handler)


def _watch_over_compiler() -> None:
    """Let a signal end the program while Warp compiles, on this thread or on one that this one waits for: a call of up
    to six seconds, in which no handler runs.

    Warp moves a compiled kernel to its place when it is whole, so nothing half-written is left.
    """
    source, sink = os.pipe()
    os.set_blocking(sink, False)
    signal.set_wakeup_fd(sink, warn_on_full_buffer=False)
    threading.Thread(target=_leave_from_warp, args=(source,), daemon=True).start()


def _leave_from_warp(source: int) -> None:
    number = os.read(source, 1)[0]
    while True:
        time.sleep(PATIENCE)
        frame = sys._current_frames().get(threading.main_thread().ident or 0)
        while frame is not None:
            name = frame.f_globals.get("__name__", "")
            if name.split(".")[0] == "warp" or name == "ldtrefl.device.build_ahead":
                os._exit(128 + number)
            frame = frame.f_back


def _leave_at_once(number: int, _: FrameType | None) -> NoReturn:
    """For imports and the interpreter's own end, where an exception would be traced back or swallowed."""
    os._exit(128 + number)


def _leave_cleanly(number: int, _: FrameType | None) -> NoReturn:
    """Every block that is writing a file removes it."""
    raise SystemExit(128 + number)


if __name__ == "__main__":
    run()
