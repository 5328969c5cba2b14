"""C++ for the bodies of native functions (``wp.func_native``), put together from files.

A file holds one local class, and compiles alone after the constants that it uses and the files of the classes that it
is derived from. Macros are undefined at the end of the body, so that no function sees another's.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

PACKAGE = Path(__file__).parent.parent
"""The folder that names of files start from."""

MACRO = re.compile(r"^ *#define (\w+)", re.MULTILINE)
"""The name of a macro that is defined."""


def constants_in_cpp(constants: Mapping[str, float | int]) -> str:
    """Definitions of constants in C++: a Python float becomes a ``float``, anything else an ``int``."""
    return "\n".join(
        f"constexpr float {name} = {value!r}f;" if isinstance(value, float) else f"constexpr int {name} = {int(value)};"
        for name, value in constants.items()
    )


def native_body(constants: Mapping[str, float | int], files: Sequence[str], body: str) -> str:
    """The body of a native function.

    Args:
        constants: name -> value, defined before the files.
        files: paths in the package, such as "device/vectors.h", in this order.
        body: the lines that call what stands in the files.
    """
    text = "\n".join([constants_in_cpp(constants), *((PACKAGE / name).read_text() for name in files), body])
    undefined = [f"#undef {name}" for name in dict.fromkeys(MACRO.findall(text))]
    return "\n".join(["", text, *undefined, ""])  # whole lines, whatever stands before and after
