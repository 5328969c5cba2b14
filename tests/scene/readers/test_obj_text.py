"""The text of OBJ files: tables as they stand, and no line that takes more than its length."""

import numpy as np
import pytest

from ldtrefl import InputError
from ldtrefl.scene.readers import obj_text
from ldtrefl.scene.readers.obj_text import NEVER_SAID, read_tables


def test_tables_are_as_the_file_says() -> None:
    text = b"v 1 2 3\nv 4 5 6 7\nvt 0.5\nvt 1 2 3\nvn 0 0 2\nf 1/2/1 2 1//1\ns 3\nusemtl x\nf 1 2 1\ns off\nf 1 1 1\n"
    tables = read_tables(text)
    assert tables.positions.tolist() == [[1, 2, 3], [4, 5, 6]] and tables.colors is None
    assert tables.uvs.tolist() == [[0.5, 0], [1, 2]] and tables.normals.tolist() == [[0, 0, 2]]
    assert tables.corners[:3].tolist() == [[0, 1, 0], [1, -1, -1], [0, -1, 0]] and tables.sizes.tolist() == [3, 3, 3]
    assert tables.lines.tolist() == [6, 9, 11] and tables.smoothing.tolist() == [NEVER_SAID, 3, 0]
    assert tables.materials.tolist() == [0, 1, 1] and tables.material_names == ["", "x"]
    assert all(column.dtype == np.int32 for column in (tables.corners, tables.sizes, tables.materials))


def test_names_in_any_letters() -> None:
    tables = read_tables("usemtl caf\u00e9\nmtllib d\u00e9j\u00e0 vu.mtl\n".encode("latin-1"))
    assert tables.material_names[1] == "caf\u00e9" and tables.libraries == ["d\u00e9j\u00e0 vu.mtl"]
    assert read_tables("usemtl caf\u00e9 # so\n".encode()).material_names[1] == "caf\u00e9"


def test_kinds_of_other_lines_are_named_a_few_times() -> None:
    tables = read_tables(b"".join(b"word%d 1\n" % k for k in range(100)) + b"#MRGB 00\n")
    assert len(tables.not_shown) == obj_text.MOST_NAMED + 1 and "lines that begin with 'word0'" in tables.not_shown


def test_a_line_without_end_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(obj_text, "BLOCK", 100)
    monkeypatch.setattr(obj_text, "LONGEST_LINE", 200)
    assert len(read_tables(b"v 1 2 3\n" * 100).positions) == 100
    for data in (b"f" + b" 1" * 300, b"f 1 \\\n" * 100):
        with pytest.raises(InputError, match="a line has more than"):
            read_tables(data)
