"""How code reads here, as far as a program can tell: sizes, docstrings, types, and where tests stand."""

import ast
import functools
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
LONGEST_FILE = 400
"""Lines of a file."""

LONGEST_FUNCTION = 60
"""Lines of a function, its decorators aside."""

DATA = {"ldtrefl/scene/shapes/teapot_patches.py": "the numbers of the teapot's patches"}
"""Files that hold data and may be longer, and what they hold."""

REASON = re.compile(r"[Ll]ong because")
"""How a kernel of more than ``LONGEST_FUNCTION`` lines begins to say why, in its docstring or in a comment."""

KERNEL_DECORATORS = ("kernel", "func", "func_native")
"""Names of what makes a function the device's. A kernel is made by ``kernel``, whatever module it is taken from."""

WHOLE = {
    "tests/device/test_cuda.py": "every kernel",
    "tests/test_closed_forms.py": "the renderer with all that it stands on",
    "tests/test_habits.py": "every file",
    "tests/test_layering.py": "the imports of every file",
    "tests/test_mirror_closed_forms.py": "the renderer with all that it stands on",
    "tests/test_mirror_enclosures.py": "the renderer with all that it stands on",
    "tests/test_readme.py": "README.md",
    "tests/test_scenes.py": "the shipped scenes",
}
"""Tests of no single module, and what they are of."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


def files(*patterns: str) -> list[str]:
    """Paths of files from the top of the repository."""
    return sorted(str(path.relative_to(ROOT)) for pattern in patterns for path in ROOT.glob(pattern))


PYTHON = files("ldtrefl/**/*.py", "tools/**/*.py")
"""What users import and run."""

ALL_PYTHON = [*PYTHON, *files("tests/**/*.py")]
HEADERS = files("ldtrefl/**/*.h", "tools/**/*.h")
PAGES = files("*.md", "docs/**/*.md", "tools/*.md")


@functools.cache
def text_of(path: str) -> str:
    return (ROOT / path).read_text()


@functools.cache
def tree_of(path: str) -> ast.Module:
    return ast.parse(text_of(path))


def named(tree: ast.AST, before: str = "", is_open: bool = True) -> Iterator[tuple[str, Function | ast.ClassDef, bool]]:
    """(name with those it stands in, node, whether others may use it) of all functions and classes of a file."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, Function | ast.ClassDef):
            name, is_public = f"{before}{node.name}", is_open and not node.name.startswith("_")
            yield name, node, is_public
            yield from named(node, f"{name}.", is_public and isinstance(node, ast.ClassDef))
        else:
            yield from named(node, before, is_open)


