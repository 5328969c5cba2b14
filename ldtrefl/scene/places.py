"""The key ``places`` of a scene file: an ``[[object]]`` that stands in many places.

    [[object]]
    name = "pearl"
    shape = "sphere"
    scale = 0.1
    places = [[0, 0, 1], [0, 1, 0], [1, 0, 0, 2.0]]  # [x, y, z] or [x, y, z, scale]

Each place becomes an object of its own, named after the table and the place's number: ``pearl.0``, ``pearl.1``,
``pearl.2``; without a name they have none. [x, y, z] is added to the table's ``translate``, and a fourth number is
multiplied with its ``scale``. All have one mesh.
"""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BeforeValidator, TypeAdapter, ValidationError

from ldtrefl.base.checked import LARGEST, SMALLEST, Number, Positive
from ldtrefl.base.errors import InputError, first_fault
from ldtrefl.scene.description import Object
from ldtrefl.scene.mesh import Mesh


def _with_scale(row: object) -> object:
    """A place with its scale, which is 1 if it is not given."""
    if not isinstance(row, list) or len(row) not in (3, 4):
        raise ValueError("should be [x, y, z] or [x, y, z, scale]")
    return (*row, 1.0)[:4]


def _not_empty(places: list[object]) -> list[object]:
    if not places:
        raise ValueError("should be a list of one place or more, got []")
    return places


_Place = Annotated[tuple[Number, Number, Number, Positive], BeforeValidator(_with_scale)]
_BY_KEY: TypeAdapter[Any] = TypeAdapter(dict[str, Annotated[list[_Place], AfterValidator(_not_empty)]])


def split_places(tables: dict[str, object]) -> tuple[dict[str, object], dict[int, np.ndarray]]:
    """A scene file's tables without the key; and the number of an ``[[object]]`` that has it -> (n, 4) float64: its
    places as x, y, z and scale.

    Raises:
        InputError: naming the key of places that are not allowed.
    """
    entries = tables.get("object")
    if not isinstance(entries, list):  # refused with the other tables
        return tables, {}
    numbers = [number for number, entry in enumerate(entries) if isinstance(entry, dict) and "places" in entry]
    try:
        checked = _BY_KEY.validate_python({f"object[{number}].places": entries[number]["places"] for number in numbers})
    except ValidationError as error:
        raise first_fault(error, {}) from None
    places = dict(zip(numbers, map(np.array, checked.values()), strict=True))
    rest = list(entries)
    for number in numbers:
        rest[number] = {key: value for key, value in entries[number].items() if key != "places"}
    return tables | {"object": rest}, places


def standing_in(entry: Object, places: np.ndarray) -> list[Object]:
    """Objects like ``entry``, which has its mesh, one in each of (n, 4) places.

    Raises:
        InputError: naming the place that gives a position or a size that is not allowed.
    """
    translate = np.add(entry.translate, places[:, :3])
    scale = np.multiply.outer(places[:, 3], entry.scale)
    sizes = scale.reshape(len(places), -1)
    wrong = (np.abs(translate) > LARGEST).any(axis=1) | (sizes < SMALLEST).any(axis=1) | (sizes > LARGEST).any(axis=1)
    for number in np.flatnonzero(wrong):
        try:
            dataclasses.replace(entry, translate=translate[number], scale=scale[number])
        except InputError as error:
            raise error.within(f"places[{number}]") from None
    kept = {field.name: getattr(entry, field.name) for field in dataclasses.fields(entry)}
    factors = map(tuple, scale.tolist()) if scale.ndim == 2 else scale.tolist()
    values = enumerate(zip(factors, map(tuple, translate.tolist()), strict=True))
    return [
        _unchecked(
            {**kept, "name": f"{entry.name}.{number}" if entry.name else "", "scale": factor, "translate": position},
            entry.geometry,
        )
        for number, (factor, position) in values
    ]


def _unchecked(values: dict[str, object], geometry: Mesh) -> Object:
    """An object of these values, which it takes over, and a mesh. They are not checked again: that would take longer
    than reading the file, and an object that gives back too much light would be warned of once a place."""
    made = object.__new__(Object)
    object.__setattr__(made, "__dict__", values)
    made.share_geometry(geometry)
    return made
