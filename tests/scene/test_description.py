"""Wrong input: one line naming file, key and what is allowed; never a traceback, never a half-written file."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.description import Camera, Object, Scene
from tests.conftest import SMALL_SCENE

THING = 'shape = "torus"\nparams = { segments = [16, 8] }'
WRONG = [
    # (what is replaced, by what, what the message names)
    ("eye = ", "eyee = ", r"camera: unknown key 'eyee'; did you mean 'eye'"),
    ("width = 24", "widht = 24", r"camera: unknown key 'widht'; did you mean 'width'"),
    ("[camera]", "[cammera]", r"unknown key 'cammera'; did you mean 'camera'"),
    ("mirror = ", "miror = ", r"object\[0\]\.material: unknown key 'miror'; did you mean 'mirror'"),
    ("[0.0, -5.0, 1.0]", "[0.0, nan, 1.0]", r"camera\.eye\[1\]: .*got nan"),
    ("[0.0, -5.0, 1.0]", "[0.0, inf, 1.0]", r"camera\.eye\[1\]: .*got inf"),
    ("[0.0, -5.0, 1.0]", "[0.0, 1.0]", r"camera\.eye\[2\]: Field required"),
    ("[0.0, -5.0, 1.0]", '"far"', r"camera\.eye: should be a list, got 'far'"),
    ("[0.0, -5.0, 1.0]", "[true, 0, 1]", r"camera\.eye\[0\]: should be a number"),
    ("[0.0, -5.0, 1.0]", "[0.0, 0.0, 0.0]", r"camera: eye and look_at are the same point"),
    ("[0.0, -5.0, 1.0]", "[0.0, 0.0, 3.0]", r"camera: up is parallel"),
    ("width = 24", "width = 0", r"camera\.width: .*greater than or equal to 1, got 0"),
    ("width = 24", "width = 24.5", r"camera\.width: should be a valid integer, got 24\.5"),
    ("width = 24", "width = 99999", r"camera\.width: should be less than or equal to \d+, got 99999"),
    ("width = 24", "fov_y = 180.0", r"camera\.fov_y: should be less than 180, got 180\.0"),
    ('shape = "torus"', 'shape = "tours"', r"object\[1\]\.shape: unknown shape 'tours'; did you mean 'torus'"),
    ('shape = "torus"', 'mesh = "none.ply"', r"object\[1\]: 'params' goes with 'shape'"),
    (THING, 'mesh = "none.ply"\nfit = 1.0', r"object\[1\]\.mesh: no file 'none\.ply'"),
    ('"thing"', '"thing"\nmesh = "x.ply"', r"object\[1\]: needs either 'mesh' or 'shape'"),
    ('"thing"', '"thing"\nscale = -1.0', r"object\[1\]\.scale: should be from 1e-15 to 1e\+15, got -1$"),
    ('"thing"', '"thing"\nfit = 0.0', r"object\[1\]\.fit: should be from 1e-15 to 1e\+15, got 0$"),
    ('"thing"', '"thing"\nsmooth = "yes"', r"object\[1\]\.smooth: should be a valid boolean, got 'yes'"),
    ('"thing"', '"thing"\nrotate = [0, 0, 0, 30]', r"object\[1\]: rotate: the axis must not be the zero vector"),
    ("[0.9, 0.9, 0.9]", "[1.5, 0.9, 0.9]", r"object\[0\]\.material\.mirror\[0\]: .*less than or equal to 1, got 1\.5"),
    (
        "[camera]",
        '[[light]]\nkind = "spot"\n[camera]',
        r"light\[0\]\.kind: should be 'directional' or 'point', got 'spot'",
    ),
    ("[0.9, 0.9, 0.9]", "1.5", r"object\[0\]\.material\.mirror: should be less than or equal to 1, got 1\.5"),
    ("[0.9, 0.9, 0.9]", '"red"', r"object\[0\]\.material\.mirror: should be a list, got 'red'"),
    ("[16, 8]", "[8192, 4096]", r"object\[0\]\.shape: the shape 'sphere' needs .* \(params\.segments or --memory"),
    ("[16, 8]", "[2, 8]", r"object\[0\]\.shape: params: segments\[0\]: "),
    ("width = 24", "width = " + "9" * 5000, "line 5: a number or a bare key of more than 100 characters"),
    ("width = 24", "width = " + "[" * 3000, "line 5: more than 32 brackets"),
    ("width = 24", "a." * 50_000 + "a = 1", "line 5: more than 16 dots"),
    ("width = 24", "width = 24\nfov_y = 1e-300", r"camera\.fov_y: "),
    ('"thing"', '"thing"\nscale = 1e-300', r"object\[1\]\.scale: should be from 1e-15 to 1e\+15, got 1e-300"),
    ('"thing"', '"thing"\nfit = 1e-15\nscale = 1e-15', r"object\[1\]: fit 1e-15, scale 1e-15 and the mesh's own size"),
    (
        "[camera]",
        '[[light]]\nkind = "directional"\nradiance = 1\ndirection = [1e38, 0, 0]\n[camera]',
        r"light\[0\]\.dire",
    ),
    ("[camera]", '[[light]]\nkind = "point"\nposition = [0, 0, 1]\n[camera]', r"light\[0\]: a point light needs 'int"),
    ("[camera]", '[environment]\nimage = "none.exr"\n[camera]', r"environment\.image: no file 'none\.exr'"),
    ("[camera]", '[reflection]\nmethod = "magic"\n[camera]', r"unknown method 'magic'"),
    (
        "[camera]",
        "[reflection]\nmax_bounces = 0\n[camera]",
        r"reflection\.max_bounces: should be greater than or equal to 1, got 0",
    ),
    ("[camera]", "[camera", r"not TOML \(Expected '\]'"),
    ("[camera]", "\x00", r"not TOML \(Invalid statement"),
]


@pytest.mark.parametrize(("old", "new", "message"), WRONG, ids=[new[:30] for _, new, _ in WRONG])
def test_wrong_scene(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in SMALL_SCENE
    path = tmp_path / "scene.toml"
    path.write_text(SMALL_SCENE.replace(old, new, 1))
    with pytest.raises(ldtrefl.InputError, match=message) as caught:
        ldtrefl.render(ldtrefl.load_scene(path))
    assert "\n" not in str(caught.value)
    if "method" not in message:
        assert str(path) in str(caught.value)


MESHES = {
    "empty.obj": (b"", r"the mesh has no triangles$"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\n", r"the mesh has no triangles$"),
    "range.off": (
        b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
        r"not a mesh that can be read \(.*face index outside the range",
    ),
    "nan.off": (
        b"OFF\n3 1 0\n0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n",
        r"vertex 1 is not finite or too large: \[nan, 0\.0, 0\.0\]",
    ),
    "noise.ply": (bytes(range(256)) * 8, r"not a mesh that can be read \(.*[Nn]ot a ply file"),
    "noise.glb": (bytes(range(256)) * 8, r"not a mesh that can be read \(.*header"),
    "words.xyzw": (b"hello", r"not a kind of mesh file that can be read \(allowed: .*\bply\b"),
}


@pytest.mark.parametrize("name", sorted(MESHES))
def test_wrong_mesh_file(tmp_path: Path, name: str) -> None:
    content, message = MESHES[name]
    (tmp_path / name).write_bytes(content)
    scene = tmp_path / "scene.toml"
    scene.write_text(SMALL_SCENE.replace(THING, f'mesh = "{name}"'))
    with pytest.raises(ldtrefl.InputError, match=message) as caught:
        ldtrefl.load_scene(scene)
    assert name in str(caught.value) and r"object[1].mesh" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3), int), "no triangles"),
        (np.eye(3), np.zeros((0, 3), int), "no triangles"),
        (np.eye(3), [[0, 1, 3]], r"triangle 0 has vertices \[0, 1, 3\], allowed are 0 to 2"),
        (np.eye(3), [[0, 1, 2], [0, -1, 2]], "triangle 1 has vertices"),
        (np.where(np.eye(3) > 0, np.nan, 0), [[0, 1, 2]], "vertex 0 is not finite"),
        (np.diag([1, np.inf, 1]), [[0, 1, 2]], "vertex 1 is not finite"),
        (np.eye(2), [[0, 1, 2]], r"vertices must have shape \(n, 3\), got \(2, 2\)"),
        (np.eye(3), [[0, 1]], r"faces must have shape \(n, 3\)"),
        (np.eye(3), [[0.5, 1, 2]], "whole numbers"),
        ("corner", [[0, 1, 2]], "vertices must be numbers"),
    ],
)
def test_wrong_arrays(vertices: object, faces: object, message: str) -> None:
    for maker in (ldtrefl.peel, ldtrefl.Raycaster):
        with pytest.raises(ldtrefl.InputError, match=message):
            maker(vertices, faces)


@pytest.mark.parametrize("resolution", [0, -4, 15, 4097, 12.5, "many", True, None])
def test_wrong_resolution(resolution: object) -> None:
    with pytest.raises(ldtrefl.InputError, match=rf"^resolution: should be .*, got {resolution!r}$"):
        ldtrefl.peel(np.eye(3), [[0, 1, 2]], resolution=resolution)


def test_wrong_options_threads_and_devices() -> None:
    scene = Scene(camera=Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4), objects=(Object(shape="box"),))
    for options, message in [
        ({"resolution": 8}, "resolution: .*greater than or equal to 16, got 8"),
        ({"resolutoin": 64}, "unknown option of method ldt 'resolutoin'; did you mean 'resolution'"),
        ({"search": "spiral"}, "method ldt: search: should be 'exact' or 'linear', got 'spiral'"),
        ({"method": "lidt"}, "unknown method 'lidt'; did you mean 'ldt'"),
        ({"device": "cuda:99"}, "no device 'cuda:99'"),
    ]:
        with pytest.raises(ldtrefl.InputError, match=message):
            ldtrefl.render(scene, **options)
    for threads in (0, -1, 2.5, "two", True):
        with pytest.raises(ldtrefl.InputError, match=rf"threads must be a whole number from 1 to \d+, got {threads!r}"):
            ldtrefl.set_threads(threads)


def run(*arguments: object, folder: Path) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "ldtrefl", *map(str, arguments)]
    return subprocess.run(command, check=False, capture_output=True, text=True, cwd=folder, timeout=120)


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(SMALL_SCENE)
    return path


def test_command_line_refuses_in_one_line(scene_file: Path) -> None:
    folder = scene_file.parent
    (folder / "bad.toml").write_text(SMALL_SCENE.replace("eye = ", "eyee = "))
    before = sorted(path.name for path in folder.iterdir())
    for arguments, message in [
        (("render", "none.toml"), "none.toml"),
        (("render", "bad.toml"), "unknown key 'eyee'"),
        (("render", "scene.toml", "--method", "nope"), "unknown method 'nope'"),
        (("render", "scene.toml", "--set", "resolution=-1"), "resolution"),
        (("render", "scene.toml", "--set", "resolution"), "OPTION=VALUE"),
        (("render", "scene.toml", "--set", "skip=regions,bonds"), "did you mean 'bounds'"),
        (("render", "scene.toml", "--set", "skip=[1]"), "expected all, none, or names"),
        (("render", "scene.toml", "--set", "error=0"), "error: should be greater than 0"),
        (("render", "scene.toml", "--set", "cull=none"), "'safe' or 'flat'"),
        (("render", "scene.toml", "-o", "none/a.png"), "does not exist"),
        (("render", "scene.toml", "-o", "a.bmp"), ".png or .exr"),
        (("render", "scene.toml", "--threads", "0"), "threads"),
        (("render", "scene.toml", "--device", "cuda:77"), "no device"),
        (("render",), "SCENE"),
        (("rendr", "scene.toml"), "rendr"),
        (("render", "scene.toml", "--fast"), "--fast"),
        (("compare", "scene.toml", "--methods", "ldt,nope"), "unknown method 'nope'"),
        (("compare", "scene.toml", "--set", "resolution=64"), "METHOD.OPTION=VALUE"),
        (("peel", "none.ply"), "none.ply"),
        (("info", "none.toml"), "none.toml"),
        ((), "command"),
    ]:
        done = run(*arguments, folder=folder)
        lines = done.stderr.strip().splitlines()
        assert done.returncode == 2, (arguments, done.stderr)
        assert len(lines) == 1 and message in lines[0], (arguments, done.stderr)
    assert sorted(path.name for path in folder.iterdir()) == before


def test_command_line_does_its_work(scene_file: Path) -> None:
    folder = scene_file.parent
    for arguments, said in [
        (("render", "scene.toml"), "scene.png: 24 x 16"),
        (("render", "scene.toml", "-o", "a.exr", "--method", "bvh", "--threads", "1"), "a.exr"),
        (("render", "scene.toml", "-o", "b.png", "--set", "resolution=32", "--set", "search=linear"), "march"),
        (("compare", "scene.toml", "-o", "cmp", "--set", "ldt.resolution=64"), "envmap"),
        (("peel", "genus3", "-o", "layers.png", "--resolution", "64"), "layers per face"),
        (("info", "scene.toml"), "torus"),
        (("info", "genus3"), "closed"),
        (("methods",), "quality = 'balanced'  Of the exact search"),
    ]:
        done = run(*arguments, folder=folder)
        assert done.returncode == 0 and said in done.stdout, (arguments, done.stdout, done.stderr)
        assert not [line for line in done.stderr.splitlines() if not line.startswith("ldtrefl: compiling kernels")]
    assert ldtrefl.load_image(folder / "scene.png").shape == (16, 24, 3)
    made = {path.name for path in (folder / "cmp").iterdir()}
    pictures = {f"{name}{kind}.png" for name in ("ldt", "envmap") for kind in ("", "-difference")} | {"bvh.png"}
    assert made == pictures | {"compare.json"}


def test_nothing_is_left_behind_when_writing_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("ldtrefl.files.atomic_write.os.replace", fail)
    with pytest.raises(ldtrefl.InputError, match=r"a\.png: cannot be written \(No space left on device\)"):
        ldtrefl.save_image(tmp_path / "a.png", np.zeros((4, 4, 3), np.float32))
    assert list(tmp_path.iterdir()) == []
