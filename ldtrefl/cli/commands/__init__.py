"""The commands, one a file, found by scanning this folder: delete a file and its command is gone.

A command's file has

- ``app``, a ``typer.Typer``: without a name, its one command is a command of the program, called as its function is;
  with a name, it is a group of commands, such as ``ldtrefl cache info``;
- ``PLACE_IN_HELP``, a number: the help lists commands in this order.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil

import typer

HELP = "Reflections on curved objects by layered depth textures, compared with ray tracing."


@functools.cache
def all_commands() -> typer.Typer:
    """The program: every command."""
    program = typer.Typer(add_completion=False, pretty_exceptions_enable=False, no_args_is_help=False, help=HELP)
    modules = [importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    for module in sorted(modules, key=lambda module: int(module.PLACE_IN_HELP)):
        program.add_typer(module.app)
    return program
