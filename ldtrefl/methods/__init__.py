"""The reflection methods, one per file, found by scanning this folder: delete a file and its method is gone.

Imports ``frame``, ``ldt`` and what is below them; no method imports another. Start with ``base.py``, the contract.
Folders hold what several methods share: ``virtual/``, for those that move vertices to where a mirror shows them.
``cube_maps/`` holds the parts of ``envmap``.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
from pathlib import Path

from ldtrefl.base.errors import unknown_name
from ldtrefl.methods.base import Method


@functools.cache
def all_methods() -> dict[str, type[Method]]:
    """Every method by name."""
    found = {}
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        if module.name != "base" and not module.ispkg:
            loaded = importlib.import_module(f"{__name__}.{module.name}")
            for value in vars(loaded).values():
                if isinstance(value, type) and issubclass(value, Method) and value.__module__ == loaded.__name__:
                    found[value.name] = value
    return dict(sorted(found.items()))


def find_method(name: str) -> type[Method]:
    """The method called ``name``.

    Raises:
        InputError: there is none.
    """
    if name not in all_methods():
        raise unknown_name("method", name, all_methods())
    return all_methods()[name]
