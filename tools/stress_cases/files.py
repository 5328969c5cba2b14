"""Case 12: scene files and meshes with flipped bytes, cut off, of wrong types and sizes, through the command line."""

from __future__ import annotations

import os
import re
import resource
import signal
import tempfile
import time
import traceback
from pathlib import Path

import numpy as np
import trimesh

import ldtrefl
from ldtrefl import cli, shapes

from .judge import Outcome

NAME = "12 files"
SECONDS = 10
MEMORY = 2 << 30
SCENE = """
[camera]
eye = [0.0, -5.0, 1.0]
look_at = [0.0, 0.0, 0.0]
fov_y = 40.0
width = 24
height = 16

[environment]
image = "sky.png"

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

[[object]]
mesh = "MESH"
fit = 1.0
scale = [1.0, 2.0, 1.0]
rotate = [0.0, 0.0, 1.0, 30.0]
translate = [1.5, -1.5, 0.0]

[reflection]
method = "ldt"
max_bounces = 2
"""
VALUES = (
    "1e308", "-1e308", "nan", "inf", "-inf", "0", "-1", "1e-320", "99999999999999999999", "true", '"text"', "[]", "[1]",
    "{}", "[[1.0, 2.0, 3.0]]", "1979-05-27", '"\\u0000"', '"../../../etc/passwd"', '"/dev/zero"', '"."', '"loop.ply"',
)  # fmt: skip
MESHES = ("thing.ply", "ascii.ply", "thing.obj", "thing.stl", "thing.glb", "thing.off")


def run(rays: int, pictures: int) -> list[Outcome]:
    """``rays`` is not used; one mutated file for each of ``pictures`` pixels, up to 2,000."""
    count = min(2000, 16 * pictures)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        good = write_good_files(folder)
        # All kernels are compiled and loaded here, on one thread: children start from a process that is ready.
        ldtrefl.set_threads(1)
        for method in ("ldt", "bvh", "envmap"):
            assert attempt(folder / "good.toml", method, folder / "good.png") == 0
        generator = np.random.default_rng(12)
        outcomes = []
        for kind, share in (("scene", 0.5), ("mesh", 0.4), ("picture", 0.1)):
            outcome = Outcome(NAME, f"mutated {kind}s", "command line")
            outcome.limit = f"status 0 or 2, one line, no traceback, < 2 GiB, <= {SECONDS} s, nothing written on error"
            slowest, largest, refused = 0.0, 0, 0
            for _ in range(int(count * share)):
                mutated = mutate(folder, good, kind, generator)
                fault, status, seconds, memory = watched(mutated, folder / "out.png")
                slowest, largest, refused = max(slowest, seconds), max(largest, memory), refused + (status == 2)
                outcome.tried += 1
                outcome.seconds += seconds
                if fault:
                    outcome.defects += 1
                    keep = Path(tempfile.gettempdir()) / f"ldtrefl-stress-{kind}-{outcome.defects}"
                    keep.mkdir(exist_ok=True)
                    for path in folder.iterdir():
                        if path.is_file():
                            (keep / path.name).write_bytes(path.read_bytes())
                    print(f"{kind}: {fault} (kept in {keep})")
            outcome.what += f" ({refused} refused, slowest {slowest:.1f} s, {largest >> 20} MiB)"
            outcome.passed = outcome.defects == 0
            outcomes.append(outcome)
    ldtrefl.set_threads()
    return outcomes