def decorators(node: Function | ast.ClassDef) -> set[str]:
    """Last names of a function's decorators: ``kernel`` of ``@launch.kernel``."""
    found = set()
    for decorator in node.decorator_list:
        called = decorator.func if isinstance(decorator, ast.Call) else decorator
        found.add(called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", ""))
    return found


def is_kernel(node: ast.AST) -> bool:
    return isinstance(node, Function) and "kernel" in decorators(node)


def is_for_the_device(node: Function) -> bool:
    """A kernel, a function of the device, or a factory of some."""
    inner = (each for each in ast.walk(node) if isinstance(each, Function))
    return any(name in decorators(each) for each in inner for name in KERNEL_DECORATORS)


def long_files(path: str) -> list[str]:
    """The file, if it is too long."""
    return ["the file"] if text_of(path).count("\n") > LONGEST_FILE and path not in DATA else []


def long_functions(path: str) -> list[str]:
    """Functions that are too long and are no kernel that says why."""
    found, lines = [], text_of(path).splitlines()
    for name, node, _ in named(tree_of(path)):
        body = lines[node.lineno - 1 : node.end_lineno]
        if isinstance(node, Function) and len(body) > LONGEST_FUNCTION:
            if not (is_for_the_device(node) and REASON.search("\n".join(body))):
                found.append(name)
    return found


def untyped_parameters(path: str) -> list[str]:
    """Parameters of public functions, and fields of public classes, whose type is or holds ``Any``."""
    found = []
    for name, node, is_public in named(tree_of(path)):
        if not is_public:
            continue
        if isinstance(node, ast.ClassDef):
            given = [(each.target, each.annotation) for each in node.body if isinstance(each, ast.AnnAssign)]
            typed = [(getattr(target, "id", ""), annotation) for target, annotation in given]
        else:
            a = node.args
            rest = [argument for argument in (a.vararg, a.kwarg) if argument is not None]
            arguments = [*a.posonlyargs, *a.args, *a.kwonlyargs, *rest]
            typed = [(argument.arg, argument.annotation) for argument in arguments if argument.annotation is not None]
        for parameter, annotation in typed:
            if not parameter.startswith("_") and re.search(r"\bAny\b", ast.unparse(annotation)):
                found.append(f"{name}({parameter})")
    return found


def kernels_without_a_line(path: str) -> list[str]:
    """Kernels whose docstring does not say what one thread does."""
    return [name for name, node, _ in named(tree_of(path)) if is_kernel(node) and not ast.get_docstring(node)]


@functools.cache
def classes() -> dict[str, ast.ClassDef]:
    """All classes of what users import and run, by name."""
    return {node.name: node for path in PYTHON for node in ast.walk(tree_of(path)) if isinstance(node, ast.ClassDef)}


def is_said_by_a_base(owner: ast.ClassDef, method: str) -> bool:
    """Whether a class that this one is derived from has a docstring for a method of this name."""
    for base in owner.bases:
        found = classes().get(getattr(base, "attr", getattr(base, "id", "")))
        if found is None:
            continue
        own = [node for node in found.body if isinstance(node, Function) and node.name == method]
        if any(ast.get_docstring(node) for node in own) or is_said_by_a_base(found, method):
            return True
    return False


def without_docstring(path: str) -> list[str]:
    """The module, public classes, functions and methods that have no docstring; of a test the module alone. A method
    that a base class says something about needs to say nothing."""
    found = [] if ast.get_docstring(tree_of(path)) or not text_of(path) else ["the module"]
    if path.startswith("tests/"):
        return found
    for name, node, is_public in named(tree_of(path)):
        owner = classes().get(name.split(".")[-2]) if "." in name else None
        is_said = bool(ast.get_docstring(node)) or is_kernel(node) or "setter" in decorators(node)
        is_said = is_said or (owner is not None and is_said_by_a_base(owner, node.name))
        if is_public and not is_said:
            found.append(name)
    return found


def modules_of(room: str) -> list[str]:
    """Names of the files and of the rooms inside a room."""
    inner = [Path(path).parent.name for path in files(f"{room}/*/__init__.py")]
    return inner + [Path(path).stem for path in files(f"{room}/*.py") if not path.endswith("__init__.py")]


def room_of_test(path: str) -> str:
    """The folder that a folder of tests mirrors."""
    inside = Path(path).parent.relative_to("tests")
    return str(inside) if inside.parts[:1] == ("tools",) else str("ldtrefl" / inside)


@functools.cache
def module_under_test(path: str) -> str | None:
    """The module that a test is named after: of ``test_pictures.py`` and ``test_pictures_written.py`` ``pictures``."""
    name = Path(path).stem.removeprefix("test_") + "_"
    known = [module for module in modules_of(room_of_test(path)) if name.startswith(f"{module}_")]
    return f"{room_of_test(path)}/{max(known, key=len)}.py" if known else None


TESTS = files("tests/**/test_*.py")


def untested(path: str) -> list[str]:
    """The module, if no test is named after it. Parts of tools are tested with the tool, ``__main__`` with ``cli``."""
    needs = not path.endswith(("__init__.py", "__main__.py")) and (path.startswith("ldtrefl/") or path.count("/") == 1)
    return ["no test of its name"] if needs and path not in {module_under_test(test) for test in TESTS} else []


def homeless_test(path: str) -> list[str]:
    """The test, if it is named after no module of its room."""
    is_test = path in TESTS and path not in WHOLE
    return ["no module of its name"] if is_test and module_under_test(path) is None else []


def unsaid_usage(path: str) -> list[str]:
    """What the docstring of a tool leaves out of how to run it."""
    if '__name__ == "__main__"' not in text_of(path):
        return []
    words = ast.get_docstring(tree_of(path)) or ""
    wanted = {"its command line": f"python {path}", "how long it takes": r"\b(seconds?|minutes?|hours?)\b"}
    return [what for what, pattern in wanted.items() if not re.search(pattern, words)]


FILE_NAME = re.compile(r"[`(]([\w./-]+\.(?:py|h|md))[`)]")
"""How docstrings and comments name a file."""


def stale_names(path: str) -> list[str]:
    """Files that docstrings and comments name and that are not there."""
    named_files = set(FILE_NAME.findall(text_of(path)))
    return [
        name
        for name in named_files
        if not any(f"/{known}".endswith(f"/{name}") for known in [*ALL_PYTHON, *HEADERS, *PAGES])
    ]


HABITS: dict[str, tuple[Callable[[str], list[str]], list[str]]] = {
    "files of at most 400 lines": (long_files, [*ALL_PYTHON, *HEADERS]),
    "functions of at most 60 lines": (long_functions, ALL_PYTHON),
    "no public parameter typed Any": (untyped_parameters, PYTHON),
    "kernels say what one thread does": (kernels_without_a_line, ALL_PYTHON),
    "names of files that are there": (stale_names, [*PYTHON, *HEADERS]),
    "docstrings": (without_docstring, ALL_PYTHON),
    "every module has its test": (untested, PYTHON),
    "every test has its module": (homeless_test, TESTS),
    "tools say how to run them": (unsaid_usage, files("tools/*.py")),
}
"""What is asked for: (finds what is not so in a file, the files it is asked of)."""


@pytest.mark.parametrize("habit", HABITS)
def test_habit(habit: str) -> None:
    find, where = HABITS[habit]
    found = {path: sorted(names) for path in where if (names := find(path))}
    assert not found, f"{habit}, but not here: {found}"


def test_every_tool_stands_in_the_list_of_tools() -> None:
    listed = set(re.findall(r"^\| `(\w+\.py)` \|", text_of("tools/README.md"), re.MULTILINE))
    assert listed == {Path(path).name for path in files("tools/*.py") if '__name__ == "__main__"' in text_of(path)}


def test_exceptions_are_still_some() -> None:
    assert all(text_of(path).count("\n") > LONGEST_FILE for path in DATA)
    assert set(WHOLE) <= set(TESTS) and not any(module_under_test(path) for path in WHOLE)
