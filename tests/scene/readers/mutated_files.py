"""Mesh files that are damaged at random: each is a mesh, or one line.

    python -m tests.scene.readers.mutated_files 5000

makes many of them, of every kind that our own readers read besides glTF, and prints how they ended.
"""

from __future__ import annotations

import io
import logging
import random
import resource
import sys
import tempfile
import time
import zipfile
from collections import Counter
from pathlib import Path

from PIL import Image

import ldtrefl
from ldtrefl.base import budget

WORDS = [
    *(b"-1", b"0", b"99999999999999999999", b"1e999", b"nan", b"-inf", b"1/2/3", b"//", b"/", b"../out.png", b"\\\n"),
    *(b"f", b"v", b"vt", b"usemtl", b"mtllib", b"newmtl", b"map_Kd", b"-s", b"\0", b"\xff", b"#", b"s", b"\r", b" "),
    *(b"end_header", b"element", b"property list uchar int", b"4294967295", b"/etc/passwd", b"../out.mtl", b"OFF"),
]
"""What is put in."""

OBJ = b"""mtllib a.mtl
v 0 0 0 1 0 0
v 1 0 0
v 1 1 0
v 0.5 0.4 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vn 0 0 1
usemtl one
s 1
f 1/1/1 2/2/1 3/3/1 4/1/1 5/2/1
usemtl two
f -5 -4 \\
 -3
f 1//1 2//1 3//1
"""

MTL = b"""newmtl one
Kd 0.5 0.5 0.5
Ks 0.5 0.5 0.5
Ns 100
map_Kd -o 0.1 0.2 -s 2 2 a.png
map_d b.png
newmtl two
Kd 1 0 0
d 0.5
map_Bump -bm 0.5 a.png
map_Pr b.png
"""

OFF = b"COFF\n4 2 0\n0 0 0 255 0 0\n1 0 0 0 255 0\n1 1 0 0 0 255\n0 1 0 9 9 9\n3 0 1 2\n4 0 1 2 3 1 0 0\n"

PLY_HEADER = b"""ply
format %s 1.0
comment TextureFile a.png
element vertex 4
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 2
property list uchar int vertex_indices
property list uchar float texcoord
end_header
"""

PLY = PLY_HEADER % b"ascii" + (
    b"0 0 0 255 0 0\n1 0 0 0 0 0\n1 1 0 9 9 9\n0 1 0 1 2 3\n3 0 1 2 6 0 0 1 0 1 1\n4 0 1 2 3 8 0 0 1 0 1 1 0 1\n"
)

BINARY_PLY = PLY_HEADER % b"binary_little_endian" + bytes(60) + b"\3" + bytes(12) + b"\6" + bytes(24) + b"\0\0"

STL = b"solid a\n" + 2 * (
    b"facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1 0\n endloop\nendfacet\n"
)

BINARY_STL = bytes(80) + b"\2\0\0\0" + 2 * (bytes(24) + b"\0\0\x80\x3f" + bytes(12) + b"\0\0\x80\x3f" + bytes(6))

MODEL = (
    b'<model unit="inch" xmlns:m="m"><resources><m:colorgroup id="5"><m:color color="#FF0000"/></m:colorgroup>'
    b'<object id="1" pid="5" pindex="0"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>'
    b'<vertex x="0" y="1" z="0"/></vertices><triangles><triangle v1="0" v2="1" v3="2" pid="5" p1="0"/></triangles>'
    b'</mesh></object><object id="2"><components><component objectid="1" transform="1 0 0 0 1 0 0 0 1 0 0 5"/>'
    b'</components></object></resources><build><item objectid="2"/></build></model>'
)

LIMIT = 256 << 20
"""Bytes that a file may take."""


_opened: list[str] = []
"""Files that were opened."""

sys.addaudithook(lambda event, given: _opened.append(str(given[0])) if event == "open" else None)


def mutated(data: bytes, chance: random.Random) -> bytes:
    """A file with a few random changes."""
    for _ in range(chance.randint(1, 4)):
        a, b = sorted(chance.randint(0, len(data)) for _ in range(2))
        b = min(b, a + chance.choice((1, 4, 40)))
        data = chance.choice(
            (
                data[:a] + data[b:],
                data[:b] + data[a:b] * chance.choice((1, 2, 50)) + data[b:],
                data[:a] + chance.choice(WORDS) + data[b:],
                data[:a] + b" " + chance.choice(WORDS) + b" " + data[a:],
                data[:a] + bytes([chance.randint(0, 255)]) + data[a + 1 :],
                data[: max(a, 1)],
            )
        )
    return data


def ending_of(folder: Path, number: int) -> str:
    """Write a damaged file with others beside it, read it, and say how that ended: 'a mesh' or 'a line'."""
    chance = random.Random(number)
    kind = ("obj", "obj", "obj", "off", "ply", "bply", "3mf", "stl", "bstl")[number % 9]
    path = folder / f"a.{kind.removeprefix('b')}"
    data = {"obj": OBJ, "off": OFF, "ply": PLY, "bply": BINARY_PLY, "3mf": MODEL, "stl": STL, "bstl": BINARY_STL}[kind]
    picture = io.BytesIO()
    Image.effect_noise((8, 8), 50).convert("RGB").save(picture, "PNG")
    spoils_mesh = kind != "obj" or chance.random() < 0.5
    data = mutated(data, chance) if spoils_mesh else data
    for name in ("out.png", "out.mtl"):
        (folder.parent / name).write_bytes(b"not for meshes in the folder below")
    (folder / "a.mtl").write_bytes(MTL if spoils_mesh else mutated(MTL, chance))
    (folder / "a.png").write_bytes(picture.getvalue() if chance.random() < 0.8 else mutated(picture.getvalue(), chance))
    (folder / "b.png").write_bytes(picture.getvalue())
    if kind == "3mf":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("3D/3dmodel.model", data)
    else:
        path.write_bytes(data)
    _opened.clear()
    try:
        mesh = ldtrefl.load_mesh(path)
        assert len(mesh.faces) > 0 and mesh.normals.shape == mesh.vertices.shape
        ending = "a mesh"
    except ldtrefl.InputError as error:
        line = str(error)
        assert line.startswith(str(path)) and "\n" not in line and line.isprintable(), line
        assert "Error:" not in line, f"{number}: a reader's own words: {line}"
        ending = "a line"
    outside = [name for name in _opened if name.endswith(("out.png", "out.mtl", "passwd"))]
    assert not outside, f"{number}: {outside} opened"
    return ending


def main(count: int) -> None:
    """Read many, and say how they ended."""
    logging.disable()
    budget.set_memory_limit(LIMIT)
    endings: Counter[str] = Counter()
    slowest = (0.0, 0)
    with tempfile.TemporaryDirectory() as outer:
        folder = Path(outer) / "inside"
        folder.mkdir()
        for number in range(count):
            begin = time.perf_counter()
            endings[ending_of(folder, number)] += 1
            slowest = max(slowest, (time.perf_counter() - begin, number))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
    print(f"{dict(endings)}, the slowest {slowest[0]:.2f} s (number {slowest[1]}), at most {peak} MiB")


if __name__ == "__main__":
    main(int(sys.argv[1]))
