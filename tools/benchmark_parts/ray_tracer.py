"""What the benchmark asks of a ray tracer, ours (``ours.py``) or somebody else's (``rivals.py``)."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np

from .rays import Rays


class RayTracer:
    """A scene of one mesh, ready for its first ray when made.

    ``closest`` and ``occluded`` take and give numpy arrays; ``closest`` gives everything that the tracer tells of a
    hit. ``prepared`` puts the rays where the tracer wants them, and gives a call that traces them and asks for as
    little as the tracer can be asked for.
    """

    name: ClassVar[str]
    is_default: ClassVar[bool] = True
    """Whether its users get it so without options: then its public calls are timed, too."""
    has_threads: ClassVar[bool] = True
    """Whether tracing uses more than one."""
    builds_on_all: ClassVar[bool] = False
    """Whether building uses all cores, whatever ``set_threads`` says."""
    most_triangles: ClassVar[int] = 1 << 30
    """Meshes of more are left out: so many trees at a time would not fit into memory."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        """Build for (n, 3) float32 vertices and (m, 3) int32 faces."""
        raise NotImplementedError

    @classmethod
    def set_threads(cls, threads: int) -> None:
        """Use so many threads from now on."""

    def takes(self, rays: Rays) -> bool:
        """Whether it can trace rays of this kind at all."""
        return True

    def takes_arrays(self, rays: Rays) -> bool:
        """Whether it has a call for them that takes and gives numpy arrays."""
        return self.takes(rays)

    def closest(self, rays: Rays) -> object:
        """All that it tells of closest hits, as numpy arrays."""
        raise NotImplementedError

    def hits(self, rays: Rays) -> tuple[np.ndarray, np.ndarray]:
        """(n,) distances, +inf on a miss, and (n,) int32 triangles, -1 on a miss."""
        raise NotImplementedError

    def occluded(self, rays: Rays) -> np.ndarray:
        """(n,) bool, by any-hit queries."""
        raise NotImplementedError

    def prepared(self, rays: Rays) -> Callable[[], object]:
        """A call that traces these rays for the least answer."""
        raise NotImplementedError
