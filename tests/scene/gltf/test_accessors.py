"""Accessors: all component types and shapes, strides, normalised integers, matrices, sparse ones, and unsound ones."""

import numpy as np
import pytest

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.accessors import elements, values
from ldtrefl.scene.gltf.container import Document
from tests.scene.gltf.writer import COMPONENTS, Written, nothing_beside


def opened(file: Written) -> Document:
    """The file as a document."""
    return Document(file.as_glb(), nothing_beside)


@pytest.mark.parametrize("letter", COMPONENTS)
@pytest.mark.parametrize("width", [1, 2, 3, 4])
def test_every_type_is_read_as_it_is_stored(letter: str, width: int) -> None:
    stored = np.random.default_rng(0).integers(-100, 100, (5, width)).astype(letter)
    stored = stored[:, 0] if width == 1 else stored
    file = Written()
    number = file.accessor(stored)
    np.testing.assert_array_equal(elements(opened(file), number, "here"), stored)


@pytest.mark.parametrize(("letter", "stored", "expected"), [
    ("B", [0, 51, 255], [0.0, 0.2, 1.0]),
    ("b", [-128, -127, 127], [-1.0, -1.0, 1.0]),
    ("H", [0, 13107, 65535], [0.0, 0.2, 1.0]),
    ("h", [-32768, -32767, 32767], [-1.0, -1.0, 1.0]),
])  # fmt: skip
def test_normalised_integers_are_fractions(letter: str, stored: list[int], expected: list[float]) -> None:
    file = Written()
    array = np.array(stored).astype(letter)
    fractions, whole = file.accessor(array, normalized=True), file.accessor(array)
    np.testing.assert_allclose(values(opened(file), fractions, "here"), expected, rtol=1e-15)
    np.testing.assert_array_equal(values(opened(file), whole, "here"), array)


def test_elements_may_be_interleaved() -> None:
    rows = np.arange(28, dtype=np.float32).reshape(4, 7)
    file = Written()
    view = file.view(rows.tobytes(), byteStride=28)
    for offset, width in ((0, 3), (12, 2), (20, 2)):
        file.tree["accessors"].append(
            {"bufferView": view, "byteOffset": offset, "componentType": 5126, "count": 4, "type": f"VEC{width}"}
        )
    first = 0
    for number, width in enumerate((3, 2, 2)):
        np.testing.assert_array_equal(elements(opened(file), number, "here"), rows[:, first : first + width])
        first += width


def test_matrices_are_stored_by_columns_that_begin_at_words() -> None:
    matrices = np.arange(18).reshape(2, 3, 3)
    file = Written()
    floats = file.accessor(matrices.transpose(0, 2, 1).reshape(2, 9).astype(np.float32), kind="MAT3")
    padded = np.zeros((2, 3, 4), np.int8)
    padded[:, :, :3] = matrices.transpose(0, 2, 1)
    file.tree["accessors"].append(
        {"bufferView": file.view(padded.tobytes()), "componentType": 5120, "count": 2, "type": "MAT3"}
    )
    for number in (floats, floats + 1):
        np.testing.assert_array_equal(elements(opened(file), number, "here"), matrices.reshape(2, 9))


@pytest.mark.parametrize("has_base", [True, False])
def test_sparse_accessors_replace_some_elements(has_base: bool) -> None:
    base, new = np.arange(15, dtype=np.float32).reshape(5, 3), -np.ones((2, 3), np.float32)
    file = Written()
    sparse = {
        "count": 2,
        "indices": {"bufferView": file.view(np.array([1, 4], np.uint16).tobytes()), "componentType": 5123},
        "values": {"bufferView": file.view(new.tobytes())},
    }
    entry = {"componentType": 5126, "count": 5, "type": "VEC3", "sparse": sparse}
    file.tree["accessors"].append({**entry, "bufferView": file.view(base.tobytes())} if has_base else entry)
    expected = base.copy() if has_base else np.zeros((5, 3), np.float32)
    expected[[1, 4]] = -1.0
    np.testing.assert_array_equal(elements(opened(file), 0, "here"), expected)


@pytest.mark.parametrize("indices", [[1, 5], [2, 1], [1, 1]])
def test_indices_of_sparse_accessors_must_rise_and_exist(indices: list[int]) -> None:
    file = Written()
    sparse = {
        "count": 2,
        "indices": {"bufferView": file.view(np.array(indices, np.uint8).tobytes()), "componentType": 5121},
        "values": {"bufferView": file.view(bytes(8))},
    }
    file.tree["accessors"].append({"componentType": 5126, "count": 5, "type": "SCALAR", "sparse": sparse})
    with pytest.raises(InputError, match=r"accessors\[0\]\.sparse\.indices"):
        elements(opened(file), 0, "here")


@pytest.mark.parametrize(("change", "match"), [
    ({"componentType": 5124}, "componentType: allowed are"),
    ({"componentType": None}, "componentType: allowed are"),
    ({"type": "VEC5"}, "type: allowed are"),
    ({"count": -1}, "count: should be a whole number"),
    ({"count": 1.5}, "count: should be a whole number"),
    ({"count": 5}, "ends at byte 60 of a buffer view of 48"),
    ({"byteOffset": 4}, "ends at byte 52 of a buffer view of 48"),
    ({"bufferView": 7}, "no bufferViews"),
    ({"count": 1 << 40}, "at most"),
])  # fmt: skip
def test_what_is_unsound_is_refused(change: dict[str, object], match: str) -> None:
    file = Written()
    number = file.accessor(np.zeros((4, 3), np.float32))
    file.tree["accessors"][number].update(change)
    with pytest.raises(InputError, match=match):
        elements(opened(file), number, "here")


def test_memory_for_elements_without_bytes_is_asked_for() -> None:
    file = Written()
    file.tree["accessors"].append({"componentType": 5126, "count": (1 << 31) - 1, "type": "MAT4"})
    with budget.account(), pytest.raises(InputError, match="needs"):
        elements(opened(file), 0, "here")
