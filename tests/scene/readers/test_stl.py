"""STL files: the facets arrive, whatever stands around them, and colours that are not shown are named."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

import ldtrefl

FACETS = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 1, 0.5]]], float)


def text_of(facets: np.ndarray, name: str = "a part") -> str:
    rows = [f"solid {name}"]
    for corners in facets.tolist():
        points = [f"   vertex {x} {y} {z:e}" for x, y, z in corners]
        rows += ["facet normal 0 0 -1", "  outer loop", *points, "  endloop", "endfacet"]
    return "\n".join([*rows, f"endsolid {name}", ""])


def binary_of(facets: np.ndarray, *, header: bytes = b"", count: int | None = None, color: int = 0) -> bytes:
    rows = np.zeros(len(facets), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("color", "<u2")])
    rows["corners"], rows["color"] = facets, color
    return header.ljust(80) + (len(facets) if count is None else count).to_bytes(4, "little") + rows.tobytes()


def loaded(folder: Path, data: bytes | str) -> ldtrefl.Mesh:
    (folder / "a.stl").write_bytes(data if isinstance(data, bytes) else data.encode())
    return ldtrefl.load_mesh(folder / "a.stl")


TEXTS = {
    "plain": text_of(FACETS),
    "two solids": text_of(FACETS[:1]) + text_of(FACETS[1:], "another"),
    "CRLF": text_of(FACETS).replace("\n", "\r\n"),
    "old Mac": text_of(FACETS).replace("\n", "\r"),
    "capitals": text_of(FACETS).upper(),
    "tabs": text_of(FACETS).replace(" ", "\t"),
    "byte order mark": "\ufeff" + text_of(FACETS),
    "empty lines": "\n\n" + text_of(FACETS).replace("\n", "\n\n"),
    "Latin-1": text_of(FACETS, "caf\xe9").encode("latin-1"),
    "no name, no end": text_of(FACETS, "").replace("endsolid", ""),
}

BINARIES = {
    "plain": binary_of(FACETS),
    "begins as a text": binary_of(FACETS, header=b"solid a\nfacet normal 0 0 0\n"),
    "bytes behind it": binary_of(FACETS) + bytes(10),
}


@pytest.mark.parametrize(
    "data", [*TEXTS.values(), *BINARIES.values()], ids=[*TEXTS, *(f"binary, {k}" for k in BINARIES)]
)
def test_facets_arrive(tmp_path: Path, data: bytes | str) -> None:
    """In the order of the file, and flat, whatever normals it stores: those of 0 stand for the facet's."""
    mesh = loaded(tmp_path, data)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], FACETS)
    assert not mesh.normals.any()


@pytest.mark.parametrize("kind", ["stl", "stl_ascii"])
def test_what_another_program_writes(tmp_path: Path, kind: str) -> None:
    box = trimesh.creation.box()
    mesh = loaded(tmp_path, np.bytes_(box.export(file_type=kind)).tobytes())
    np.testing.assert_allclose(mesh.vertices[mesh.faces], box.triangles, atol=1e-6)


def test_what_is_not_shown_is_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Colours, as Magics and as VisCAM say that there are some, and what follows the facets."""
    loaded(tmp_path, binary_of(FACETS, color=31))
    assert not caplog.records
    loaded(tmp_path, binary_of(FACETS, header=b"COLOR=\1\2\3\4"))
    loaded(tmp_path, binary_of(FACETS, color=0x8000 + 31))
    loaded(tmp_path, BINARIES["bytes behind it"])
    loaded(tmp_path, text_of(FACETS).replace("  endloop", "  endloop\n  color 1 0 0"))
    assert [record.getMessage().rpartition("/")[2] for record in caplog.records] == [
        *["a.stl: not shown: colours of facets"] * 2,
        "a.stl: not shown: 10 bytes behind its 2 facets",
        "a.stl: not shown: lines that are not of a facet",
    ]


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "not an STL file: it should begin with 'solid'"),
        (text_of(FACETS).replace("vertex 1", "vertex x", 1), "line 5: should have at least 3 numbers, got 'vertex x.0"),
        (text_of(FACETS).replace("vertex 1.0", "vertex 1.0 1.0", 1), "line 5: a vertex has three numbers"),
        (text_of(FACETS)[:-120], "line 10: a facet should have three vertices in its 'outer loop'"),
        (text_of(FACETS[:0]), "the mesh has no triangles: it holds no facet"),
        (binary_of(FACETS, count=3), "the file ends among its 3 facets, it holds 2"),
        (binary_of(FACETS, count=0), "its header announces no facet, and 100 bytes follow"),
        (binary_of(FACETS[:0]), "the mesh has no triangles"),
    ],
)
def test_what_is_damaged_is_refused_in_a_line(tmp_path: Path, data: bytes | str, says: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=rf"a\.stl: .*{says}"):
        loaded(tmp_path, data)
