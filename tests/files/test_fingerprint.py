"""The fingerprint of an algorithm changes with its constants and its source, C++ included, and with nothing else."""

import importlib
import importlib.util
import shutil
from pathlib import Path

import pytest

import ldtrefl
from ldtrefl.files.fingerprint import fingerprint


@pytest.mark.parametrize(
    "module",
    [
        "geometry.fixed_raster",
        "ldt.exact.backs_check",
        "ldt.exact.binary_tree",
        "ldt.exact.build",
        "ldt.exact.patch_check",
        "ldt.exact.patches",
        "ldt.exact.patch",
        "ldt.exact.record_choice",
        "ldt.exact.sample",
        "ldt.exact.survey",
        "ldt.exact.tree",
        "ldt.exact.walk",
    ],
)
def test_every_constant_is_part_of_the_key(module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    before = fingerprint("ldt.texture")
    found = importlib.import_module(f"ldtrefl.{module}")
    own = [
        name
        for name, value in vars(found).items()
        if name[0].isupper() and name.isupper() and isinstance(value, int | float | dict)
    ]
    assert own
    for name in own:
        value = getattr(found, name)
        other = {**value, "finest": 1.0} if isinstance(value, dict) else value + 1 if abs(value) < 1e6 else 2 * value
        with monkeypatch.context() as patch:
            patch.setattr(found, name, other)
            assert fingerprint("ldt.texture") != before, name
    assert fingerprint("ldt.texture") == before


def test_the_source_is_part_of_the_key(tmp_path: Path) -> None:
    """C++ and the modules far below, but not the command line."""
    copied = tmp_path / "ldtrefl"
    shutil.copytree(Path(ldtrefl.__file__).parent, copied, ignore=shutil.ignore_patterns("__pycache__"))

    def key_after(changed_file: str | None) -> str:
        if changed_file is not None:
            assert (copied / changed_file).is_file()
            with (copied / changed_file).open("a") as file:
                file.write("\n")
        spec = importlib.util.spec_from_file_location("ldtrefl.files.fingerprint", copied / "files" / "fingerprint.py")
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return str(module.fingerprint("ldt.texture"))

    changed = ("ldt/exact/walk.h", "device/vectors.h", "ldt/exact/patches.py", "device/bins.py", "ldt/texture.py")
    keys = [key_after(name) for name in (None, *changed)]
    assert len(set(keys)) == len(keys) and keys[0] == fingerprint("ldt.texture")
    assert key_after("cli/program.py") == keys[-1]
