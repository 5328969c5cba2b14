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

PACKAGE = __name__.rpartition(".")[0]
FOLDER = Path(__file__).parent
IMPORTED = re.compile(rf"^\s*(?:from|import)\s+{PACKAGE}\.([\w.]+)|^\s*from\s+{PACKAGE}\s+import\s+(.*)", re.MULTILINE)
"""A line that imports a module of the package: ``from package.a.b import c``, ``from package import a, b``."""
NATIVE = re.compile(r'"(\w+\.h)"')
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
        source = path.read_bytes()
        for dotted, listed in IMPORTED.findall(source.decode()):
            wanted += [dotted] if dotted else re.findall(r"\w+", listed)
        found[name] = source + b"".join((FOLDER / native).read_bytes() for native in NATIVE.findall(source.decode()))
    digest = xxhash.xxh3_128()
    for name in sorted(found):
        digest.update(f"{name} {len(found[name])} ".encode() + found[name])
    return tuple(sorted(found)), digest.hexdigest()


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
