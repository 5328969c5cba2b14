"""OFF files: what vertices and faces have arrives."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl

SQUARE = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"]
HALF = ((0.5 + 0.055) / 1.055) ** 2.4


def loaded(folder: Path, word: str, vertices: list[str], faces: list[str]) -> ldtrefl.Mesh:
    (folder / "a.off").write_text("\n".join([word, f"{len(vertices)} {len(faces)} 0", *vertices, *faces, ""]))
    return ldtrefl.load_mesh(folder / "a.off")


def test_colors_of_vertices(tmp_path: Path) -> None:
    """Whole numbers count to 255 and others to 1; alpha may follow; the word may be missing a C."""
    faces = ["4 0 1 2 3"]
    for word, colors in (
        ("COFF", ("255 0 127.5 51", "0 255 0 255")),
        ("COFF", ("1.0 0 0.5 0.2", "0 1 0 1")),
        ("OFF", ("255 0 127.5 51", "0 255 0 255")),
    ):
        mesh = loaded(tmp_path, word, [f"{point} {colors[k > 0]}" for k, point in enumerate(SQUARE)], faces)
        np.testing.assert_allclose(mesh.colors, [[1, 0, HALF, 0.2], *[[0, 1, 0, 1]] * 3], atol=1e-6)


def test_colors_of_faces_end_at_their_edges(tmp_path: Path) -> None:
    mesh = loaded(tmp_path, "OFF", SQUARE, ["3 0 1 2 255 0 0", "3 0 2 3"])
    np.testing.assert_array_equal(mesh.colors[mesh.faces], [[[1, 0, 0, 1]] * 3, [[1] * 4] * 3])
    np.testing.assert_array_equal(mesh.vertices[mesh.faces][0], [[0, 0, 0], [1, 0, 0], [1, 1, 0]])


def test_normals_and_texture_coordinates(tmp_path: Path) -> None:
    rows = [f"{point} 0 0.6 0.8 255 255 255 255 0.25 {k}" for k, point in enumerate(SQUARE)]
    mesh = loaded(tmp_path, "STCNOFF # a comment", rows, ["4 0 1 2 3"])
    np.testing.assert_allclose(mesh.normals, [[0, 0.6, 0.8]] * 4)
    np.testing.assert_array_equal(mesh.uvs, [[0.25, k] for k in range(4)])
    assert (mesh.colors == 1).all()


def test_counts_may_stand_in_the_first_line_or_alone(tmp_path: Path) -> None:
    body = "\n".join([*SQUARE, "# faces", "", "4 0 1 2 3"])
    for head in ("OFF 4 1 0\n", "4 1\n", "\ufeff# first\n\n  OFF\n 4 1 0\n"):
        (tmp_path / "a.off").write_text(head + body)
        assert len(ldtrefl.load_mesh(tmp_path / "a.off").faces) == 2


@pytest.mark.parametrize(
    ("word", "faces", "says"),
    [
        ("OFF", ["3 0 1 9"], "face 0 has vertex 9, allowed are 0 to 3"),
        ("OFF", ["3 0 1"], "face 0 has fewer corners than it says"),
        ("OFF", ["3 0 x 1"], "should have at least 1 numbers, got '3 0 x 1'"),
        ("4OFF", ["3 0 1 2"], "not a kind of OFF file that can be read"),
        ("OFF BINARY", ["3 0 1 2"], "not a kind of OFF file that can be read"),
        ("OFF", ["2 0 1"], "no triangles"),
    ],
)
def test_what_is_wrong_is_a_line(tmp_path: Path, word: str, faces: list[str], says: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=rf"a\.off: .*{says}"):
        loaded(tmp_path, word, SQUARE, faces)
    (tmp_path / "a.off").write_text("OFF\n9 9 0\n0 0 0\n")
    with pytest.raises(ldtrefl.InputError, match="ends among its 9 vertices and 9 faces"):
        ldtrefl.load_mesh(tmp_path / "a.off")


def test_numbers_of_a_color_map_are_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    loaded(tmp_path, "OFF", SQUARE, ["3 0 1 2 7"])
    assert "not shown: numbers of colours in a colour map" in caplog.text
