"""What mesh files store arrives, corner for corner; what takes too much is refused before it is taken."""

import bz2
import gzip
import io
import os
import tarfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

import ldtrefl
from ldtrefl import InputError
from ldtrefl.base import budget
from tests.mesh_writers import write_glb, write_ply


@pytest.fixture(autouse=True)
def usual_limit() -> None:
    budget.set_memory_limit()


def soft_box() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A box with 36 corners of its own, each with a normal that no rule would give it: (positions, normals, order)."""
    box = trimesh.creation.box()
    positions = box.vertices[box.faces].reshape(-1, 3).astype(np.float32)
    normals = np.random.default_rng(0).normal(size=(36, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    return positions, normals, np.arange(36, dtype=np.uint32)


MESH = [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}]
SCENE = [{"nodes": [0]}]


def test_a_glb_keeps_the_normals_of_all_36_corners(tmp_path: Path) -> None:
    positions, normals, order = soft_box()
    path = write_glb(tmp_path / "a.glb", [positions, normals, order], meshes=MESH, nodes=[{"mesh": 0}], scenes=SCENE)
    mesh = ldtrefl.load_mesh(path)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces].reshape(-1, 3), positions)
    np.testing.assert_array_equal(mesh.normals[mesh.faces].reshape(-1, 3), normals)


def test_a_ply_keeps_the_normals_of_all_36_corners(tmp_path: Path) -> None:
    positions, normals, order = soft_box()
    vertices = (
        [f"float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")],
        np.hstack([positions, normals]).tolist(),
    )
    faces = (["list uchar int vertex_indices"], [[row] for row in order.reshape(-1, 3).tolist()])
    for kind in ("ascii", "binary_little_endian"):
        mesh = ldtrefl.load_mesh(write_ply(tmp_path / f"{kind}.ply", kind, {"vertex": vertices, "face": faces}))
        np.testing.assert_allclose(mesh.normals[mesh.faces].reshape(-1, 3), normals, atol=1e-7)


@pytest.mark.parametrize("has_uvs", [True, False])
@pytest.mark.parametrize("is_quads", [True, False])
def test_an_obj_keeps_what_each_corner_has(tmp_path: Path, is_quads: bool, has_uvs: bool) -> None:
    """Corners share positions, but neither texture coordinates nor normals."""
    rng = np.random.default_rng(0)
    box = trimesh.creation.box()
    faces = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6]]) if is_quads else box.faces
    size = faces.shape[1]
    uvs, normals = rng.uniform(0, 1, (faces.size, 2)).round(4), rng.normal(size=(faces.size, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).round(4)
    lines = [f"v {x} {y} {z}" for x, y, z in box.vertices]
    lines += [f"vt {u} {v}" for u, v in uvs] if has_uvs else []
    lines += [f"vn {x} {y} {z}" for x, y, z in normals]
    for k, face in enumerate(faces):
        corners = [size * k + j + 1 for j in range(size)]
        words = [f"{v + 1}/{c if has_uvs else ''}/{c}" for v, c in zip(face, corners, strict=True)]
        lines.append("f " + " ".join(words))
    (tmp_path / "a.obj").write_text("\n".join(lines))
    mesh = ldtrefl.load_mesh(tmp_path / "a.obj")
    cut = np.array([[0, 1, 2], [2, 3, 0]] if is_quads else [[0, 1, 2]])
    chosen = (size * np.arange(len(faces))[:, None, None] + cut).reshape(-1, 3)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], box.vertices[faces.reshape(-1)[chosen]])
    np.testing.assert_allclose(mesh.normals[mesh.faces], normals[chosen], atol=1e-3)
    assert (mesh.uvs is not None) == has_uvs
    if mesh.uvs is not None:
        np.testing.assert_allclose(mesh.uvs[mesh.faces], uvs[chosen], atol=1e-6)


def test_relative_numbers_of_an_obj_count_from_where_they_stand(tmp_path: Path) -> None:
    square = "v 0 0 {0}\nv 1 0 {0}\nv 0 1 {0}\nf -3 -2 -1\n"
    (tmp_path / "a.obj").write_text("".join(square.format(z) for z in range(3)))
    mesh = ldtrefl.load_mesh(tmp_path / "a.obj")
    np.testing.assert_array_equal(mesh.vertices[mesh.faces][:, :, 2], [[0] * 3, [1] * 3, [2] * 3])


def test_an_obj_may_have_a_mark_and_comments_of_any_letters(tmp_path: Path) -> None:
    text = "# caf\u00e9\r\nv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nv 1 1 0\r\nf 1 2 4 3 # d\u00e9j\u00e0 vu\r\n"
    for encoding in ("latin-1", "utf-8", "utf-8-sig"):
        (tmp_path / "a.obj").write_bytes(text.encode(encoding))
        assert len(ldtrefl.load_mesh(tmp_path / "a.obj").faces) == 2


def test_nodes_place_normals_and_winding(tmp_path: Path) -> None:
    """A stretched and turned copy, and a mirrored one inside a moved node: the sphere's normals follow its surface."""
    ball = trimesh.creation.icosphere(3)
    positions, order = ball.vertices.astype(np.float32), ball.faces.astype(np.uint32).reshape(-1)
    half = float(np.sqrt(0.5))
    nodes = [
        {"mesh": 0, "scale": [3, 1, 0.5], "rotation": [0, 0, half, half]},
        {"children": [2], "translation": [10, 0, 0], "scale": [2, 2, 2]},
        {"mesh": 0, "scale": [-1, 1, 1], "translation": [1, 0, 0]},
    ]
    path = tmp_path / "a.glb"
    write_glb(path, [positions, positions, order], meshes=MESH, nodes=nodes, scenes=[{"nodes": [0, 1]}])
    mesh = ldtrefl.load_mesh(path)
    count = len(positions)
    # A quarter turn about z takes the stretched x to y: the ellipsoid x^2 + y^2 / 9 + 4 z^2 = 1 and its gradient.
    wide, small = (slice(0, count), slice(count, None)) if mesh.bounds[1, 0] > 5 else (None, None)
    if np.abs(mesh.vertices[:count, 0]).max() > 5:
        wide, small = small, wide
    gradient = mesh.vertices[wide] * [1, 1 / 9, 4]
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(mesh.normals[wide], gradient, atol=1e-5)
    outward = mesh.vertices[small] - [12, 0, 0]
    np.testing.assert_allclose(mesh.normals[small], outward / 2, atol=1e-5)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    facets = np.cross(b - a, c - a)
    assert ((facets * mesh.normals[mesh.faces].sum(axis=1)).sum(axis=1) > 0).all()


