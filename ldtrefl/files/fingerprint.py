"""The version of an algorithm in one number: a hash of the source that it is written in, and of its constants.

What one version of an algorithm keeps on disk is of no use to another version. So the key under which it is kept holds
a fingerprint of the module that made it, and of every module of this package that it imports, however far down. No list
has to be kept up: a new constant, struct or module is part of the fingerprint by itself. The source is hashed as it
stands in the files, C++ included. Constants (names in capitals) are hashed with the values that they have now, which
may have been changed since the module was loaded.
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
"""A line that imports from the package: ``from package.a.b import c, d``, or with brackets over several lines."""

NATIVE = re.compile(r'"(\w+(?:/\w+)+\.h)"')
"""The name of a file of C++ of this package in a module's source, as ``native_sources.native_body`` takes it: with its
room. Names without one are other programs' files."""


def fingerprint(module: str) -> str:
    """A hash of a module of the package, such as "ldt.texture", of all that it imports, and of their constants now."""
    names, digest = _sources(module)
    constants = {name: _constants(name) for name in names}
    return str(xxhash.xxh3_128_hexdigest(json.dumps([digest, constants], sort_keys=True).encode()))


@functools.cache
def _sources(module: str) -> tuple[tuple[str, ...], str]:
    """(names, hash of the files) of ``module`` and of all modules of the package that it imports."""
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
    """Names that a file imports from the package, wherever in the file. Some are modules, others stand in a module."""
    names = []
    for room, listed in IMPORTED.findall(source):
        names += [room, *(f"{room}.{name}".strip(".") for name in re.findall(r"\w+", listed))]
    return names


def _constants(name: str) -> dict[str, str]:
    """Name -> value, as JSON, of a loaded module's constants: names in capitals whose values JSON can hold."""
    plain = {}
    for constant, value in vars(sys.modules.get(f"{PACKAGE}.{name}", object)).items():
        if constant.isupper():
            try:
                plain[constant] = json.dumps(value, sort_keys=True)
            except TypeError:  # a type, a table of functions: it stands in the source
                continue
    return plain
