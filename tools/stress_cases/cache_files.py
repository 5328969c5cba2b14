"""Case 15: files of the map cache whose hash is right but whose contents no builder wrote, and what is no file at all.

Every field of a file, or some of its numbers, is set to an impossible value. Then a process peels an object, finds the
file where its own would be, and traces rays. Contents that are impossible must be refused with a warning and made anew,
with the same answers. Contents that are possible (a plane in another place) may be believed, and give the answers that
follow from them: but no memory may be read that is not there, and no ray may hang.
"""

from __future__ import annotations

import functools
import itertools
import json
import logging
import os
import signal
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xxhash

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.files.map_cache import MapCache, keep_maps_in
from ldtrefl.files.map_file import HEADER, MAGIC, Entry
from ldtrefl.ldt.peel import peel_mesh
from ldtrefl.scene import shapes
from ldtrefl.world.device_mesh import DeviceMesh

from .inputs import rays_about
from .outcomes import Outcome

NAME = "15 cache files"
SECONDS = 20
BELIEVED, REFUSED, OTHER_ANSWERS, TRACEBACK, SILENT = 10, 11, 12, 70, 13
"""A child's exit status."""

NUMBERS = (-1, 0, 1, 3, 2**30, 2**31 - 1, -(2**31))
LENGTHS = (0.0, -1.0, 1e30, 3e38, float("nan"), float("inf"))
VALUES: tuple[Any, ...] = (
    None, True, -1, 0, 1, 2**31, 2**70, 0.5, 1e300, float("nan"), float("inf"), "8", [], {}, [[]],
    [0, 0, 0], [-1, 8, 8], [1e300] * 3, [2**40] * 3, [1, 2, 3, 4], [float("nan")] * 3,
)  # fmt: skip

Contents = tuple[dict[str, np.ndarray], dict[str, object]]
Spoiled = tuple[str, Callable[[MapCache, str], None]]
"""What was done, and what puts it into the place of a file."""