def test_normals_that_are_none_are_undefined(tmp_path: Path) -> None:
    """NaN and 0 become 0, for which shading takes the facet's; long ones become unit vectors; all 0 is none at all."""
    positions, normals, order = soft_box()
    spoilt = normals.copy()
    spoilt[0], spoilt[1], spoilt[2] = np.nan, 0.0, 5.0 * spoilt[2]
    tree = {"meshes": MESH, "nodes": [{"mesh": 0}], "scenes": SCENE}
    mesh = ldtrefl.load_mesh(write_glb(tmp_path / "a.glb", [positions, spoilt, order], **tree))
    np.testing.assert_allclose(
        mesh.normals[mesh.faces].reshape(-1, 3)[:4], [[0] * 3, [0] * 3, *normals[2:4]], atol=1e-6
    )
    mesh = ldtrefl.load_mesh(write_glb(tmp_path / "b.glb", [positions, 0 * normals, order], **tree))
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)


def test_pieces_without_normals_get_smooth_ones_each_by_itself(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(2)
    positions, order = ball.vertices.astype(np.float32), ball.faces.astype(np.uint32).reshape(-1)
    upper = order.reshape(-1, 3)[positions[order.reshape(-1, 3)][..., 2].mean(axis=1) > 0].reshape(-1)
    primitives = [
        {"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2},
        {"attributes": {"POSITION": 0}, "indices": 3},
    ]
    tree = {"meshes": [{"primitives": primitives}], "nodes": [{"mesh": 0}], "scenes": SCENE}
    mesh = ldtrefl.load_mesh(write_glb(tmp_path / "a.glb", [positions, -positions, order, upper], **tree))
    np.testing.assert_allclose(mesh.normals[: len(positions)], -positions, atol=1e-6)
    alone = ldtrefl.Mesh(positions, upper.reshape(-1, 3))
    np.testing.assert_array_equal(mesh.normals[len(positions) :], alone.normals)


def test_no_primitive_of_many_is_lost(tmp_path: Path) -> None:
    """20,000 primitives in under a megabyte; trimesh's own scene drops a dozen of them."""
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    primitives = [{"attributes": {"POSITION": 0}, "indices": 1}] * 20_000
    order = np.arange(3, dtype=np.uint32)
    path = write_glb(
        tmp_path / "a.glb", [positions, order], meshes=[{"primitives": primitives}], nodes=[{"mesh": 0}], scenes=SCENE
    )
    assert path.stat().st_size < 1_000_000
    mesh = ldtrefl.load_mesh(path)
    assert len(mesh.faces) == len(mesh.parts) == 20_000
    assert (mesh.normals == [0, 0, 1]).all()


def test_a_material_of_many_pieces_has_one_picture(tmp_path: Path) -> None:
    picture = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.new("RGB", (4, 4), (9, 9, 9)))
    scene = trimesh.Scene()
    for k in range(3):
        sheet = trimesh.Trimesh([[k, 0, 0], [k + 1, 0, 0], [k, 1, 0]], [[0, 1, 2]], process=False)
        sheet.visual = trimesh.visual.TextureVisuals(uv=np.eye(3)[:, :2], material=picture)
        scene.add_geometry(sheet)
    scene.export(tmp_path / "a.glb")
    mesh = ldtrefl.load_mesh(tmp_path / "a.glb")
    assert len(mesh.parts) == 3 and all(part.texture is mesh.parts[0].texture for part in mesh.parts)


@pytest.mark.parametrize("kind", ["obj", "ply"])
def test_a_sheet_modelled_twice_is_smooth_on_both_sides(tmp_path: Path, kind: str) -> None:
    """A roof of two slopes whose faces are there twice, wound both ways, with the same vertices."""
    vertices = [[-1, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 3, 0], [0, 3, 1], [1, 3, 0]]
    faces = [[0, 1, 4, 3], [0, 3, 4, 1], [1, 2, 5, 4], [1, 4, 5, 2]]
    path = tmp_path / f"a.{kind}"
    if kind == "obj":
        lines = [f"v {x} {y} {z}" for x, y, z in vertices]
        path.write_text("\n".join([*lines, *("f " + " ".join(str(k + 1) for k in face) for face in faces)]))
    else:
        points = (["float x", "float y", "float z"], [list(map(float, vertex)) for vertex in vertices])
        lists = (["list uchar int vertex_indices"], [[face] for face in faces])
        write_ply(path, "binary_little_endian", {"vertex": points, "face": lists})
    mesh = ldtrefl.load_mesh(path)
    corners, normals = mesh.vertices[mesh.faces], mesh.normals[mesh.faces]
    up = np.sign(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2])
    half = np.sqrt(0.5)
    slope = np.array([[-half, 0, half], [0, 0, 1], [half, 0, half]])  # left eaves, ridge, right eaves
    wanted = up[:, None, None] * slope[corners[..., 0].astype(int) + 1]
    np.testing.assert_allclose(normals, wanted, atol=1e-6)


