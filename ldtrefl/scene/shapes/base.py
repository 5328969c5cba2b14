"""What a shape is: a function from checked parameters to a mesh, in a file of its own.

    @shape(needed_bytes=lambda segments: bytes_with_normals(2 * segments**2), smaller=("segments",), is_closed=False)
    def plane(segments: Segments = 1) -> Mesh:
        \"\"\"-1 to 1 in x and y, facing +z.\"\"\"
        return rectangle([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], segments)

The function's annotations are its parameters' limits, which pydantic checks; every parameter has a default.
``needed_bytes`` has the same parameters and estimates the memory, so that what is too large is refused before it is
made. ``surfaces.py`` and ``marching_cubes.py`` hold what shapes are made of; a shape of several parts, with a hard edge
between them, joins them (``joined``, as in ``hollow_box.py``). ``tests/scene/shapes/test_base.py`` checks every shape
that is found: by default it lies about the origin to float32's rounding, and fits in the cube from -1 to 1. What is
true of one shape alone is checked in a test of its own, with the helpers of that file.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import ConfigDict, Field, validate_call

from ldtrefl.scene.mesh import Mesh

Segments = Annotated[int, Field(strict=True, ge=1, le=4096)]
"""Segments along an edge."""
Around = Annotated[int, Field(strict=True, ge=3, le=8192)]
"""Segments around a circle."""
Grid = Annotated[int, Field(strict=True, ge=16, le=400)]
"""Cells along the longest side, which marching cubes samples."""
Fraction = Annotated[float, Field(strict=True, gt=0.0, lt=1.0)]
Flag = Annotated[bool, Field(strict=True)]

# Bytes at the peak of making and rendering, by tools/stress_cases/hostile.py's measure: process size over what the
# process has without the shape.
MADE_NORMALS_BYTES = 300
"""A triangle, where vertex normals are made from the triangles."""
KNOWN_NORMALS_BYTES = 250
"""A triangle, where the shape gives its vertex normals."""
CELL_BYTES = 60
"""A cell that marching cubes samples."""
MARCHED_BYTES = 110
"""A triangle that marching cubes gives, while the samples are there."""
FIXED_BYTES = 16 << 10
"""Any shape: what Python and the device keep for it."""


def bytes_with_normals(triangles: float) -> float:
    """Bytes of a shape that gives its vertex normals."""
    return FIXED_BYTES + KNOWN_NORMALS_BYTES * triangles


def bytes_without_normals(triangles: float) -> float:
    """Bytes of a shape whose vertex normals are made from its triangles."""
    return FIXED_BYTES + MADE_NORMALS_BYTES * triangles


def bytes_by_marching_cubes(cells: float, triangles: float) -> float:
    """Bytes of a surface by marching cubes: the samples are gone when the triangles are rendered."""
    return FIXED_BYTES + max(CELL_BYTES * cells + MARCHED_BYTES * triangles, MADE_NORMALS_BYTES * triangles)


@dataclass(frozen=True)
class Shape:
    """A shape that ``make`` knows by its name."""

    name: str
    make: Callable[..., Mesh]
    """Checked parameters -> the mesh."""
    checked: Callable[..., dict[str, object]]
    """Parameters -> all of them, checked, with the defaults of those not given. Raises pydantic's ValidationError."""
    needed_bytes: Callable[..., float]
    """Checked parameters -> the bytes that making and rendering the shape takes, an estimate."""
    smaller: tuple[str, ...]
    """The parameters that make it smaller."""
    is_closed: bool
    """Whether the shape with its default parameters is closed."""
    inwards: bool
    """Whether its front faces are seen from inside."""
    reach: float
    """Its largest coordinate with its default parameters."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of its parameters."""
        return tuple(inspect.signature(self.make).parameters)


def shape(
    *,
    needed_bytes: Callable[..., float],
    smaller: tuple[str, ...],
    is_closed: bool,
    inwards: bool = False,
    reach: float = 1.0,
) -> Callable[[Callable[..., Mesh]], Shape]:
    """Make a function a :class:`Shape`, which has its name; the class says what the arguments mean."""

    def made_of(function: Callable[..., Mesh]) -> Shape:
        signature = inspect.signature(function)

        @validate_call(config=ConfigDict(allow_inf_nan=False))
        @functools.wraps(function)
        def checked(*arguments: Any, **given: Any) -> Any:
            values = signature.bind(*arguments, **given)
            values.apply_defaults()
            return dict(values.arguments)

        return Shape(function.__name__, function, checked, needed_bytes, smaller, is_closed, inwards, reach)

    return made_of
