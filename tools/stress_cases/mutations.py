"""Ways of spoiling the files of ``good_files.py``.

A mutation takes the bytes of a good file and gives those of a bad one. Those that know the format repair its checks
(PNG's and the map cache's checksums, GLB's lengths), so that the fault reaches the code behind them.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xxhash

from ldtrefl.files.map_file import HEADER

from .good_files import LOOP

Mutation = Callable[[bytes, np.random.Generator], bytes]

HEAD = 512
"""Bytes at a file's beginning that half of the mutations aim at: headers and lengths stand there."""

WORDS = (0, 1, 2, 7, 255, 1 << 15, 0xFFFF, 1 << 24, 1 << 28, 1 << 30, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF)
"""Whole numbers at the limits of what counts, offsets and indices are kept in."""

TEXTS = (b"-1", b"0", b"16384", b"65536", b"999999999", b"99999999999999", b"1e308", b"1e-320", b"nan", b"inf", b"x")
"""What numbers written as text are replaced by."""

JSON_VALUES: tuple[Any, ...] = (
    -1, 0, 1, 3, 255, 1 << 16, 1 << 30, 1 << 31, 1 << 53, 10**400, 0.5, 1e308, -1e308, 1e-320,
    True, None, "", "x", "../../../etc/passwd", "/dev/zero", "loop.png", "data:,", "VEC4", "MAT4", [], [0], {}, [[]],
)  # fmt: skip
"""What values of JSON are replaced by."""


# Mutations that know nothing of the format.


def somewhere(data: bytes, rng: np.random.Generator) -> int:
    """A place in the file, every other time in its head."""
    return int(rng.integers(max(1, min(len(data), HEAD if rng.random() < 0.5 else len(data)))))


def cut(data: bytes, rng: np.random.Generator) -> bytes:
    """The end is missing."""
    return data[: somewhere(data, rng)]


def flipped(data: bytes, rng: np.random.Generator) -> bytes:
    """One to eight bytes changed."""
    changed = bytearray(data)
    for _ in range(rng.integers(1, 9)):
        if changed:
            changed[somewhere(data, rng)] = rng.integers(256)
    return bytes(changed)


def inserted(data: bytes, rng: np.random.Generator) -> bytes:
    """Bytes at random put in between."""
    place = somewhere(data, rng)
    return data[:place] + rng.bytes(int(rng.integers(1, 200))) + data[place:]


def doubled(data: bytes, rng: np.random.Generator) -> bytes:
    """A piece that is there twice, or is left out."""
    first, last = sorted((somewhere(data, rng), somewhere(data, rng)))
    return data[:last] + data[first:] if rng.random() < 0.5 else data[:first] + data[last:]


def enormous(data: bytes, rng: np.random.Generator) -> bytes:
    """A number of the text, or of the header, replaced by one that is too large, negative, or none."""
    places = list(re.finditer(rb"-?\d+(\.\d+)?", data[:4000]))
    if not places:
        return worded(data, rng)
    place = places[rng.integers(len(places))]
    return data[: place.start()] + TEXTS[rng.integers(len(TEXTS))] + data[place.end() :]


def worded(data: bytes, rng: np.random.Generator) -> bytes:
    """Two, four or eight bytes replaced by a number at a limit, in either order of bytes."""
    word, order = WORDS[rng.integers(len(WORDS))], "<>"[rng.integers(2)]
    kind = "HIQ"[rng.integers(3)]
    patch = struct.pack(f"{order}{kind}", word & (0xFFFF if kind == "H" else 0xFFFFFFFF))
    place = somewhere(data, rng)
    return data[:place] + patch + data[place + len(patch) :]


def emptied(data: bytes, rng: np.random.Generator) -> bytes:
    """Nothing, or zeros in place of everything."""
    return b"" if rng.random() < 0.5 else bytes(len(data))