def test_loops_of_nodes_end(tmp_path: Path) -> None:
    positions, normals, order = soft_box()
    nodes = [{"mesh": 0, "children": [1]}, {"mesh": 0, "children": [0]}]
    path = write_glb(tmp_path / "a.glb", [positions, normals, order], meshes=MESH, nodes=nodes, scenes=SCENE)
    try:
        assert len(ldtrefl.load_mesh(path).faces) % 12 == 0
    except ldtrefl.InputError:
        pass


# Archives.


def packed(path: Path, name: str, data: bytes) -> Path:
    if path.suffix == ".zip":
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("readme.txt", "no mesh")
            archive.writestr(name, data)
    elif ".tar" in path.name:
        with tarfile.open(path, "w:gz" if path.suffix == ".gz" else "w:bz2") as archive:
            entry = tarfile.TarInfo(name)
            entry.size = len(data)
            archive.addfile(entry, io.BytesIO(data))
    else:
        path.write_bytes(bz2.compress(data))
    return path


ARCHIVES = ("a.zip", "a.tar.gz", "a.tar.bz2", "a.stl.bz2")


@pytest.mark.parametrize("name", ARCHIVES)
def test_meshes_in_archives(tmp_path: Path, name: str) -> None:
    ball = trimesh.creation.icosphere(2).export(file_type="stl")
    assert len(ldtrefl.load_mesh(packed(tmp_path / name, "a.stl", ball)).faces) == 320


