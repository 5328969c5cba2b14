"""What the cases about pictures share: frames by every method, and what they are held to where reflected rays end."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import ldtrefl
from ldtrefl.scene import shapes

from .outcomes import LINEAR_WORST, TEXELS, Outcome
from .paths import paths_of

OFF = 0.5
"""Texels from the true distance beyond which a reflected ray ends elsewhere."""

METHODS: dict[str, tuple[str, dict[str, str]]] = {
    "exact": ("ldt", {"quality": "exact"}),
    "balanced": ("ldt", {}),
    "fast": ("ldt", {"quality": "fast"}),
    "linear": ("ldt", {"search": "linear"}),
    "bvh": ("bvh", {}),
}
"""Name in the report -> method and options."""


def frames(scene: ldtrefl.Scene) -> Iterator[tuple[str, ldtrefl.Frame, float]]:
    """(name, frame, seconds) of every method."""
    for by, (method, options) in METHODS.items():
        start = time.perf_counter()
        frame = ldtrefl.render(scene, method, **options, samples=1)
        yield by, frame, time.perf_counter() - start


def not_finite(frame: ldtrefl.Frame) -> int:
    """Pixels that are not finite."""
    return int((~np.isfinite(frame.image).all(axis=2)).sum())


def judge_same_pictures(
    case: str, what: str, a: ldtrefl.Scene, b: ldtrefl.Scene, percent: float, most: float = 0.02
) -> list[Outcome]:
    """By every method: both scenes look the same, but for ``percent`` of the pixels that may differ by more than
    ``most``."""
    outcomes = []
    for (by, one, _), (_, other, seconds) in zip(frames(a), frames(b), strict=True):
        differ = np.abs(one.image - other.image).max(axis=2) > most
        outcome = Outcome(case, what, by, tried=differ.size, wrong_hits=int(differ.sum()), seconds=seconds)
        outcome.non_finite = not_finite(one) + not_finite(other)
        outcome.limit = f"<= {percent:g}% of the pixels differ by more than {most:g}"
        # Pictures that show no reflection are the same too, but say nothing.
        outcome.passed = min(frame.reflector_mask.mean() for frame in (one, other)) >= Held.reflector
        outcome.passed &= one.hits is not None and bool((one.hits.object >= 0).any())
        outcome.passed &= outcome.non_finite == 0 and bool(100.0 * differ.mean() <= percent)
        outcomes.append(outcome)
    return outcomes


def surroundings(scale: float = 8.0) -> ldtrefl.Object:
    """A room about everything with every third triangle missing: of the rays of a mirror, wherever it faces, some meet
    it and some leave."""
    room = shapes.make("room", {"segments": 4})
    return ldtrefl.Object(mesh=ldtrefl.Mesh(room.vertices, room.faces[np.arange(len(room.faces)) % 3 > 0]), scale=scale)


def reflected_hits(scene: ldtrefl.Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(h, w) arrays: object seen, distance of the reflected ray's hit, and the object hit, by :func:`paths_of`."""
    seen, *reflected = paths_of(scene, 1).ends
    if not reflected:  # no mirror is seen
        return seen.object, np.full(seen.object.shape, np.inf), np.full(seen.object.shape, -1)
    return seen.object, reflected[0].distance, reflected[0].object


@dataclass(frozen=True)
class Held:
    """What reflections are held to, and how much of them a picture must show so that the comparison means something."""

    percent: float = 0.2
    """Percent of the reflector's pixels that may end on another object, or ``OFF`` texels or more from the true
    distance; one pixel may in any case."""
    linear_percent: float = 2.0
    """The same for the paper's search, ``linear_off`` texels or more."""
    linear_off: float = LINEAR_WORST
    """More where a mirror sees itself: this search starts two texels and a half above its own surface, and ends as much
    before it, or several times as much along it."""
    lost: float = 0.002
    """Share of the reflector's pixels that the renderer or the reference alone may see, silhouettes; one pixel may in
    any case."""
    reflector: float = 0.03
    """Least share of the pixels that must see the reflector; 0 where none must."""
    hits: float = 0.02
    """Least share of the reflector's pixels whose ray must truly meet an object; 0 where none must."""


