"""One mesh for all objects that name the same file, or the same shape and parameters: it is made, and counted, once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from ldtrefl.scene.mesh import Mesh


class HasGeometry(Protocol):
    """An object of a scene (``description.py``)."""

    @property
    def shape(self) -> str | None:
        """A procedural shape."""

    @property
    def mesh(self) -> str | Mesh | None:
        """A file, or a mesh itself, in place of a shape."""

    @property
    def params(self) -> Mapping[str, object]:
        """Of the shape."""

    @property
    def smooth(self) -> bool | None:
        """True if facets that the mesh leaves flat are to be smooth."""

    @property
    def geometry(self) -> Mesh:
        """The mesh that these name, made when it is first asked for."""

    def share_geometry(self, mesh: Mesh) -> None:
        """Take this mesh as ``geometry``."""


class SharedGeometries:
    """The meshes of objects, by what they are made of."""

    def __init__(self) -> None:
        self._made: dict[tuple[str | None, str | Mesh | None, str, bool], Mesh] = {}

    def give(self, entry: HasGeometry) -> None:
        """Give an object its mesh, unless it has one: that of an object before it, or else its own.

        Raises:
            InputError: its mesh cannot be had.
        """
        if "geometry" in vars(entry):
            return
        params = repr(sorted(entry.params.items(), key=repr)) if entry.params else ""
        source = entry.shape, entry.mesh, params, entry.shape is None and entry.smooth is True
        if source in self._made:
            entry.share_geometry(self._made[source])
        else:
            self._made[source] = entry.geometry
