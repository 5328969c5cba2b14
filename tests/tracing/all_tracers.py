"""One tracer of each kind over a mesh."""

import numpy as np

import ldtrefl

NEAR = 1e-4
"""How far from the face of a box of side 2 a tracer may find it. The paper's search halves a step of a texel, 2 / 256,
eight times, to 3e-5; the others find it to float32's rounding."""


class LinearMaps:
    """A layered depth texture traced by the paper's search."""

    def __init__(self, mesh: ldtrefl.Mesh) -> None:
        self.maps = ldtrefl.peel(mesh.vertices, mesh.faces, search="linear")

    def trace(self, origins: np.ndarray, directions: np.ndarray) -> ldtrefl.Hits:
        return self.maps.trace(origins, directions, search="linear")


def all_tracers(mesh: ldtrefl.Mesh) -> list:
    return [
        LinearMaps(mesh),
        ldtrefl.peel(mesh.vertices, mesh.faces),
        ldtrefl.Raycaster(mesh.vertices, mesh.faces),
    ]