def run(rays: int, pictures: int) -> list[Outcome]:
    """``rays`` is not used; about a file for each of ``pictures`` pixels, of each kind of maps."""
    ldtrefl.set_threads(1)
    outcomes = []
    device = launch.resolve_device("cpu")
    mesh = shapes.make("torus_knot", {"segments": [130, 40]})
    geometry = DeviceMesh(mesh, device)
    origins, directions = rays_about(mesh, 400)
    generator = np.random.default_rng(14)
    for what, search, trusted in (("triangles", "exact", False), ("patches", "exact", True), ("maps", "linear", False)):

        def answers(search: str = search, trusted: bool = trusted) -> tuple[bool, bytes]:
            """Whether the maps came from the file, and what they answer."""
            peeled = peel_mesh(geometry, 32, search=search, trusted=trusted)
            hits = peeled.trace(origins, directions, search=search)
            return peeled.from_cache, np.column_stack([hits.t, hits.triangle, hits.normal]).tobytes()

        with tempfile.TemporaryDirectory() as folder:
            cache = MapCache(folder)
            keep_maps_in(cache)
            truth = answers()[1]
            key = cache.files()[0][0].stem
            good = cache.load(key)
            assert good is not None
            assert answers() == (True, truth)
            # The file that is mapped here is replaced, never written into.
            every = list(spoiled_fields(good.arrays, good.values))
            chosen = generator.permutation(len(every))[:pictures]
            spoils = [*spoiled_files(good), *(every[i] for i in chosen)]
            spoils += [scattered(good, generator) for _ in range(pictures // 2)]
            outcomes.append(_judged(what, spoils, cache, key, functools.partial(_child, answers, truth)))
            keep_maps_in(None)
    ldtrefl.set_threads()
    return outcomes


def _judged(what: str, spoils: list[Spoiled], cache: MapCache, key: str, child: Callable[[], int]) -> Outcome:
    outcome = Outcome(NAME, f"{what} that hash right", "ldt")
    outcome.limit = f"refused with a line and made anew, or believed; no signal, no traceback, <= {SECONDS} s"
    start, refused = time.perf_counter(), 0
    for name, spoil in spoils:
        _cleared(cache.path(key))
        spoil(cache, key)
        status = _forked(child)
        outcome.tried += 1
        refused += status == REFUSED
        if status not in (BELIEVED, REFUSED):
            outcome.defects += 1
            print(f"{what}, {name}: {f'signal {-status}' if status < 0 else f'status {status}'}")
    _cleared(cache.path(key))
    outcome.what += f" ({refused} refused)"
    outcome.passed = outcome.defects == 0
    outcome.seconds = time.perf_counter() - start
    return outcome


def _forked(child: Callable[[], int]) -> int:
    """The exit status of a function in a child process, negative for a signal."""
    number = os.fork()
    if number == 0:
        status = TRACEBACK
        try:
            signal.alarm(SECONDS)
            status = child()
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(number, 0)[1])


def _child(answers: Callable[[], tuple[bool, bytes]], truth: bytes) -> int:
    said: list[str] = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: said.append(record.getMessage())  # type: ignore[method-assign]
    logger = logging.getLogger("ldtrefl")
    logger.addHandler(handler)
    logger.propagate = False
    from_cache, found = answers()
    if from_cache:
        return BELIEVED
    if not said or any("\n" in line for line in said):
        return SILENT
    return REFUSED if found == truth else OTHER_ANSWERS


def _cleared(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        path.rmdir()
    path.unlink(missing_ok=True)


def spoiled_fields(arrays: dict[str, np.ndarray], values: dict[str, object]) -> Iterator[Spoiled]:
    """Each array and each value of a file, left out or set to what it cannot be."""
    for name, array in arrays.items():
        others = {
            "left out": None,
            "empty": array[:0],
            "one short": array[:-1],
            "one more": np.append(array, array[-1:]),
            "half": array[: array.size // 2],
            "in two rows": array[: array.size // 2 * 2].reshape(2, -1),
            "wider": array.astype(np.float64),
            "of other bits": array.view(np.dtype(f"V{array.itemsize}")),
            "one number": array[:1].reshape(()),
        }
        numbers = LENGTHS if array.dtype.kind == "f" else NUMBERS
        for number, place in itertools.product(numbers, ("first", "last", "every")):
            changed = array.copy()
            where = {"first": slice(0, 1), "last": slice(-1, None), "every": slice(None)}[place]
            with np.errstate(all="ignore"):
                changed[where] = np.asarray(number).astype(array.dtype)
            others[f"{place} {number}"] = changed
        if array.dtype == np.float32:  # the bits of triangles and kinds
            for number in NUMBERS:
                others[f"every bits {number}"] = np.full(array.shape, number, np.int32).view(np.float32)
        for how, other in others.items():
            kept = {**arrays, name: other} if other is not None else {n: a for n, a in arrays.items() if n != name}
            yield f"{name} {how}", functools.partial(_stored, contents=(kept, values))
    for name in values:
        yield (
            f"{name} left out",
            functools.partial(_stored, contents=(arrays, {n: values[n] for n in values if n != name})),
        )
        for other in VALUES:
            yield f"{name} {other}", functools.partial(_stored, contents=(arrays, {**values, name: other}))


def scattered(good: Entry, generator: np.random.Generator) -> Spoiled:
    """Some numbers of one array, changed where they stand."""
    name = list(good.arrays)[generator.integers(len(good.arrays))]
    changed = good.arrays[name].copy()
    places = generator.integers(changed.size, size=generator.integers(1, 50))
    bits = changed.view(np.uint8).reshape(changed.size, -1)
    for place in places:
        bits[place] = generator.integers(0, 256, bits.shape[1])
    contents = ({**good.arrays, name: changed}, good.values)
    return f"{name} at {len(places)} places", functools.partial(_stored, contents=contents)


def spoiled_files(good: Entry) -> list[Spoiled]:
    """Files whose text says what no text can, and what is no file or not the user's alone."""
    shape: dict[str, Any] = {"arrays": {}, "values": good.values}
    texts = {
        "nothing": {},
        "a list": [],
        "no arrays": {"values": good.values},
        "arrays in a list": {**shape, "arrays": []},
    }
    places = {
        "an object": ["|O", [1], 0],
        "before": ["<f4", [4], -64],
        "beyond": ["<f4", [4], 1 << 40],
        "huge": ["<f4", [1 << 62, 1 << 62], 0],
        "negative": ["<f4", [-1], 0],
        "no shape": ["<f4", None, 0],
        "no type": ["what", [1], 0],
        "nothing": [],
    }
    spoils: list[Spoiled] = [
        (f"text: {what}", functools.partial(_written, text=json.dumps(text).encode())) for what, text in texts.items()
    ]
    for what, place in places.items():
        text = json.dumps({**shape, "arrays": dict.fromkeys(good.arrays, place)}).encode()
        spoils.append((f"place: {what}", functools.partial(_written, text=text)))
    spoils += [
        ("deep text", functools.partial(_written, text=b"[" * 200_000)),
        ("long number", functools.partial(_written, text=b"9" * 10_000)),
        ("no text", functools.partial(_written, text=b"\xff\x00")),
        ("an empty file", lambda cache, key: cache.path(key).touch(0o600)),
        ("a pipe", lambda cache, key: os.mkfifo(cache.path(key), 0o600)),
        ("a folder", lambda cache, key: cache.path(key).mkdir()),
        ("a link", lambda cache, key: cache.path(key).symlink_to("/dev/zero")),
        ("a loop", lambda cache, key: cache.path(key).symlink_to(cache.path(key))),
        ("a large file", _large),
        ("writable by all", functools.partial(_stored, contents=(good.arrays, good.values), mode=0o666)),
    ]
    if os.geteuid() == 0:
        spoils.append(("somebody else's", functools.partial(_stored, contents=(good.arrays, good.values), owner=12345)))
    return spoils


def _stored(cache: MapCache, key: str, *, contents: Contents, mode: int = 0o600, owner: int = -1) -> None:
    cache.store(key, *contents)
    cache.path(key).chmod(mode)
    os.chown(cache.path(key), owner, -1)


def _written(cache: MapCache, key: str, *, text: bytes) -> None:
    body = text + bytes(1 << 12)
    header = HEADER.pack(MAGIC, HEADER.size + len(body), len(text), xxhash.xxh3_64_intdigest(body))
    cache.path(key).write_bytes(header + body)
    cache.path(key).chmod(0o600)


def _large(cache: MapCache, key: str) -> None:
    with cache.path(key).open("wb") as file:
        file.truncate(1 << 40)  # with nothing in it: it takes no room
    cache.path(key).chmod(0o600)
