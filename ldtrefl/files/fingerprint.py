"""What an algorithm is, in one number: a hash of the source that it is written in, and of its constants.

What is kept on disk is made by an algorithm, and is worth nothing to another. So a name under which it is kept holds a
fingerprint of the module that made it and of everything of this package that the module imports, by name and however
far down: no list has to be kept up, and a new constant, record or module is part of it by itself. The source is hashed
as it stands in the files, C++ included, and the constants (names in capitals) as they are now, changed or not.
"""

from __future__ import annotations

import functools
import json
import re
import sys
from pathlib import Path

import xxhash

PACKAGE = __name__.partition(".")[0]
FOLDER = Path(__file__).parent.parent
IMPORTED = re.compile(rf"^[ \t]*from {PACKAGE}(?:\.([\w.]+))? import (\([^)]*\)|.*)", re.MULTILINE)
"""A line that imports something of the package: ``from package.a.b import c, d``, in brackets over several lines."""
NATIVE = re.compile(r'"([\w/]+\.h)"')
"""The name of a file of C++."""


def fingerprint(module: str) -> str:
    """A hash of a module of the package, such as "ldt", of all that it imports, and of their constants as they are."""
    names, digest = _sources(module)
    constants = {name: _constants(name) for name in names}
    return str(xxhash.xxh3_128_hexdigest(json.dumps([digest, constants], sort_keys=True).encode()))


@functools.cache
def _sources(module: str) -> tuple[tuple[str, ...], str]:
    """(names of the modules, hash of their files), those that ``module`` imports included."""
    found: dict[str, bytes] = {}
    wanted = [module]
    while wanted:
        name = wanted.pop()
        path = FOLDER.joinpath(*name.split("."))
        path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        if name in found or not path.is_file():  # a name that is no module
            continue
        source = path.read_text()
        wanted += _imported(source)
        native = [(FOLDER / path).read_text() for path in NATIVE.findall(source)]
        found[name] = "".join([source, *native]).encode()
    digest = xxhash.xxh3_128()
    for name in sorted(found):
        digest.update(f"{name} {len(found[name])} ".encode() + found[name])
    return tuple(sorted(found)), digest.hexdigest()


def _imported(source: str) -> list[str]:
    """Names that may be modules of the package, of all that a file imports wherever in it."""
    names = []
    for room, listed in IMPORTED.findall(source):
        names += [room, *(f"{room}.{name}".strip(".") for name in re.findall(r"\w+", listed))]
    return names


def _constants(name: str) -> dict[str, str]:
    """Name -> value of a module's constants: what is written in capitals and made of plain values."""
    plain = {}
    for constant, value in vars(sys.modules.get(f"{PACKAGE}.{name}", object)).items():
        if constant.isupper():
            try:
                plain[constant] = json.dumps(value, sort_keys=True)
            except TypeError:  # a type, a table of functions: it stands in the source
                continue
    return plain
