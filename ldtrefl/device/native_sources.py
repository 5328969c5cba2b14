"""C++ for the bodies of native functions, put together from files.

A file holds one local class: its functions have names, and it compiles alone after the constants that it uses. Classes
that it is derived from stand in files before it. Macros end with the body.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

PACKAGE = Path(__file__).parent.parent
MACRO = re.compile(r"^ *#define (\w+)", re.MULTILINE)


def constants_in_cpp(constants: Mapping[str, float | int]) -> str:
    """Definitions of constants: float from float, int from int."""
    return "\n".join(
        f"constexpr float {name} = {value!r}f;" if isinstance(value, float) else f"constexpr int {name} = {int(value)};"
        for name, value in constants.items()
    )


def native_body(constants: Mapping[str, float | int], files: Sequence[str], body: str) -> str:
    """The body of a ``wp.func_native``: constants, files (paths in the package), and the lines that call them."""
    text = "\n".join([constants_in_cpp(constants), *((PACKAGE / name).read_text() for name in files), body])
    undefined = [f"#undef {name}" for name in dict.fromkeys(MACRO.findall(text))]
    return "\n".join(["", text, *undefined, ""])  # whole lines, whatever stands before and after