def judge_reflections(case: str, what: str, scene: ldtrefl.Scene, held: Held | None = None) -> list[Outcome]:
    """Where reflected rays end, against float64, on the pixels that see the same reflector."""
    held = held or Held()
    reference = reflected_hits(scene)
    mirrors = np.array([entry.is_reflector for entry in scene.objects] + [False])[reference[0]]
    is_shown = shows_enough(mirrors, reference[2] >= 0, held)
    texels = np.array([2 * half / TEXELS for half in _halves(scene)])
    outcomes = []
    for by, frame, seconds in frames(scene):
        outcome = judge_frame(frame, reference, mirrors, texels, held, by == "linear")
        outcome.case, outcome.what, outcome.by, outcome.seconds = case, what, by, seconds
        outcome.passed &= is_shown
        outcomes.append(outcome)
    return outcomes


def shows_enough(mirrors: np.ndarray, hits: np.ndarray, held: Held) -> bool:
    """Whether the reference sees as much of the reflector, and of objects in it, as a comparison needs; where it must
    see none, that it sees none."""
    seen, met = mirrors.mean(), hits[mirrors].mean() if mirrors.any() else 0.0
    enough = seen >= held.reflector if held.reflector > 0 else seen == 0
    return bool(enough and (met >= held.hits if held.hits > 0 else met == 0))


def judge_frame(
    frame: ldtrefl.Frame,
    reference: tuple[np.ndarray, np.ndarray, np.ndarray],
    mirrors: np.ndarray,
    texels: np.ndarray,
    held: Held,
    is_linear: bool,
) -> Outcome:
    """A frame against what :func:`reflected_hits` says, whose reflector's pixels are ``mirrors``, (h, w)."""
    _, distance, hit = reference
    outcome = Outcome(non_finite=not_finite(frame))
    allowed, worst = (held.linear_percent, held.linear_off) if is_linear else (held.percent, OFF)
    outcome.limit = (
        f"<= {allowed:g}% of the reflector's pixels end elsewhere (by {worst:g} texels), all pixels finite; "
        f"a reflector in >= {100 * held.reflector:g}% of the pixels, hits in >= {100 * held.hits:g}% of those"
    )
    same = frame.reflector_mask & mirrors
    outcome.tried = int(same.sum())
    if not outcome.tried:
        # No ray is reflected, and both must say so.
        outcome.passed = outcome.non_finite == 0 and not mirrors.any() and not frame.reflector_mask.any()
        return outcome
    assert frame.hits is not None
    ours, true = frame.hits.object[same] >= 0, hit[same] >= 0
    outcome.wrong_hits, outcome.wrong_misses = int((ours & ~true).sum()), int((true & ~ours).sum())
    both = ours & true
    error = np.abs(frame.hits.distance[same][both] - distance[same][both]) / texels[hit[same][both]]
    outcome.worst = float(error.max(initial=0.0))
    if len(error):
        outcome.p99, outcome.p999 = (float(value) for value in np.percentile(error, (99, 99.9)))
    # Written so that a distance that is no number is off.
    off = ~(error <= worst) | (frame.hits.object[same][both] != hit[same][both])
    outcome.disagree = outcome.wrong_hits + outcome.wrong_misses + int(off.sum())
    # Where one sees the reflector and the other does not, nothing is compared: that may be silhouettes alone.
    lost = int((frame.reflector_mask != mirrors).sum())
    outcome.passed = (
        outcome.non_finite == 0
        and outcome.disagree <= max(1.0, allowed / 100.0 * outcome.tried)
        and lost <= max(1.0, held.lost * max(mirrors.sum(), frame.reflector_mask.sum()))
    )
    return outcome


def _halves(scene: ldtrefl.Scene) -> list[float]:
    """Half the longest side of every object, in the world."""
    halves = []
    for entry in scene.objects:
        matrix = entry.world_from_object()
        low, high = entry.geometry.bounds
        halves.append(float((np.linalg.norm(matrix[:3, :3], axis=0) * (high - low)).max()) / 2)
    return halves
