"""Records: kernels read what the host has written, in arrays too."""

import re
from pathlib import Path

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.world import records
from ldtrefl.world.records import ObjectRecord


@launch.kernel
def read_records(first: int, objects: wp.array(dtype=ObjectRecord), out: wp.array(dtype=float)):
    """Add up some fields of one record."""
    i = first + wp.tid()
    last = objects[i].vertices[objects[i].smooth]
    out[i] = objects[i].radius + last[2] + float(objects[i].unit_from_device[1, 3])


def test_kernels_read_what_was_written() -> None:
    cpu = launch.resolve_device("cpu")
    objects = []
    for k in range(3):
        record = ObjectRecord()
        record.vertices = wp.array(np.full((4, 3), 10.0 * k, np.float32), dtype=wp.vec3, device=cpu)
        record.smooth, record.radius = k, float(k)
        matrix = np.eye(4)
        matrix[1, 3] = 100.0 * k
        record.unit_from_device = wp.mat44d(matrix)
        objects.append(record)
    found = wp.zeros(3, dtype=float, device=cpu)
    launch.launch(read_records, 3, [wp.array(objects, dtype=ObjectRecord, device=cpu), found], cpu)
    np.testing.assert_array_equal(found.numpy(), [0.0, 111.0, 222.0])


def test_every_field_whose_name_does_not_say_all_has_a_comment() -> None:
    plain = {"faces", "albedo", "unit_from_device", "device_from_unit", "lights"}
    fields = re.findall(r"^    (\w+): .*?(#.*)?$", Path(records.__file__).read_text(), re.M)
    assert {name for name, comment in fields if not comment} == plain
