"""Imports go one way: a module imports only what stands before it here, and no method imports another."""

import ast
import re
from pathlib import Path

import pytest

import ldtrefl
from ldtrefl.methods import all_methods

PACKAGE = Path(ldtrefl.__file__).parent
BOTTOM_TO_TOP = (
    "errors",
    "budget",
    "sharing",
    "toml_text",
    "checked",
    "files",
    "fingerprint",
    "npz",
    "native",
    "native_sources",
    "skips",
    "cache",
    "warp_abi",
    "kernel_cache",
    "python_pool",
    "crew",
    "launch",
    "binning",
    "pillow_limit",
    "image",
    "vectors",
    "bulk",
    "pillow_pictures",
    "welding",
    "normals",
    "mesh_passes",
    "mesh",
    "polygons",
    "mesh_polygons",
    "mesh_memory",
    "mesh_archives",
    "reader_words",
    "mesh_files",
    "teapot_patches",
    "shapes",
    "scene",
    "camera",
    "hit",
    "strays",
    "device_scene",
    "unit_rays",
    "shade",
    "cubemap",
    "raster",
    "fragments",
    "occupancy",
    "peel",
    "pieces",
    "patches",
    "doubts",
    "records_choice",
    "tree",
    "tree_check",
    "tree_build",
    "items",
    "trace",
    "march_linear",
    "tree_walk",
    "march",
    "ldt",
    "layers",
    "raycast",
    "zbuffer",
    "gbuffer",
    "rays",
    "cull",
    "kept",
    "resolution",
    "reflect",
    "methods.base",
    "methods",
    "metrics",
    "render",
    "cli",
    "__main__",
)


def imported_modules(path: Path) -> set[str]:
    """Names of the package's modules that a file imports, wherever in the file."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            if node.module == "ldtrefl":
                found |= {alias.name for alias in node.names}
            elif node.module.startswith("ldtrefl."):
                found.add(node.module.removeprefix("ldtrefl."))
        elif isinstance(node, ast.Import):
            found |= {a.name.removeprefix("ldtrefl.") for a in node.names if a.name.startswith("ldtrefl.")}
    return found


MODULES = sorted(
    str(path.relative_to(PACKAGE).with_suffix("")).replace("/", ".").removesuffix(".__init__")
    for path in PACKAGE.rglob("*.py")
    if path != PACKAGE / "__init__.py"
)


def path_of(module: str) -> Path:
    path = PACKAGE / module.replace(".", "/")
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


@pytest.mark.parametrize("module", MODULES)
def test_imports_go_down(module: str) -> None:
    is_method = module.startswith("methods.") and module != "methods.base"
    place = "methods.base" if is_method else module
    assert place in BOTTOM_TO_TOP, f"{module} has no place in the order"
    below = set(BOTTOM_TO_TOP[: BOTTOM_TO_TOP.index(place) + is_method])
    upwards = imported_modules(path_of(module)) - below
    assert not upwards, f"{module} imports {upwards}, which stand above it"


def test_only_launch_launches() -> None:
    offenders = [
        m for m in MODULES if m not in ("python_pool", "crew", "launch") and "wp.launch(" in path_of(m).read_text()
    ]
    assert not offenders


def test_only_warp_abi_knows_what_is_private_to_warp() -> None:
    private = re.compile(
        r"warp\._src|wp\.Launch\(|\.(hooks|adj|module_exec|__ctype__|_?ctype)\b|command\.params|\"vars\""
    )
    found = {m: private.findall(path_of(m).read_text()) for m in MODULES if m != "warp_abi"}
    assert not any(found.values()), {module: names for module, names in found.items() if names}


def test_methods_are_found_by_scanning() -> None:
    files = {m.removeprefix("methods.") for m in MODULES if m.startswith("methods.")} - {"base"}
    assert set(all_methods()) == files
