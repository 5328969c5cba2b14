"""Case 12: spoilt scenes, meshes, pictures and kept maps, through the command line.

Each file must give status 2 and one line, or status 0 and a picture that is whole, finite, and of the size asked for.
Maps that are kept between runs must not change a picture, so a damaged file of kept maps must give the good picture to
the bit. No run may end by a signal or a traceback, leave a file behind, take more memory than ``MEMORY``, or more time
than ``SECONDS``.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import resource
import shutil
import signal
import tempfile
import tomllib
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

import ldtrefl
from ldtrefl.cli import program

from . import mutations
from .good_files import LOOP, MESHES, PICTURES, write_good_meshes, write_good_pictures
from .outcomes import Outcome

NAME = "12 files"

SECONDS = 10
"""Of processor time, for a file of some kilobytes."""

HANGS = 20
"""Seconds on the clock after which a process that does nothing counts as hung."""

MEMORY = 2 << 30
"""Bytes above those of the process that it is forked from."""

SHARES = {"scenes": 0.3, "meshes": 0.35, "pictures": 0.25, "kept maps": 0.1}
"""How many of the files are of each kind."""

ADDRESS_SPACE = 16 << 30
"""Bytes of address space above the parent's after which a child gets no memory: much more than it may use."""

NO_FILE = 0.02
"""Share of the files in whose place stands a pipe, a folder, or a link to nowhere or without end."""

SCENE = """
[camera]
eye = [0.0, -5.0, 1.0]
look_at = [0.0, 0.0, 0.0]
fov_y = 40.0
width = 24
height = 16

[environment]
image = "SKY"

[lighting]
ambient = [0.2, 0.2, 0.2]
shadows = true

[[light]]
kind = "point"
position = [2.0, -3.0, 4.0]
intensity = [9.0, 9.0, 9.0]

[[object]]
name = "mirror"
shape = "sphere"
params = { segments = [16, 8] }
[object.material]
mirror = [0.9, 0.9, 0.9]
fresnel = true

[[object]]
THING
scale = [1.0, 2.0, 1.0]
rotate = [0.0, 0.0, 1.0, 30.0]
translate = [1.5, -1.5, 0.0]

[[object]]
shape = "plane"
scale = 3.0
places = [[0.0, 0.0, -1.2], [0.0, 0.0, -1.4, 1.5]]
[object.material]
albedo = [0.5, 0.5, 0.5]
texture = "TEXTURE"

[reflection]
method = "ldt"
max_bounces = 2
"""
KEPT = 'shape = "torus"\nparams = { segments = [150, 50] }'
"""An object of 15,000 triangles, whose maps are kept."""


@dataclass(frozen=True)
class Case:
    """A spoilt file and what it may lead to."""

    scene: Path
    row: str
    """The row of the report that it counts in."""
    options: tuple[str, ...] = ("--no-cache",)
    same: np.ndarray | None = None
    """The picture that must come of it; None if it may be refused."""
    always: bool = False
    """Whether a picture, any, must come of it."""


@dataclass(frozen=True)
class Attempt:
    """What a run of the command line came to."""

    fault: str
    status: int
    seconds: float
    memory: int


def run(rays: int, pictures: int) -> list[Outcome]:
    """``rays`` is not used; ``pictures`` spoilt files in all."""
    outcomes: dict[str, Outcome] = {}
    faults: Counter[str] = Counter()
    kept_faults = Path(tempfile.gettempdir()) / "ldtrefl-stress-faults"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cases = Cases(folder)
        generator = np.random.default_rng(12)
        parent = int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
        seen: dict[str, list[Attempt]] = {}
        for kind, share in SHARES.items():
            for number in range(round(pictures * share)):
                case = cases.make(kind, number, generator)
                attempt = watched(case, folder / "out.exr", parent)
                outcome = outcomes.setdefault(case.row, Outcome(NAME, case.row, "command line"))
                outcome.tried += 1
                outcome.seconds += attempt.seconds
                seen.setdefault(case.row, []).append(attempt)
                if attempt.fault:
                    outcome.defects += 1
                    same_fault = f"{kind}: {alike(attempt.fault)}"
                    faults[same_fault] += 1
                    if faults[same_fault] == 1:
                        place = kept_faults / f"{len(faults)}"
                        keep(folder, place, case, attempt)
                        print(f"{case.row}: {attempt.fault} (kept in {place})", flush=True)
    for outcome in outcomes.values():
        tried = seen[outcome.what]
        refused, slowest = sum(a.status == 2 for a in tried), max(a.seconds for a in tried)
        largest = max(0, *(a.memory for a in tried))
        outcome.what += f" ({refused} refused, slowest {slowest:.1f} s, {largest >> 20} MiB more)"
        outcome.limit = f"one line or a whole picture, < {MEMORY >> 30} GiB more, <= {SECONDS} s, nothing left behind"
        outcome.passed = outcome.defects == 0
    for same_fault, count in faults.most_common():
        print(f"    {count} times {same_fault}")
    ldtrefl.set_threads()
    return list(outcomes.values())


