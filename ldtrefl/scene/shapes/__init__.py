"""Procedural meshes by name, centred at the origin: ``make("torus_knot", {"p": 2, "q": 3})``.

A shape is one file of this folder, found by scanning it: delete the file and the shape is gone. Sphere: radius 1. Box,
hollow box, room: -1 to 1. Plane: -1 to 1 in x and y, facing +z. Torus: about z, radii 1 and ``minor``. Every other
shape fits in the cube from -1 to 1. ``segments`` sets the tessellation. Closed shapes are closed bit by bit: vertices
that stand in one place, split for normals or UVs, have the same coordinates.

Imports ``mesh.py`` and what is below it. Start with ``base.py``, which says what a shape is; ``sphere.py`` is an
example.
"""

from __future__ import annotations

import functools
import importlib
import json
import pkgutil
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError, first_fault, unknown_name
from ldtrefl.base.sharing import shared_while_used
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Shape


@functools.cache
def all_shapes() -> dict[str, Shape]:
    """Every shape by name."""
    found = {}
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values():
            if isinstance(value, Shape):
                found[value.name] = value
    return dict(sorted(found.items()))


def names() -> list[str]:
    """The shapes' names, sorted."""
    return list(all_shapes())


def make(name: str, params: Mapping[str, object] | None = None) -> Mesh:
    """The shape called ``name``. Equal calls return the same mesh, so that its maps are made once.

    Raises:
        InputError: no such shape or parameter, a value that is not allowed, or more memory is needed than is allowed.
    """
    if name not in all_shapes():
        raise unknown_name("shape", name, all_shapes())
    try:
        written = json.dumps(params or {}, sort_keys=True, default=_in_json)
    except (TypeError, ValueError, RecursionError) as error:  # names of two kinds, lists within themselves
        raise InputError(f"params: not names and values ({error})") from None
    shape = all_shapes()[name]
    try:
        values = shape.checked(**json.loads(written))
    except ValidationError as error:
        raise first_fault(error, {"": list(shape.parameters)}).within("params") from None
    # Asked for even if the mesh is in use already: it is part of another scene then.
    what = " and ".join(f"params.{parameter}" for parameter in shape.smaller)
    budget.take(shape.needed_bytes(**values), f"the shape '{name}'", what)
    return _make(name, written)


def _in_json(value: object) -> object:
    """NumPy's numbers and arrays as plain ones, anything else in words: no parameter takes those."""
    return value.tolist() if isinstance(value, (np.generic, np.ndarray)) else str(value)


@shared_while_used
def _make(name: str, params: str) -> Mesh:
    shape = all_shapes()[name]
    return shape.make(**shape.checked(**json.loads(params)))