BLIND: tuple[Mutation, ...] = (cut, flipped, flipped, inserted, doubled, enormous, worded, worded, emptied)


# Mutations that know the format.


def spoilt_json(text: bytes, rng: np.random.Generator) -> bytes:
    """A value of a JSON tree replaced, removed, repeated or wrapped."""
    try:
        tree = json.loads(text)
    except ValueError:
        return flipped(text, rng)
    places: list[tuple[Any, Any]] = []

    def walk(node: Any) -> None:
        keys = node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
        for key in keys:
            places.append((node, key))
            walk(node[key])

    walk(tree)
    if not places:
        return flipped(text, rng)
    node, key = places[rng.integers(len(places))]
    choice = rng.random()
    if choice < 0.15:
        del node[key]
    elif choice < 0.25:
        node[key] = [node[key]] * int(rng.integers(2, 300))
    else:
        node[key] = JSON_VALUES[rng.integers(len(JSON_VALUES))]
    return json.dumps(tree).encode()


def glb_of_other_json(data: bytes, rng: np.random.Generator) -> bytes:
    """A GLB whose JSON is spoilt and whose lengths are right."""
    try:
        length = struct.unpack_from("<I", data, 12)[0]
    except struct.error:
        return flipped(data, rng)
    text = spoilt_json(data[20 : 20 + length], rng)
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest


def png_of_right_checksums(data: bytes, rng: np.random.Generator) -> bytes:
    """A PNG with bytes changed, often its header's, and every chunk's checksum repaired."""
    chunks, at = [], 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        chunks.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    if not chunks:
        return flipped(data, rng)
    chosen = 0 if rng.random() < 0.6 else int(rng.integers(len(chunks)))
    name, body = chunks[chosen]
    if chosen == 0 and rng.random() < 0.5 and len(body) >= 8:
        sides = [16384, 8192, 1 << 20, 0, 1, 0x7FFFFFFF, 0xFFFFFFFF]
        body = struct.pack(">II", *(sides[i] for i in rng.integers(len(sides), size=2))) + body[8:]
    elif chosen == 0 and rng.random() < 0.3:
        # A small file of a large picture: zeros of the size that the header promises.
        side = 4096
        body = struct.pack(">II", side, side) + body[8:]
        chunks = [(n, zlib.compress(bytes(side * (3 * side + 1)), 1) if n == b"IDAT" else b) for n, b in chunks]
    else:
        body = (flipped if rng.random() < 0.5 else worded)(body, rng)
    chunks[chosen] = (name, body)
    out = io.BytesIO()
    out.write(data[:8])
    for name, body in chunks:
        out.write(struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body)))
    return out.getvalue()


def kept_of_right_hash(data: bytes, rng: np.random.Generator) -> bytes:
    """Kept maps with their table or their arrays spoilt, and the length and the hash repaired."""
    magic, _, text_length, _ = HEADER.unpack_from(data)
    text, body = data[HEADER.size : HEADER.size + text_length], data[HEADER.size + text_length :]
    choice = rng.random()
    if choice < 0.35:
        text = spoilt_json(text, rng)
    elif choice < 0.45:
        text = (flipped if rng.random() < 0.5 else enormous)(text, rng)
    elif choice < 0.55:
        body = body[: rng.integers(len(body))]
    elif choice < 0.65:
        text_length = WORDS[rng.integers(len(WORDS))]
    else:
        body = words_spread(body, rng)
    if choice < 0.45:
        text += b" " * (-(HEADER.size + len(text)) % 64)
        text_length = len(text)
    rest = text + body
    return HEADER.pack(magic, HEADER.size + len(rest), text_length, xxhash.xxh3_64_intdigest(rest)) + rest