def write_good_files(folder: Path) -> dict[str, bytes]:
    """A scene, its meshes in six formats and its picture; their bytes by name."""
    knot = shapes.make("torus_knot", {"segments": [24, 6]})
    mesh = trimesh.Trimesh(knot.vertices, knot.faces, process=False)
    for name in MESHES:
        if name == "ascii.ply":
            (folder / name).write_bytes(mesh.export(file_type="ply", encoding="ascii"))
        else:
            mesh.export(folder / name)
    rng = np.random.default_rng(0)
    ldtrefl.save_image(folder / "sky.png", rng.uniform(0, 1, (8, 16, 3)).astype(np.float32))
    (folder / "good.toml").write_text(SCENE.replace("MESH", "thing.ply"))
    for link in ("loop.ply", "loop.toml"):
        (folder / link).symlink_to(link)
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def mutate(folder: Path, good: dict[str, bytes], kind: str, generator: np.random.Generator) -> Path:
    """Restore the folder, spoil one file of it, and give the scene to render."""
    for name, data in good.items():
        (folder / name).write_bytes(data)
    scene = folder / "case.toml"
    mesh = MESHES[generator.integers(len(MESHES))]
    text = SCENE.replace("MESH", mesh)
    if kind == "scene":
        choice = generator.integers(0, 7)
        lines = text.split("\n")
        if choice < 3:
            line = generator.choice([i for i, content in enumerate(lines) if "=" in content])
            key = lines[line].split("=")[0]
            lines[line] = f"{key}= {VALUES[generator.integers(len(VALUES))]}"
            if choice == 2:  # one number of a list
                numbers = list(re.finditer(r"-?\d+\.\d+", SCENE.replace("MESH", mesh)))
                at = numbers[generator.integers(len(numbers))]
                text = text[: at.start()] + VALUES[generator.integers(len(VALUES))] + text[at.end() :]
                lines = text.split("\n")
        elif choice == 3:
            del lines[generator.integers(len(lines))]
        elif choice == 4:
            lines.insert(generator.integers(len(lines)), lines[generator.integers(len(lines))])
        data = "\n".join(lines).encode()
        if choice == 5:
            data = data[: generator.integers(len(data))]
        elif choice == 6:
            data = flipped(data, generator)
        scene.write_bytes(data if generator.random() > 0.02 else data.decode("latin-1").encode("utf-16"))
        return folder / "loop.toml" if generator.random() < 0.01 else scene
    scene.write_text(text)
    victim = folder / (mesh if kind == "mesh" else "sky.png")
    data = good[victim.name]
    choice = generator.integers(0, 4)
    if choice == 0:
        data = data[: generator.integers(len(data))]
    elif choice == 1:
        data = flipped(data, generator)
    elif choice == 2:  # numbers of the header and of the text, made enormous
        places = list(re.finditer(rb"\d+", data[:2000]))
        if places:
            place = places[generator.integers(len(places))]
            number = (b"-1", b"999999999", b"99999999999999", b"nan")[generator.integers(4)]
            data = data[: place.start()] + number + data[place.end() :]
    else:
        start = int(generator.integers(len(data)))
        data = data[:start] + generator.bytes(int(generator.integers(1, 200))) + data[start:]
    victim.write_bytes(data)
    return scene


def flipped(data: bytes, generator: np.random.Generator) -> bytes:
    """One to eight bytes changed."""
    changed = bytearray(data)
    for _ in range(generator.integers(1, 9)):
        changed[generator.integers(len(changed))] = generator.integers(256)
    return bytes(changed)


def attempt(scene: Path, method: str, output: Path) -> int:
    """The command line in this process."""
    return cli.main(["render", str(scene), "-o", str(output), "--method", method, "--threads", "1"])


def watched(scene: Path, output: Path) -> tuple[str, int, float, int]:
    """(what is wrong, status, seconds, bytes) of the command line in a child process."""
    output.unlink(missing_ok=True)
    before = {path.name for path in scene.parent.iterdir()}
    with tempfile.TemporaryFile() as said:
        start = time.perf_counter()
        child = os.fork()
        if child == 0:
            status = 70
            try:
                signal.alarm(SECONDS)
                own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10
                resource.setrlimit(resource.RLIMIT_AS, (own + (16 << 30), own + (16 << 30)))
                os.dup2(said.fileno(), 1)
                os.dup2(said.fileno(), 2)
                status = attempt(scene, "ldt", output)
            except BaseException:
                traceback.print_exc()
            finally:
                os._exit(status)
        _, wait, usage = os.wait4(child, 0)
        seconds = time.perf_counter() - start
        said.seek(0)
        text = said.read().decode(errors="replace")
    status = os.waitstatus_to_exitcode(wait)
    memory = usage.ru_maxrss << 10
    new = {path.name for path in scene.parent.iterdir()} - before
    fault = ""
    if status < 0:
        fault = f"killed by signal {-status}" + (f" after {SECONDS} s" if -status == signal.SIGALRM else "")
    elif "Traceback" in text:
        fault = f"a traceback: {text.strip().splitlines()[-1]}"
    elif status not in (0, 2):
        fault = f"status {status}"
    elif status == 2 and len(text.strip().splitlines()) != 1:
        fault = f"{len(text.strip().splitlines())} lines on error"
    elif status == 2 and new:
        fault = f"left {sorted(new)} behind on error"
    elif status == 0 and not output.is_file():
        fault = "no picture"
    elif memory > MEMORY:
        fault = f"{memory >> 20} MiB"
    return fault, status, seconds, memory
