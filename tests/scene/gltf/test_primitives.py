"""Primitives: lists, strips and fans with and without indices, attributes as stored, morph targets at rest."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.container import Document
from ldtrefl.scene.gltf.primitives import FAN, STRIP, modes_without_surface, primitives_of
from tests.scene.gltf.writer import QUAD, QUAD_FACES, Written, nothing_beside

LINES = 1


def first_of(file: Written, weights: tuple[float, ...] | None = None):  # type: ignore[no-untyped-def]
    """The first primitive of the file's first mesh."""
    return primitives_of(Document(file.as_glb(), nothing_beside), 0, weights)[0]


def test_strips_turn_every_second_triangle() -> None:
    file = Written()
    zigzag = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0]], np.float32)
    file.mesh({"POSITION": file.accessor(zigzag)}, mode=STRIP)
    assert first_of(file).faces.tolist() == [[0, 1, 2], [1, 3, 2], [2, 3, 4]]
    a, b, c = zigzag[first_of(file).faces].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_fans_turn_about_their_first_vertex() -> None:
    file = Written()
    file.mesh({"POSITION": file.accessor(QUAD)}, mode=FAN, indices=file.accessor(np.array([0, 1, 2, 3], np.uint8)))
    faces = first_of(file).faces
    assert [sorted(face) for face in faces.tolist()] == [[0, 1, 2], [0, 2, 3]]
    a, b, c = QUAD[faces].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_triangles_need_no_indices() -> None:
    file = Written()
    file.mesh({"POSITION": file.accessor(QUAD[QUAD_FACES])})
    assert first_of(file).faces.tolist() == [[0, 1, 2], [3, 4, 5]]


@pytest.mark.parametrize("letter", "BHI")
def test_indices_of_every_size(letter: str) -> None:
    file = Written()
    file.mesh({"POSITION": file.accessor(QUAD)}, indices=file.accessor(QUAD_FACES.astype(letter)))
    assert first_of(file).faces.reshape(-1).tolist() == QUAD_FACES.tolist()


def test_quantised_attributes_are_what_their_integers_mean() -> None:
    """KHR_mesh_quantization: positions are whole numbers, or fractions if they are normalised."""
    file = Written()
    whole = np.array([[0, 0, 0], [100, 0, 0], [0, -200, 0]], np.int16)
    padded = np.zeros((3, 4), np.int16)
    padded[:, :3] = whole
    view = file.view(padded.tobytes(), byteStride=8)
    for normalized in (False, True):
        file.tree["accessors"].append(
            {"bufferView": view, "componentType": 5122, "count": 3, "type": "VEC3", "normalized": normalized}
        )
    uv = file.accessor(np.array([[0, 0], [65535, 0], [0, 13107]], np.uint16), normalized=True)
    file.mesh({"POSITION": 0, "TEXCOORD_0": uv})
    file.mesh({"POSITION": 1})
    document = Document(file.as_glb(), nothing_beside)
    plain, normalised = (primitives_of(document, number, None)[0] for number in (0, 1))
    np.testing.assert_array_equal(plain.vertices, whole)
    np.testing.assert_allclose(normalised.vertices, whole / 32767.0, rtol=1e-15)
    np.testing.assert_allclose(plain.uvs[0], [[0, 0], [1, 0], [0, 0.2]], rtol=1e-15)


@pytest.mark.parametrize("letter", ["f", "B", "H"])
@pytest.mark.parametrize("width", [3, 4])
def test_vertex_colours_are_linear_fractions(letter: str, width: int) -> None:
    largest = 1.0 if letter == "f" else np.iinfo(letter).max
    fractions = np.array([[0, 0.2, 1, 0.4], [1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 0]])
    file = Written()
    file.quad(attributes={"COLOR_0": file.accessor((fractions[:, :width] * largest).astype(letter))})
    expected = np.where(np.arange(4) < width, fractions, 1.0)
    np.testing.assert_allclose(first_of(file).colors, expected, atol=1e-7)


def test_morph_targets_are_added_by_their_weights() -> None:
    file = Written()
    up, right = np.zeros((4, 3), np.float32), np.zeros((4, 3), np.float32)
    up[:, 2], right[1, 0] = 1.0, 4.0
    targets = [{"POSITION": file.accessor(up)}, {"POSITION": file.accessor(right)}]
    file.quad(targets=targets)
    file.tree["meshes"][0]["weights"] = [0.5, 0.25]
    np.testing.assert_allclose(first_of(file).vertices, QUAD + 0.5 * up + 0.25 * right)
    np.testing.assert_allclose(first_of(file, (0.0, 1.0)).vertices, QUAD + right)


def test_what_has_no_surface_is_left_out_and_named() -> None:
    file = Written()
    file.mesh({"POSITION": file.accessor(QUAD)}, mode=LINES)
    document = Document(file.as_glb(), nothing_beside)
    assert primitives_of(document, 0, None) == [] and modes_without_surface(document) == {"lines"}


@pytest.mark.parametrize(("change", "match"), [
    ({"mode": 9}, "mode: allowed are 0 to 6"),
    ({"mode": [4]}, "mode: allowed are 0 to 6"),
    ({"material": 3}, r"there is no materials\[3\]"),
    ({"indices": 9}, r"there is no accessors\[9\]"),
    ({"attributes": {"POSITION": 0, "NORMAL": 1}}, "NORMAL: should have 3 components"),
    ({"attributes": {"POSITION": 0, "NORMAL": 2}}, "NORMAL: 2 for 4 positions"),
    ({"attributes": {"POSITION": 0, "TEXCOORD_0": 0}}, "TEXCOORD_0: should have 2 components"),
    ({"indices": 3}, "there is no vertex 4"),
])  # fmt: skip
def test_what_is_unsound_is_refused(change: dict[str, object], match: str) -> None:
    file = Written()
    numbers = [file.accessor(QUAD), file.accessor(QUAD_FACES), file.accessor(QUAD[:2])]
    file.accessor(np.array([0, 1, 4], np.uint8))
    file.mesh({"POSITION": numbers[0]}, indices=numbers[1])
    file.tree["meshes"][0]["primitives"][0].update(change)
    with pytest.raises(InputError, match=match):
        first_of(file)


def test_stored_normals_are_the_mesh_s(tmp_path: Path) -> None:
    slanted = np.tile(np.array([0.6, 0.0, 0.8], np.float32), (4, 1))
    file = Written()
    file.quad(attributes={"NORMAL": file.accessor(slanted)})
    np.testing.assert_array_equal(ldtrefl.load_mesh(file.save(tmp_path)).normals, slanted)