@pytest.mark.parametrize("name", ARCHIVES)
def test_archives_that_unpack_to_too_much_are_refused(tmp_path: Path, name: str) -> None:
    path = packed(tmp_path / name, "a.stl", bytes(80) + (8 << 20).to_bytes(4, "little") + bytes(400 << 20))
    assert path.stat().st_size < 1 << 20
    with pytest.raises(ldtrefl.InputError, match=rf"{name}.*GiB"):
        ldtrefl.load_mesh(path)
    budget.set_memory_limit(64 << 20)
    with pytest.raises(ldtrefl.InputError, match=rf"{name}: what the archive holds needs .* allowed are 64.0 MiB"):
        ldtrefl.load_mesh(path)


def test_an_archive_whose_headers_lie_is_refused(tmp_path: Path) -> None:
    """A zip that declares less than it holds, and a tar file whose member has more zeros than it stores."""
    path = packed(tmp_path / "a.zip", "a.stl", bytes(64 << 20))
    data = bytearray(path.read_bytes())
    for place in range(len(data) - 4):
        if data[place : place + 4] == (64 << 20).to_bytes(4, "little"):
            data[place : place + 4] = (100).to_bytes(4, "little")
    path.write_bytes(data)
    with pytest.raises(ldtrefl.InputError, match=r"a\.zip"):
        ldtrefl.load_mesh(path)
    sparse = tarfile.TarInfo("a.stl")
    sparse.size = 512
    told = {"major": "1", "minor": "0", "name": "a.stl", "realsize": str(1 << 40)}
    sparse.pax_headers = {f"GNU.sparse.{key}": value for key, value in told.items()}
    whole = io.BytesIO()
    with tarfile.open(fileobj=whole, mode="w", format=tarfile.PAX_FORMAT) as archive:
        archive.addfile(sparse, io.BytesIO(b"0\n".ljust(512, b"\0")))
    (tmp_path / "a.tar.gz").write_bytes(gzip.compress(whole.getvalue()))
    with pytest.raises(ldtrefl.InputError, match=r"a\.tar\.gz.*1024\.0 GiB"):
        ldtrefl.load_mesh(tmp_path / "a.tar.gz")


@pytest.mark.parametrize("name", ["a.zip", "a.tar.gz"])
def test_archives_of_other_things(tmp_path: Path, name: str) -> None:
    with pytest.raises(ldtrefl.InputError, match="no mesh file in the archive"):
        ldtrefl.load_mesh(packed(tmp_path / name, "a.txt", b"words"))
    with pytest.raises(ldtrefl.InputError, match=name):
        ldtrefl.load_mesh(packed(tmp_path / name, "a.ply", b"ply\nno"))
    (tmp_path / name).write_bytes(b"not an archive")
    with pytest.raises(ldtrefl.InputError, match=name):
        ldtrefl.load_mesh(tmp_path / name)


