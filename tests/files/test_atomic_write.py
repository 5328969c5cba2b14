"""Files are written whole or not at all, on a full disk too; what they replace keeps its place and its permissions."""

import os
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.cli.program import main
from ldtrefl.files.atomic_write import written_whole
from ldtrefl.files.map_cache import MapCache
from ldtrefl.scene import shapes
from tests.conftest import SMALL_SCENE

DISK = 64 << 10
PAGE = 4096

Writer = Callable[[Path], None]


def noise(height: int = 100, width: int = 100) -> np.ndarray:
    """An image that does not compress: 3 bytes a pixel as PNG, and 10 or more as EXR."""
    return np.random.default_rng(0).random((height, width, 3)).astype(np.float32)


def write_report(path: Path) -> None:
    with written_whole(path) as scratch:
        scratch.write_text("a line of a report\n" * 2000)


def write_maps(path: Path) -> None:
    mesh = shapes.make("torus_knot", {"segments": [24, 6]})
    ldtrefl.peel(mesh.vertices, mesh.faces, 16, search="linear").save(path)


WRITERS: dict[str, Writer] = {
    "a.png": lambda path: ldtrefl.save_image(path, noise()),
    "a.exr": lambda path: ldtrefl.save_image(path, noise(50, 80)),
    "a.jpg": lambda path: ldtrefl.save_image(path, noise(), quality=100),
    "a.webp": lambda path: ldtrefl.save_image(path, noise(), quality=100),
    "a.npz": write_maps,
    "report.md": write_report,
}


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 64 kB; the test is skipped where this process may not mount one."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={DISK}", "tmpfs", str(folder)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError as error:
        pytest.skip(f"no small disk to be had: {error}")
    if done.returncode:
        pytest.skip(f"no small disk to be had: {done.stderr.strip()}")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.parametrize("name", sorted(WRITERS))