def words_spread(data: bytes, rng: np.random.Generator) -> bytes:
    """One, ten or a thousand words of four bytes replaced by one number at a limit, not-a-numbers among them."""
    words = np.frombuffer(data[: len(data) // 4 * 4], np.uint32).copy()
    values = np.array([*WORDS, 0x7FC00000, 0x7F800000, 0xFF800000, 0x7F7FFFFF, 0x3F800000], np.uint64)
    count = int(10 ** rng.integers(0, 4))
    words[rng.integers(len(words), size=count)] = np.uint32(values[rng.integers(len(values))])
    return words.tobytes() + data[len(words) * 4 :]


KNOWING: dict[str, Mutation] = {
    ".gltf": spoilt_json,
    ".glb": glb_of_other_json,
    ".png": png_of_right_checksums,
}


def spoil(data: bytes, name: str, rng: np.random.Generator) -> bytes:
    """One mutation of a file; where there is one that knows the format, that one every other time."""
    knowing = KNOWING.get(Path(name).suffix)
    if knowing is not None and rng.random() < 0.5:
        return knowing(data, rng)
    return BLIND[rng.integers(len(BLIND))](data, rng)


# What is no file at all.


def put_no_file(path: Path, rng: np.random.Generator) -> str:
    """In place of a file: a pipe that nobody writes to, a folder, a link to itself or to nothing; which one."""
    path.unlink(missing_ok=True)
    kind = ("pipe", "folder", "loop", "nothing", "endless")[rng.integers(5)]
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to({"loop": path.name, "nothing": "none-such", "endless": "/dev/zero"}[kind])
    return kind


def restore(folder: Path, good: dict[str, bytes]) -> None:
    """The good files again, whatever stands in their places, and nothing else but folders that they stand in."""
    wanted = {folder / name for name in good}
    for path in sorted(folder.rglob("*"), reverse=True):
        if path.is_dir() and not path.is_symlink():
            with contextlib.suppress(OSError):
                path.rmdir()
        elif path not in wanted or not path.is_file() or path.is_symlink():
            path.unlink()
    for name, data in good.items():
        path = folder / name
        if not path.is_file() or path.read_bytes() != data:
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(data)


# Scenes.

VALUES = (
    "1e308", "-1e308", "nan", "inf", "-inf", "0", "-1", "1e-320", "1e-300", "99999999999999999999", "true", '"text"',
    "[]", "[1]", "{}", "[[1.0, 2.0, 3.0]]", "1979-05-27", '"\\u0000"', '"../../../etc/passwd"', '"/dev/zero"', '"."',
    f'"{LOOP}"', "16384", "8192", "[8192, 8192]", "'a[/old][red]'", "'\\u2028'", '"""two\nlines"""',
    "9" * 4400, "[" * 3000 + "]" * 3000, "{a = " * 500 + "1" + "}" * 500, "a" * 20_000, ".".join("abcdefgh" * 500),
)  # fmt: skip
"""What values of a scene file are replaced by."""


def spoilt_scene(text: str, rng: np.random.Generator) -> bytes:
    """A scene file with a value, a key, a line or some bytes changed."""
    lines = text.split("\n")
    choice = rng.integers(0, 9)
    if choice < 4:
        line = rng.choice([i for i, content in enumerate(lines) if "=" in content])
        key = lines[line].split("=")[0]
        lines[line] = f"{key}= {VALUES[rng.integers(len(VALUES))]}"
    elif choice == 4:  # one number of the whole
        numbers = list(re.finditer(r"-?\d+(\.\d+)?", text))
        at = numbers[rng.integers(len(numbers))]
        lines = [text[: at.start()] + VALUES[rng.integers(len(VALUES))] + text[at.end() :]]
    elif choice == 5:
        del lines[rng.integers(len(lines))]
    elif choice == 6:
        lines.insert(rng.integers(len(lines)), lines[rng.integers(len(lines))])
    data = "\n".join(lines).encode()
    if choice == 7:
        data = data[: rng.integers(len(data))]
    elif choice == 8:
        data = flipped(data, rng)
    return data if rng.random() > 0.02 else data.decode("latin-1").encode("utf-16")
