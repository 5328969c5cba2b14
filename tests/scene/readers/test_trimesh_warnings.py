"""What trimesh logs is a line of ours, or none."""

from pathlib import Path

import pytest
import trimesh

import ldtrefl
from ldtrefl import InputError


def test_what_the_reader_says_is_no_traceback(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """trimesh logs that normals of a text STL cannot be read, with a traceback that Python prints."""
    trimesh.creation.icosphere(0).export(tmp_path / "ball.stl", file_type="stl_ascii")
    text = (tmp_path / "ball.stl").read_text().replace("facet normal ", "facet normal x", 1)
    (tmp_path / "ball.stl").write_text(text)
    with pytest.raises(InputError, match=r"ball\.stl: not a mesh that can be read \(failed to extract face_normals"):
        ldtrefl.load_mesh(tmp_path / "ball.stl")
    assert capfd.readouterr().err == ""
