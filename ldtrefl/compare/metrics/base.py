"""What a metric is: a function from a frame and the true one to a number, and how that number is shown.

The decorator ``metric`` makes one. The function's parameters say what it needs, by the names of ``Comparison``'s
fields::

    @metric("mean", heading="mean difference", format=".4f")
    def mean_difference(image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> float:
        return float(np.abs(image - reference)[mask].mean())

It can still be called as the function that it was. An average over an empty mask is NaN.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, ParamSpec

import numpy as np

from ldtrefl.frame.bounce_hits import FirstHits
from ldtrefl.frame.gbuffer import GBuffer

Parameters = ParamSpec("Parameters")

LAST = 1000
"""The place of a metric that does not say where it stands."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """A method's frame and the true one, as metrics see them. A field is None where there is no such thing."""

    image: np.ndarray
    """(h, w, 3) linear radiance, the method's."""
    reference: np.ndarray
    """(h, w, 3) linear radiance, the true one."""
    mask: np.ndarray
    """(h, w) bool: pixels that see a reflector. Metrics are taken over these."""
    hits: FirstHits | None = None
    """Where the first reflected rays end; None for methods without rays."""
    truth: FirstHits | None = None
    """Where they truly end."""
    texel_sizes: np.ndarray | None = None
    """(objects,) world units: the length of a texel of each object's maps."""
    gbuffer: GBuffer | None = None
    """What the camera sees."""


FIELDS = tuple(field.name for field in dataclasses.fields(Comparison))


class Metric(Generic[Parameters]):
    """A metric: called as the function that it was made from, and shown under a heading."""

    def __init__(
        self, function: Callable[Parameters, float], name: str, heading: str | None, format: str, place: int
    ) -> None:
        """Make a metric of a function; see :func:`metric`.

        Raises:
            TypeError: a parameter is no field of ``Comparison``.
        """
        self.function = function
        self.name, self.heading, self.format, self.place = name, heading, format, place
        self.needs = tuple(inspect.signature(function).parameters)
        for need in self.needs:
            if need not in FIELDS:
                raise TypeError(f"metric '{name}': no comparison has '{need}' (there are {', '.join(FIELDS)})")
        functools.update_wrapper(self, function)

    def __call__(self, *arguments: Parameters.args, **named: Parameters.kwargs) -> float:
        """The metric of what is given."""
        return self.function(*arguments, **named)

    def of(self, comparison: Comparison) -> float | None:
        """The metric of a comparison; None if that lacks something that the metric needs."""
        needed: dict[str, object] = {name: getattr(comparison, name) for name in self.needs}
        if any(value is None for value in needed.values()):
            return None
        return self.function(**needed)  # type: ignore[call-arg, arg-type]  # names were checked


def metric(
    name: str, *, heading: str | None, format: str, place: int = LAST
) -> Callable[[Callable[Parameters, float]], Metric[Parameters]]:
    """Make a function a metric.

    Args:
        name: its key in ``compare.json``.
        heading: its column in the table of ``ldtrefl compare``; None for none.
        format: how its value is written there, such as ``.4f``.
        place: columns are sorted by this number, then by name: metrics of images have 10 to 40, of hits 50 to 70, and
            those that do not say come last.
    """

    def made(function: Callable[Parameters, float]) -> Metric[Parameters]:
        return Metric(function, name, heading, format, place)

    return made
