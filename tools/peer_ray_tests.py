"""The ray tests of trimesh and of Open3D, run on our tracers from copies that the user has.

    python tools/peer_ray_tests.py --trimesh ~/trimesh --open3d ~/Open3D   # half a minute for trimesh

The paths are those of checkouts of their repositories; nothing of theirs is in ours, and Open3D need not be installed.
Each suite runs once for each tracer, in a process of its own, with an adapter in the place of the library's tracer
(``peer_adapters``). A test *does not apply* if it asks for what no ray can answer, or needs a package that is missing:
the output names it. The exit status is 1 if a test fails.
"""

from __future__ import annotations

import argparse
import importlib
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from peer_adapters.crossings import TRACERS

SUITES = {
    "trimesh": ("tests/test_ray.py", "tests/test_ray_upstream.py"),
    "open3d": ("python/test/t/geometry/test_raycasting_scene.py",),
}
"""The files of tests in a checkout of each library."""

MARK = "PEER "
"""What the lines begin with that a child prints for its parent."""

SHOWN = 2000
"""Characters from the end of a child's output that are shown when it breaks off."""


@dataclass
class Recorder:
    """A plugin of pytest's that prints a line for each test: its outcome, its name, and in a few words why."""

    root: Path

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Print what became of a test."""
        if report.when != "call" and report.passed:
            return
        why = ""
        if report.skipped and isinstance(report.longrepr, tuple):
            why = report.longrepr[2].removeprefix("Skipped: ")
        elif report.failed:
            why = getattr(getattr(report.longrepr, "reprcrash", None), "message", str(report.longrepr))
        # A package of the library's own that is missing says nothing of rays.
        is_missing = report.failed and why.startswith(("ImportError", "ModuleNotFoundError"))
        outcome = "skipped" if is_missing else report.outcome
        print(f"{MARK}{outcome}|{report.nodeid.split('::', 1)[1]}|{why.splitlines()[0] if why else ''}", flush=True)


def run_child(suite: str, by: str, root: Path) -> int:
    """Run a suite in this process by a tracer."""
    # Each adapter replaces parts of a library: no process needs both.
    importlib.import_module(f"peer_adapters.for_{suite}").install(by)
    files = [str(root / name) for name in SUITES[suite] if (root / name).is_file()]
    options = ["-q", "-p", "no:cacheprovider", "-c", "/dev/null", f"--rootdir={root}", "-W", "ignore"]
    return int(pytest.main([*options, *files], plugins=[Recorder(root)]))


def run_suite(suite: str, by: str, root: Path) -> list[tuple[str, str, str]]:
    """(outcome, test, why) of every test of a suite by a tracer.

    Raises:
        RuntimeError: pytest did not come to an end.
    """
    command = [sys.executable, "-B", __file__, "--child", suite, by, str(root)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = [line.split(MARK, 1)[1] for line in done.stdout.splitlines() if MARK in line]
    if done.returncode not in (0, 1) or not lines:
        raise RuntimeError(f"{suite} by {by}: {done.stdout[-SHOWN:]}{done.stderr[-SHOWN:]}")
    return [tuple(line.split("|", 2)) for line in lines]  # type: ignore[misc]


def main() -> int:
    """Run the suites that are there and print what passed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for suite, files in SUITES.items():
        parser.add_argument(f"--{suite}", type=Path, help=f"a checkout that has {files[0]}")
    parser.add_argument("--tracers", nargs="+", choices=TRACERS, default=list(TRACERS))
    parser.add_argument("--child", nargs=3, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child:
        suite, by, root = arguments.child
        return run_child(suite, by, Path(root))
    given = {suite: getattr(arguments, suite) for suite in SUITES if getattr(arguments, suite)}
    if not given:
        parser.error("nothing to run: give --trimesh PATH, --open3d PATH or both")
    for suite, root in given.items():
        if not (root / SUITES[suite][0]).is_file():
            parser.error(f"--{suite}: there is no {SUITES[suite][0]} in {root}")
    failures = 0
    for suite, root in given.items():
        aside: dict[str, str] = {}
        for by in arguments.tracers:
            found = run_suite(suite, by, root)
            failed = [(test, why) for outcome, test, why in found if outcome == "failed"]
            aside |= {test: why for outcome, test, why in found if outcome == "skipped"}
            failures += len(failed)
            passed = sum(outcome == "passed" for outcome, _, _ in found)
            left = len(found) - passed - len(failed)
            print(f"{suite} by {by}: {passed} passed, {len(failed)} failed, {left} do not apply", flush=True)
            for test, why in failed:
                print(f"    {test}: {why}")
        for test, why in aside.items():
            print(f"    does not apply: {test} ({why})")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
