"""Scene files: wrong input is one line that names the file, the key and what is allowed; what is shared counts once."""

from pathlib import Path

import pytest

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.scene.load import OBJECT_BYTES
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
    ("[0.0, -5.0, 1.0]", "[true, 0, 1]", r"camera\.eye\[0\]: should be a valid number, got True"),
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
        '[[light]]\nkind = "tube"\n[camera]',
        r"light\[0\]\.kind: should be 'directional', 'point', 'spot', 'sphere' or 'rectangle', got 'tube'",
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
    "empty.obj": (b"", r"the mesh has no triangles: no line of the file is a face"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\n", r"the mesh has no triangles: no line of the file is a face"),
    "range.off": (
        b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
        r"range\.off: face 0 has vertex 7, allowed are 0 to 2",
    ),
    "nan.off": (
        b"OFF\n3 1 0\n0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n",
        r"vertex 1 is not finite or too large: \[nan, 0\.0, 0\.0\]",
    ),
    "noise.ply": (bytes(range(256)) * 8, r"noise\.ply: not a PLY file: it should begin with 'ply'"),
    "noise.glb": (bytes(range(256)) * 8, r"noise\.glb: its JSON cannot be read"),
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


def test_a_scene_adds_up_and_counts_what_is_shared_once(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SMALL_SCENE)
    with budget.account() as one:
        first = ldtrefl.load_scene(path)
    with budget.account() as again:  # nothing is made now: the shapes are still in use
        ldtrefl.load_scene(path)
    twice = SMALL_SCENE + SMALL_SCENE[SMALL_SCENE.index("[[object]]") :]
    path.write_text(twice)
    with budget.account() as two:
        second = ldtrefl.load_scene(path)
    assert one.taken == again.taken == two.taken - 2 * OBJECT_BYTES > 0
    assert second.objects[0].geometry is second.objects[2].geometry is first.objects[0].geometry
    budget.set_memory_limit(two.taken)
    ldtrefl.load_scene(path)
    budget.set_memory_limit(two.taken - 1)
    with pytest.raises(ldtrefl.InputError, match=r"object\[1\]\.shape: .* for the rest of the scene, allowed are"):
        ldtrefl.load_scene(path)


def test_objects_count_without_their_meshes_too(tmp_path: Path) -> None:
    """A file of four megabytes holds more than a hundred thousand."""
    path = tmp_path / "scene.toml"
    path.write_text(SMALL_SCENE + '[[object]]\nshape="box"\n' * 2000)
    budget.set_memory_limit(2000 * OBJECT_BYTES)
    with pytest.raises(ldtrefl.InputError, match=r"scene\.toml: object: a list of 2002 needs 15\.6 MiB, allowed"):
        ldtrefl.load_scene(path)
