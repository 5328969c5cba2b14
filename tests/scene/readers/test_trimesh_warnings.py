"""What trimesh logs is a line of ours, or none."""

import logging
from pathlib import Path
from typing import Any

import pytest
from trimesh.exchange.load import mesh_loaders

import ldtrefl


def test_what_the_reader_says_is_no_traceback(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """trimesh logs what it cannot read with a traceback, which Python prints."""

    def reader(**_: Any) -> dict[str, Any]:
        try:
            float("x")
        except ValueError:
            logging.getLogger("trimesh").warning("no normals", exc_info=True)
        return {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]]}

    monkeypatch.setitem(mesh_loaders, "dae", reader)
    (tmp_path / "a.dae").write_text("<COLLADA/>")
    assert len(ldtrefl.load_mesh(tmp_path / "a.dae").faces) == 1
    assert [record.getMessage().rpartition("/")[2] for record in caplog.records if record.name == "ldtrefl"] == [
        "a.dae: not shown: no normals (could not convert string to float: 'x')"
    ]
    assert "Traceback" not in capfd.readouterr().err