def test_whole_or_absent_however_little_room_there_is(small_disk: Path, tmp_path: Path, name: str) -> None:
    write = WRITERS[name]
    write(tmp_path / name)
    whole = (tmp_path / name).read_bytes()
    assert 4 * PAGE < len(whole) < DISK - PAGE
    written = 0
    for pages in range(DISK // PAGE):
        (small_disk / "rest").write_bytes(bytes(PAGE * pages))
        try:
            write(small_disk / name)
        except ldtrefl.InputError as error:
            assert str(small_disk / name) in str(error) and "\n" not in str(error)
            assert os.listdir(small_disk) == ["rest"], pages
        else:
            written += 1
            assert len((small_disk / name).read_bytes()) == len(whole), pages
            (small_disk / name).unlink()
        (small_disk / "rest").unlink()
    assert 0 < written < DISK // PAGE


def test_a_file_that_does_not_fit_leaves_the_old_one(small_disk: Path) -> None:
    for name, write in WRITERS.items():
        (small_disk / name).write_bytes(b"old")
        (small_disk / "rest").write_bytes(bytes(DISK - 6 * PAGE))
        with pytest.raises(ldtrefl.InputError):
            write(small_disk / name)
        assert (small_disk / name).read_bytes() == b"old"
        (small_disk / "rest").unlink()
        assert os.listdir(small_disk) == [name]
        (small_disk / name).unlink()


def test_a_full_disk_for_maps_is_no_fault(small_disk: Path, caplog: pytest.LogCaptureFixture) -> None:
    cache = MapCache(small_disk / "maps")
    for count in range(1000, 30_000, 1000):
        cache.store("a" * 32, {"x": np.arange(count)}, {})
        entry = cache.load("a" * 32)
        if entry is None:
            assert not list(cache.folder.iterdir())
        else:
            assert np.array_equal(entry.arrays["x"], np.arange(count))
            cache.clear()
    assert any("the maps are not kept" in record.getMessage() for record in caplog.records)


def test_command_line_on_a_full_disk(
    small_disk: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    scene, picture = tmp_path / "scene.toml", small_disk / "a.png"
    scene.write_text(SMALL_SCENE)
    (small_disk / "rest").write_bytes(bytes(DISK))
    assert main(["render", str(scene), "-o", str(picture), "--no-cache"]) == 2
    said = capfd.readouterr().err.strip().splitlines()
    assert len(said) == 1 and str(picture) in said[0]
    assert main(["compare", str(scene), "--methods", "bvh", "-o", str(small_disk)]) == 2
    assert len(capfd.readouterr().err.strip().splitlines()) == 1
    assert os.listdir(small_disk) == ["rest"]
    # Maps for which there is no room are no fault of the picture.
    scene.write_text(SMALL_SCENE.replace("segments = [16, 8] }\ntranslate", "segments = [150, 50] }\ntranslate"))
    (small_disk / "rest").write_bytes(bytes(DISK - 2 * PAGE))
    assert main(["render", str(scene), "-o", str(tmp_path / "a.png"), "--cache", str(small_disk / "maps")]) == 0
    assert any("the maps are not kept" in record.getMessage() for record in caplog.records)
    assert ldtrefl.load_image(tmp_path / "a.png").shape == (16, 24, 3)


LIMITED = """
import resource, sys
import numpy as np
import ldtrefl
from pathlib import Path
sys.path.insert(0, {root!r})
from tests.files.test_atomic_write import WRITERS
for name, write in WRITERS.items():
    for limit in (0, 1, 5000, 20_000):
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
        try:
            write(Path({folder!r}) / name)
        except ldtrefl.InputError:
            continue
        raise SystemExit(f"{{name}} was written into {{limit}} bytes")
"""


def test_a_limit_on_files(tmp_path: Path) -> None:
    """As a full disk, without one: the process may write so many bytes into a file and no more."""
    root = str(Path(__file__).parent.parent.parent)
    program = LIMITED.format(root=root, folder=str(tmp_path))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", sorted(WRITERS))
def test_what_is_replaced_keeps_its_permissions(tmp_path: Path, name: str) -> None:
    before = os.umask(0o027)
    try:
        WRITERS[name](tmp_path / name)
        assert stat.S_IMODE((tmp_path / name).stat().st_mode) == 0o640
        (tmp_path / name).chmod(0o604)
        WRITERS[name](tmp_path / name)
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / name).stat().st_mode) == 0o604


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    for target in ("kept/there.png", "kept/new.png"):
        link = tmp_path / f"{Path(target).stem}-link.png"
        link.symlink_to(target)
        if "there" in target:
            (tmp_path / target).write_bytes(b"old")
        ldtrefl.save_image(link, noise())
        assert link.is_symlink() and ldtrefl.load_image(tmp_path / target).shape == (100, 100, 3)
    (tmp_path / "loop.png").symlink_to("loop.png")
    with pytest.raises(ldtrefl.InputError, match=r"loop\.png"):
        ldtrefl.save_image(tmp_path / "loop.png", noise())


def test_pipes_and_devices_are_not_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.png")
    (tmp_path / "null.png").symlink_to("/dev/null")
    for name in ("pipe.png", "null.png"):
        with pytest.raises(ldtrefl.InputError, match="a pipe or a device"):
            ldtrefl.save_image(tmp_path / name, noise())
    assert sorted(os.listdir(tmp_path)) == ["null.png", "pipe.png"]
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode) and stat.S_ISFIFO((tmp_path / "pipe.png").stat().st_mode)


def test_the_longest_name_can_be_written(tmp_path: Path) -> None:
    name = "n" * 251 + ".png"
    ldtrefl.save_image(tmp_path / name, noise())
    assert os.listdir(tmp_path) == [name]


def test_nothing_is_left_behind_when_writing_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("ldtrefl.files.atomic_write.os.replace", fail)
    with pytest.raises(ldtrefl.InputError, match=r"a\.png: cannot be written \(No space left on device\)"):
        ldtrefl.save_image(tmp_path / "a.png", np.zeros((4, 4, 3), np.float32))
    assert list(tmp_path.iterdir()) == []