def test_a_folder_or_pipe_is_no_mesh(tmp_path: Path) -> None:
    (tmp_path / "a.ply").mkdir()
    with pytest.raises(ldtrefl.InputError, match=r"a\.ply: not a file"):
        ldtrefl.load_mesh(tmp_path / "a.ply")


# Memory.


@pytest.mark.parametrize("kind", ["ply", "obj", "stl", "off", "glb"])
def test_files_take_what_they_need_from_the_budget(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"a.{kind}"
    trimesh.creation.icosphere(5).export(path)
    budget.set_memory_limit(1 << 20)
    with pytest.raises(ldtrefl.InputError, match=rf"a\.{kind}: .* needs .* allowed are 1.0 MiB \(--memory"):
        ldtrefl.load_mesh(path)
    budget.set_memory_limit()
    assert len(ldtrefl.load_mesh(path).faces) == 20480


@pytest.mark.parametrize(
    "claim",
    [
        {"accessors": [{"componentType": 5126, "count": 10**10, "type": "VEC3"}]},
        {"bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 1 << 40}]},
        {
            "nodes": [{"mesh": 0, "translation": [k, 0, 0]} for k in range(20_000)],
            "scenes": [{"nodes": list(range(20_000))}],
        },
    ],
)
def test_a_glb_that_claims_more_than_it_holds_is_refused(tmp_path: Path, claim: dict) -> None:
    """In its accessors, in its views, and by a mesh placed many times."""
    ball = trimesh.creation.icosphere(5)
    positions, order = ball.vertices.astype(np.float32), ball.faces.astype(np.uint32).reshape(-1)
    meshes = [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}]
    tree = {"meshes": meshes, "nodes": [{"mesh": 0}], "scenes": SCENE, **claim}
    with pytest.raises(ldtrefl.InputError, match=r"a\.glb: .* needs .* allowed are 4.0 GiB"):
        ldtrefl.load_mesh(write_glb(tmp_path / "a.glb", [positions, order], **tree))


def test_vertices_that_are_not_finite_are_refused_used_or_not(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n")
    with pytest.raises(ldtrefl.InputError, match=r"a\.obj: vertex 3 is not finite"):
        ldtrefl.load_mesh(tmp_path / "a.obj")
    with pytest.raises(ldtrefl.InputError, match="vertex 3 is not finite"):
        ldtrefl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.inf, 0, 0]], [[0, 1, 2]])
    (tmp_path / "b.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
    with pytest.raises(ldtrefl.InputError, match=r"b\.obj"):
        ldtrefl.load_mesh(tmp_path / "b.obj")


def test_files_beside_a_mesh_are_plain_files(tmp_path: Path) -> None:
    """A pipe, a folder or a device in place of a glTF's buffer is a line, and nobody waits for a writer."""
    trimesh.creation.icosphere(1).export(tmp_path / "ball.gltf")
    buffer = next(path for path in tmp_path.iterdir() if path.suffix == ".bin")
    buffer.unlink()
    os.mkfifo(buffer)
    with pytest.raises(InputError, match=rf"ball\.gltf: .*'{buffer.name}' beside it is not a file"):
        ldtrefl.load_mesh(tmp_path / "ball.gltf")
    buffer.unlink()
    buffer.mkdir()
    with pytest.raises(InputError, match=rf"ball\.gltf: .*'{buffer.name}' beside it is not a file"):
        ldtrefl.load_mesh(tmp_path / "ball.gltf")


def test_what_the_reader_says_is_no_traceback(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """trimesh logs that normals of a text STL cannot be read, with a traceback that Python prints."""
    trimesh.creation.icosphere(0).export(tmp_path / "ball.stl", file_type="stl_ascii")
    text = (tmp_path / "ball.stl").read_text().replace("facet normal ", "facet normal x", 1)
    (tmp_path / "ball.stl").write_text(text)
    with pytest.raises(InputError, match=r"ball\.stl: not a mesh that can be read \(failed to extract face_normals"):
        ldtrefl.load_mesh(tmp_path / "ball.stl")
    assert capfd.readouterr().err == ""
