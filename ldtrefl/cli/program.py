"""Runs a command, and turns what it raises into an exit status and one line.

Exit status: 0 done, 2 the input is wrong, 130 stopped by Ctrl-C, 1 anything else. In each case but the first there is
one line on standard error, and a traceback only for a fault of our own. If the reader of standard output has gone, as
in ``| head``, that is no fault.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import TextIO

import typer
from typer.exceptions import TyperException

from ldtrefl.base.errors import InputError, printable
from ldtrefl.base.standard_error import log_on_stderr
from ldtrefl.cli.commands import all_commands
from ldtrefl.cli.printing import ReaderGone

_PROGRAM = all_commands()
"""Made when this file is imported, which takes long: while a command runs, Ctrl-C raises an exception, and imports
would swallow it."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command line, by default with the arguments of this process; the exit status."""
    message = ""
    try:
        with log_on_stderr():
            result = _PROGRAM(arguments, standalone_mode=False, prog_name="ldtrefl")
            status = result if isinstance(result, int) else 0
    except (InputError, TyperException) as error:
        status, message = 2, error.format_message() if isinstance(error, TyperException) else str(error)
    except (KeyboardInterrupt, typer.Abort):
        status = 130
    except ReaderGone:
        status = 0
    except MemoryError:
        status, message = 1, "there is not enough memory on this machine"
    except OSError as error:  # that of a file the user named is an InputError
        status, message = 1, f"{error.filename or 'standard output'}: {error.strerror or error}"
    if not _flushed(sys.stdout) and status == 0:
        status, message = 1, "standard output cannot be written"
    if message:
        with suppress(OSError):
            print(f"ldtrefl: {printable(' '.join(message.split()))}", file=sys.stderr, flush=True)
    _flushed(sys.stderr)
    return status


def _flushed(stream: TextIO) -> bool:
    """Write what ``stream`` still holds; whether that worked, or its reader has gone.

    A stream that cannot be written is pointed at nothing, so that the interpreter does not complain of it at its end.
    """
    try:
        stream.flush()
    except (OSError, ValueError) as error:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        return isinstance(error, BrokenPipeError)
    return True
