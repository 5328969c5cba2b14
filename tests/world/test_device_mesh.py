"""A mesh on a device: its own memory on the CPU, and no more than is asked for."""

import numpy as np
import pytest

from ldtrefl import InputError
from ldtrefl.device import launch
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene import shapes
from ldtrefl.world.device_mesh import DeviceMesh

CPU = launch.resolve_device("cpu")
GREY = StoredPicture(np.full((2, 2, 3), 128, np.uint8))


def test_what_only_shading_needs_is_uploaded_when_it_is_asked_for() -> None:
    mesh = shapes.make("plane", {"segments": 3})
    on_device = DeviceMesh(mesh, CPU)
    assert on_device.attribute_bytes == 0
    np.testing.assert_array_equal(on_device.normals.numpy(), mesh.normals)
    assert on_device.attribute_bytes == 16 * 12
    np.testing.assert_array_equal(on_device.uvs.numpy(), mesh.uvs)
    assert on_device.normals is on_device.normals and on_device.attribute_bytes == 16 * (12 + 8)


def test_a_mesh_without_texture_coordinates_has_empty_ones() -> None:
    wires = DeviceMesh(shapes.make("wires", {"count": 1}), CPU)
    assert wires.uvs.shape == wires.no_uvs.shape == wires.no_normals.shape == (0,)
    with pytest.raises(InputError, match=r"material\.texture: the object has no texture coordinates"):
        wires.appearance(GREY)


def test_objects_with_the_same_texture_share_it() -> None:
    plane = DeviceMesh(shapes.make("plane"), CPU)
    alike = StoredPicture(GREY.pixels.copy())
    assert plane.appearance(GREY) is plane.appearance(alike) is not plane.appearance(None)
    assert plane.appearance(None) is plane.appearance(None) and not plane.appearance(None).has_textures