class Cases:
    """The good files in a folder, the pictures that come of them, and spoilt ones one after the other."""

    def __init__(self, folder: Path) -> None:
        """Write the good files and render them: all kernels are compiled and loaded here, on one thread, so that
        children start from a process that is ready."""
        self.folder = folder
        # Threads of a parent do not live on in its children, which would wait for them.
        oiio.attribute("threads", 1)
        oiio.attribute("exr_threads", -1)
        write_good_meshes(folder)
        write_good_pictures(folder)
        ldtrefl.set_threads(1)
        things = {name: f'mesh = "{name}"\nfit = 1.0' for name in MESHES} | {"kept": KEPT}
        for name, thing in things.items():
            (folder / f"{name}.toml").write_text(scene_text(thing))
        for path in sorted(folder.glob("*.toml")):
            for method in ("ldt", "bvh", "envmap"):
                assert render(path, folder / "good.exr", "--no-cache", "--method", method) == 0, path.name
        # Maps of both searches; every picture is read once, so that a format that cannot be read shows here.
        self.kept: dict[str, tuple[bytes, np.ndarray | None]] = {}
        for search in ("exact", "linear"):
            options = ("--cache", str(folder / "kept"), "--set", f"search={search}")
            for _ in range(2):
                assert render(folder / "kept.toml", folder / "good.exr", *options) == 0
            (path,) = (p for p in (folder / "kept").iterdir() if p.name not in self.kept)
            self.kept[path.name] = path.read_bytes(), read(folder / "good.exr")
        self.searches = dict(zip(self.kept, ("exact", "linear"), strict=True))
        for name in PICTURES:
            (folder / "case.toml").write_text(scene_text(KEPT, sky=name, texture=name))
            assert render(folder / "case.toml", folder / "good.exr", "--no-cache") == 0, name
        for name in ("good.exr", "case.toml"):
            (folder / name).unlink()
        self.good = {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}

    def make(self, kind: str, number: int, rng: np.random.Generator) -> Case:
        """Restore the folder and spoil one file of it; the formats take turns by ``number``."""
        mutations.restore(self.folder, self.good)
        (self.folder / LOOP).symlink_to(LOOP)
        scene = self.folder / "case.toml"
        makers: dict[str, Callable[[Path, int, np.random.Generator], Case]] = {
            "scenes": self._scene,
            "meshes": self._mesh,
            "pictures": self._picture,
            "kept maps": self._kept,
        }
        return makers[kind](scene, number, rng)

    def _scene(self, scene: Path, number: int, rng: np.random.Generator) -> Case:
        mesh = list(MESHES)[number % len(MESHES)]
        scene.write_bytes(mutations.spoilt_scene(scene_text(f'mesh = "{mesh}"\nfit = 1.0'), rng))
        if rng.random() < NO_FILE:
            mutations.put_no_file(scene, rng)
        return Case(scene, "scenes")

    def _mesh(self, scene: Path, number: int, rng: np.random.Generator) -> Case:
        mesh = list(MESHES)[number % len(MESHES)]
        scene.write_text(scene_text(f'mesh = "{mesh}"\nfit = 1.0'))
        # Of a mesh of several files the first as often as all others.
        parts = MESHES[mesh]
        victim = parts[0] if len(parts) == 1 or rng.random() < 0.5 else parts[rng.integers(1, len(parts))]
        # The parent has read the good mesh: a new time has it read again, whichever of its files is spoilt.
        os.utime(self.folder / parts[0])
        self._spoil(victim, rng)
        return Case(scene, f"meshes, {mesh}")

    def _picture(self, scene: Path, number: int, rng: np.random.Generator) -> Case:
        picture, as_sky = PICTURES[number // 2 % len(PICTURES)], number % 2 == 0
        (self.folder / f"spoilt-{picture}").write_bytes(self.good[picture])
        used = {"sky" if as_sky else "texture": f"spoilt-{picture}"}
        scene.write_text(scene_text(KEPT.replace("150, 50", "12, 6"), **used))
        self._spoil(f"spoilt-{picture}", rng)
        return Case(scene, f"pictures as {'environment' if as_sky else 'texture'}")

    def _kept(self, scene: Path, number: int, rng: np.random.Generator) -> Case:
        name = list(self.kept)[number % len(self.kept)]
        data, picture = self.kept[name]
        options = ("--cache", str(self.folder / "kept"), "--set", f"search={self.searches[name]}")
        shutil.copy(self.folder / "kept.toml", scene)
        path = self.folder / "kept" / name
        if number // len(self.kept) % 2 == 0:
            path.write_bytes(mutations.kept_of_right_hash(data, rng))
            return Case(scene, "kept maps, hash repaired", options, always=True)
        self._spoil(f"kept/{name}", rng)
        return Case(scene, "kept maps, damaged", options, same=picture)

    def _spoil(self, name: str, rng: np.random.Generator) -> None:
        path = self.folder / name
        if rng.random() < NO_FILE:
            mutations.put_no_file(path, rng)
        else:
            path.write_bytes(mutations.spoil(path.read_bytes(), name, rng))


def scene_text(thing: str, sky: str = "8.png", texture: str = "8.png") -> str:
    """The scene with a thing and its pictures."""
    return SCENE.replace("THING", thing).replace("SKY", sky).replace("TEXTURE", texture)


def render(scene: Path, output: Path, *options: str) -> int:
    """The command line in this process, with its report thrown away."""
    with contextlib.redirect_stdout(io.StringIO()):
        return program.main(["render", str(scene), "-o", str(output), "--threads", "1", "--samples", "1", *options])


def read(path: Path) -> np.ndarray | None:
    """(h, w, 3) float32, as stored; None for what is no picture."""
    buffer = oiio.ImageBuf(str(path))
    if buffer.has_error or not buffer.read():
        return None
    pixels: np.ndarray = buffer.get_pixels(oiio.FLOAT)
    return pixels


def watched(case: Case, output: Path, parent: int) -> Attempt:
    """A run of the command line in a child process; ``parent`` bytes are the parent's."""
    output.unlink(missing_ok=True)
    before = set(output.parent.rglob("*"))
    with tempfile.TemporaryFile() as said, tempfile.TemporaryFile() as told:
        child = os.fork()
        if child == 0:
            status = 70
            try:
                signal.alarm(HANGS)
                resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
                resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
                resource.setrlimit(resource.RLIMIT_AS, (parent + ADDRESS_SPACE, parent + ADDRESS_SPACE))
                os.dup2(told.fileno(), 1)
                os.dup2(said.fileno(), 2)
                status = render(case.scene, output, *case.options)
            except BaseException:
                traceback.print_exc()
            finally:
                os._exit(status)
        _, wait, usage = os.wait4(child, 0)
        said.seek(0)
        text = said.read().decode(errors="replace")
    status = os.waitstatus_to_exitcode(wait)
    seconds, memory = usage.ru_utime + usage.ru_stime, (usage.ru_maxrss << 10) - parent
    new = set(output.parent.rglob("*")) - before - {output}
    left = sorted(path.name for path in new if path.suffix != ".ldtmaps" or path.name.startswith("."))
    return Attempt(
        fault_of_process(status, text, seconds, memory, left) or fault_of_picture(case, output, status),
        status,
        seconds,
        memory,
    )


def fault_of_process(status: int, text: str, seconds: float, memory: int, left: list[str]) -> str:
    """What is wrong with a status, what was said on standard error, and what was used and left; '' if nothing is."""
    lines = text.strip().splitlines()
    if status < 0:
        reason = {signal.SIGALRM: f": hung for {HANGS} s", signal.SIGXCPU: f": {SECONDS} s of the processor"}
        return f"killed by signal {-status}{reason.get(signal.Signals(-status), '')}"
    if "Traceback" in text:
        return f"a traceback: {lines[-1]}"
    if status not in (0, 2):
        return f"status {status}: {lines[-1] if lines else ''}"
    if status == 2 and len(lines) != 1:
        return f"status 2 and {len(lines)} lines: {' / '.join(lines)[:300]}"
    if status == 0 and (len(lines) > 1 or re.search(r"\w*Warning:|warning:", text)):
        return f"status 0 and a warning: {lines[0]}"
    if seconds > SECONDS:
        return f"{seconds:.0f} s"
    if memory > MEMORY:
        return f"{memory / 2**30:.1f} GiB more"
    return f"left behind: {left}" if left else ""


def fault_of_picture(case: Case, output: Path, status: int) -> str:
    """What is wrong with the picture; '' if nothing is."""
    if status == 2:
        if case.same is not None or case.always:
            return "refused for what was kept"
        return "a picture on error" if output.exists() else ""
    picture = read(output)
    if picture is None:
        return "no picture"
    camera = tomllib.loads(case.scene.read_text())["camera"]
    size = camera.get("height", 512), camera.get("width", 768), 3
    if picture.shape != size:
        return f"a picture of shape {picture.shape}, not {size}"
    if not np.isfinite(picture).all():
        return f"{int((~np.isfinite(picture)).any(axis=2).sum())} pixels are not finite"
    if case.same is not None and not np.array_equal(picture, case.same):
        return "another picture for what was kept"
    return ""


def alike(fault: str) -> str:
    """A fault without what differs from file to file: numbers, names, quoted words."""
    fault = re.sub(r"(/[\w.-]+)+|'[^']*'|\"[^\"]*\"", "*", fault)
    return re.sub(r"-?\b(0x[0-9a-f]+|\d[\d.e+-]*)", "0", fault)[:120] if not fault.startswith("killed") else fault


def keep(folder: Path, place: Path, case: Case, attempt: Attempt) -> None:
    """Copy everything that shows a fault into ``place``, with the command that does."""
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(folder, place, symlinks=True, copy_function=_copied)
    options = " ".join(case.options).replace(str(folder), ".")
    (place / "README").write_text(f"{case.row}: {attempt.fault}\n\nldtrefl render case.toml -o out.exr {options}\n")


def _copied(source: str, target: str) -> None:
    if os.path.isfile(source):
        shutil.copy2(source, target)
    else:  # a pipe
        os.mkfifo(target)
