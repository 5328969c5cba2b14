"""The house: which room may import which, that imports go one way, and what only one file may know."""

import ast
import functools
import re
import subprocess
import sys
from pathlib import Path

import pytest

import ldtrefl
from ldtrefl.methods import all_methods

PACKAGE = Path(ldtrefl.__file__).parent
FLOORS = (
    ("base", "geometry"),
    ("files", "device"),
    ("scene",),
    ("world",),
    ("tracing", "shading"),
    ("ldt", "frame"),
    ("methods", "compare"),
    ("renderer",),
    ("cli",),
)
"""Rooms from the ground up: folders and single files of the package. A room imports rooms of lower floors."""

FLOOR_OF = {room: number for number, floor in enumerate(FLOORS) for room in floor}

MODULES = sorted(
    str(path.relative_to(PACKAGE).with_suffix("")).replace("/", ".").removesuffix(".__init__")
    for path in PACKAGE.rglob("*.py")
    if path != PACKAGE / "__init__.py"
)


def path_of(module: str) -> Path:
    path = PACKAGE / module.replace(".", "/")
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


@functools.cache
def imported_modules(module: str) -> frozenset[str]:
    """Names of the package's modules that a file imports, wherever in the file."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path_of(module).read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "ldtrefl":
            inside = node.module.removeprefix("ldtrefl").removeprefix(".")
            names = {f"{inside}.{alias.name}".strip(".") for alias in node.names}
            found |= {name if name in MODULES else inside for name in names}
        elif isinstance(node, ast.Import):
            found |= {alias.name.removeprefix("ldtrefl.") for alias in node.names if alias.name.startswith("ldtrefl.")}
    return frozenset(found)


def room_of(module: str) -> str:
    """The folder or single file that a module is in; ``__main__`` is the door to the command line."""
    return "cli" if module == "__main__" else module.split(".", maxsplit=1)[0]


def test_every_room_has_a_floor() -> None:
    assert {room_of(module) for module in MODULES} == set(FLOOR_OF)


@pytest.mark.parametrize("module", MODULES)
def test_imports_go_down(module: str) -> None:
    room = room_of(module)
    upwards = {
        name for name in imported_modules(module) if room_of(name) != room and FLOOR_OF[room_of(name)] >= FLOOR_OF[room]
    }
    assert not upwards, f"{module} imports {upwards}, which stand on its floor or above it"


def test_no_files_import_each_other() -> None:
    done: set[str] = set()

    def visit(module: str, way: tuple[str, ...]) -> None:
        assert module not in way, f"a circle: {' -> '.join([*way, module])}"
        if module not in done:
            for name in imported_modules(module) & set(MODULES):
                visit(name, (*way, module))
            done.add(module)

    for module in MODULES:
        visit(module, ())


@pytest.mark.parametrize("module", [module for module in MODULES if module.startswith("methods.")])
def test_no_method_imports_another(module: str) -> None:
    """But for what stands in folders, which several methods share."""
    imported = {name for name in imported_modules(module) if room_of(name) == "methods"}
    assert {name for name in imported if name.count(".") == 1 and not path_of(name).name == "__init__.py"} <= {
        "methods.base"
    }


def test_only_launch_launches() -> None:
    allowed = [
        f"device.{name}" for name in ("cpu_threads", "launch", "python_threads", "recorded_launch", "thread_self_test")
    ]
    assert not [m for m in MODULES if m not in allowed and "wp.launch(" in path_of(m).read_text()]


def test_only_warp_abi_knows_what_is_private_to_warp() -> None:
    private = re.compile(
        r"warp\._src|wp\.Launch\(|\.(hooks|adj|module_exec|__ctype__|_?ctype)\b|command\.params|\"vars\""
    )
    found = {m: private.findall(path_of(m).read_text()) for m in MODULES if m != "device.warp_abi"}
    assert not any(found.values()), {module: names for module, names in found.items() if names}


def test_methods_are_found_by_scanning() -> None:
    files = {path.stem for path in (PACKAGE / "methods").glob("*.py")} - {"base", "__init__"}
    assert {name.replace("-", "_") for name in all_methods()} == files


ROOMS = [path.parent for path in PACKAGE.glob("*/__init__.py")]


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: room.name)
def test_a_room_says_what_it_is_for(room: Path) -> None:
    words = ast.get_docstring(ast.parse((room / "__init__.py").read_text())) or ""
    assert "Imports" in words and "Start with" in words, f"{room.name}: what it imports, and where to start reading"


def test_the_package_loads_its_parts_when_they_are_used() -> None:
    code = (
        "import sys, ldtrefl; assert 'warp' not in sys.modules and 'numpy' not in sys.modules;"
        "from ldtrefl.renderer import Renderer; "
        "assert callable(ldtrefl.render) and callable(ldtrefl.peel) and ldtrefl.Renderer is Renderer;"
        "assert set(ldtrefl.__all__) == set(ldtrefl._HOMES);"
        "assert all(getattr(ldtrefl, name) is not None for name in dir(ldtrefl)); assert not hasattr(ldtrefl, 'nope')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
