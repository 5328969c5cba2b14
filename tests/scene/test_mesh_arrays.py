"""What a mesh makes of the arrays that it is given: plain numpy's bits, the first fault, and what it shares."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.scene.mesh import MOST_VERTICES
from ldtrefl.scene.mesh_arrays import RUN, RUNS
from ldtrefl.world.device_mesh import DeviceMesh

BLOCK = int(RUN * RUNS)
SIZES = (1, 2, int(RUN), BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK + 5)


def some_mesh(vertices: int, triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, the last of which is in use and the farthest along x, and triangles, the last of which has it."""
    rng = np.random.default_rng(vertices + triangles)
    places = rng.normal((0.0, 1e3, 0.0), size=(vertices, 3))
    places[:, 2] = np.where(rng.random(vertices) < 0.5, 0.0, -0.0)  # the sign is kept, too
    places[-1, 0] = 9.0
    faces = rng.integers(0, vertices, (triangles, 3))
    faces[-1, 2] = vertices - 1
    return places, faces


def laid_out(array: np.ndarray, layout: str) -> np.ndarray:
    """The same values in memory of another layout."""
    if layout == "strided":
        return np.repeat(array, 2, axis=1)[:, ::2]
    if layout == "reversed":
        return array[::-1, ::-1].copy()[::-1, ::-1]
    return np.array(array, order="F" if layout == "F" else "C")


@pytest.mark.parametrize("layout", ["C", "F", "strided", "reversed"])
@pytest.mark.parametrize("index", [np.int32, np.int64, np.uint8, np.uint64, np.dtype(">i4"), np.float64])
@pytest.mark.parametrize("coordinate", [np.float64, np.float32, np.float16, np.dtype(">f8"), np.longdouble])
def test_every_type_and_layout_gives_the_bits_of_numpy(coordinate: type, index: type, layout: str) -> None:
    vertices, faces = some_mesh(200, 500)
    given = laid_out(vertices.astype(coordinate), layout)
    mesh = ldtrefl.Mesh(given, laid_out(faces.astype(index), layout))
    exact = given.astype(np.float64)
    used = exact[np.unique(faces)]
    low, high = used.min(axis=0), used.max(axis=0)
    half = (high - low).max() / 2.0
    unit = ((exact - (low + (high - low) / 2.0)) / half).astype(np.float32)
    for name, found, expected in (
        ("vertices", mesh.vertices, exact),
        ("faces", mesh.faces, faces.astype(np.int32)),
        ("bounds", mesh.bounds, np.stack([low, high])),
        ("is_used", mesh.is_used, np.isin(np.arange(200), faces)),
        ("unit_vertices", mesh.unit_vertices, unit),
    ):
        assert (found.dtype, found.shape) == (expected.dtype, expected.shape), name
        assert found.tobytes() == expected.tobytes(), name
        assert found.flags.c_contiguous and not found.flags.writeable, name


@pytest.mark.parametrize("size", SIZES)
def test_the_last_of_many_counts(size: int) -> None:
    vertices, faces = some_mesh(size, size)
    for threads in (1, 3):
        launch.set_threads(threads)
        mesh = ldtrefl.Mesh(vertices, faces)
        used = vertices[np.unique(faces)]
        assert mesh.bounds[1, 0] == 9.0
        assert mesh.bounds.tobytes() == np.stack([used.min(axis=0), used.max(axis=0)]).tobytes()
        assert np.array_equal(mesh.faces, faces) and np.array_equal(mesh.vertices, vertices)
        assert mesh.is_used.sum() == len(used)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("is_shared", [False, True])
def test_a_fault_in_the_last_place_is_found(size: int, is_shared: bool) -> None:
    vertices, faces = some_mesh(size, size)
    for axis in range(3):
        for value in (np.nan, np.inf, -np.inf, -1e101):
            spoilt = vertices.copy()
            spoilt[-1, axis] = value
            spoilt.flags.writeable = not is_shared
            with pytest.raises(ldtrefl.InputError, match=rf"^vertex {size - 1} is not finite or too large: \["):
                ldtrefl.Mesh(spoilt, faces)
        for value in (-1, size, 2**31 - 1, -(2**31)):
            spoilt = faces.astype(np.int32)
            spoilt[-1, axis] = value
            spoilt.flags.writeable = not is_shared
            message = rf"^triangle {size - 1} has vertices \[.*{value}.*\], allowed are 0 to {size - 1}$"
            with pytest.raises(ldtrefl.InputError, match=message):
                ldtrefl.Mesh(vertices, spoilt)


@pytest.mark.parametrize("index", [2**31, 2**32, 2**32 + 1, -(2**32), 2**62, -(2**62)])
def test_no_index_is_wrapped_into_range(index: int) -> None:
    faces = np.array([[0, 1, 2], [0, index, 2]])
    with pytest.raises(ldtrefl.InputError, match=rf"^triangle 1 has vertices \[0, {index}, 2\], allowed are 0 to 2$"):
        ldtrefl.Mesh(np.eye(3), faces)


def test_of_several_faults_the_first_is_told_and_an_index_before_a_place() -> None:
    vertices, faces = some_mesh(3 * BLOCK, 3 * BLOCK)
    # In several runs of a block, which are gone through abreast, and in several blocks.
    wrong = [2 * BLOCK + 7, BLOCK + 3 * int(RUN), BLOCK + int(RUN) + 5, BLOCK + int(RUN) + 9]
    vertices[wrong, 1] = np.nan
    with pytest.raises(ldtrefl.InputError, match=rf"^vertex {min(wrong)} is not finite"):
        ldtrefl.Mesh(vertices, faces)
    faces[wrong, 1] = -1
    with pytest.raises(ldtrefl.InputError, match=rf"^triangle {min(wrong)} has vertices"):
        ldtrefl.Mesh(vertices, faces)


def test_unused_vertices_are_in_no_box_and_must_be_finite() -> None:
    vertices, faces = some_mesh(3 * BLOCK, 100)
    mesh = ldtrefl.Mesh(np.vstack([[[-50.0, 0.0, 0.0]], vertices, [[0.0, 1e9, 0.0]]]), faces + 1)
    assert np.array_equal(mesh.bounds, ldtrefl.Mesh(vertices, faces).bounds)
    assert not mesh.is_used[0] and not mesh.is_used[-1] and mesh.is_used[len(vertices)]
    with pytest.raises(ldtrefl.InputError, match=rf"^vertex {len(vertices)} is not finite or too large: \[nan, 0.0, 0"):
        ldtrefl.Mesh(np.vstack([vertices, [[np.nan, 0.0, 0.0]]]), faces)


def test_more_vertices_than_can_be_numbered_are_refused() -> None:
    many = np.broadcast_to(np.zeros((1, 3)), (MOST_VERTICES + 1, 3))
    with pytest.raises(ldtrefl.InputError, match=r"^the mesh has 2147483648 vertices, at most 2147483647 allowed$"):
        ldtrefl.Mesh(many, [[0, 1, 2]])


def test_a_mesh_does_not_change_with_what_it_was_made_of() -> None:
    for is_view in (False, True):
        vertices, faces = some_mesh(20, 30)
        given = [vertices, faces.astype(np.int32), np.ones((20, 3), np.float32), np.zeros((20, 2), np.float32)]
        # A view that cannot be written itself, of an array that can.
        mesh = ldtrefl.Mesh(*(np.broadcast_to(array, array.shape) if is_view else array for array in given))
        held = [mesh.vertices, mesh.faces, mesh.normals, mesh.uvs]
        before = [array.copy() for array in held]
        for array in given:
            array[...] = array[::-1] + 1
        for array, same in zip(held, before, strict=True):
            assert np.array_equal(array, same) and not array.flags.writeable


def test_what_nobody_can_change_is_shared() -> None:
    vertices, faces = some_mesh(20, 30)
    mesh = ldtrefl.Mesh(vertices, faces, np.ones((20, 3)), np.zeros((20, 2)))
    again = ldtrefl.Mesh(mesh.vertices, mesh.faces, mesh.normals, mesh.uvs)
    for name in ("vertices", "faces", "normals", "uvs"):
        assert np.shares_memory(getattr(mesh, name), getattr(again, name)), name
    for copied in (np.asfortranarray(mesh.vertices), mesh.vertices.astype(np.float32), mesh.vertices[::-1]):
        copied.flags.writeable = False
        other = ldtrefl.Mesh(copied, mesh.faces).vertices
        assert not np.shares_memory(copied, other) and np.array_equal(copied, other) and other.flags.c_contiguous


def test_memory_that_is_not_numpys_is_copied(tmp_path: Path) -> None:
    vertices, faces = some_mesh(20, 30)
    np.save(tmp_path / "vertices.npy", vertices)
    np.save(tmp_path / "faces.npy", faces.astype(np.int32))
    mapped = [np.load(tmp_path / f"{name}.npy", mmap_mode="r") for name in ("vertices", "faces")]
    mesh = ldtrefl.Mesh(*mapped)
    assert not np.shares_memory(mesh.vertices, mapped[0]) and not np.shares_memory(mesh.faces, mapped[1])
    assert np.array_equal(mesh.vertices, vertices) and np.array_equal(mesh.faces, faces)


def test_on_the_cpu_kernels_read_the_mesh_where_it_lies() -> None:
    vertices, faces = some_mesh(20, 30)
    mesh = ldtrefl.Mesh(vertices, faces)
    on_device = DeviceMesh(mesh, launch.resolve_device("cpu"))
    assert np.shares_memory(on_device.faces.numpy(), mesh.faces)
    assert np.shares_memory(on_device.vertices.numpy(), mesh.unit_vertices)
    assert np.shares_memory(on_device.normals.numpy(), mesh.normals)
