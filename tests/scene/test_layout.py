"""Where all objects of a scene stand."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.scene.layout import Layout

CAMERA = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)


def layout_of(*objects: Object) -> Layout:
    return Scene(camera=CAMERA, objects=objects).layout


def test_objects_are_placed_together_as_each_alone() -> None:
    objects = [
        Object(shape=shape, fit=fit, scale=scale, rotate=(1.0, -2.0, 0.5, degrees), translate=(1.0, k, -3.0))
        for k, (shape, fit, scale, degrees) in enumerate(
            [("box", None, 1.0, 0.0), ("torus", 3.0, (1.0, 2.0, 0.5), 33.0), ("box", 0.1, 2.0, -90.0)]
        )
    ]
    layout = layout_of(*objects)
    assert layout.meshes == (shapes.make("box"), shapes.make("torus")) and layout.mesh_of.tolist() == [0, 1, 0]
    for entry, matrix in zip(objects, layout.world_from_object, strict=True):
        np.testing.assert_array_equal(matrix, entry.world_from_object())


def test_a_size_that_is_not_allowed_is_named_by_its_object() -> None:
    wrong = Object(shape="box", fit=1e-9, scale=1e-9)
    with pytest.raises(ldtrefl.InputError, match=r"^object\[1\]: fit 1e-09, scale 1e-09 and the mesh"):
        layout_of(Object(shape="torus"), wrong, wrong)


def test_the_box_of_a_turned_object_is_that_of_its_corners() -> None:
    low, high = layout_of(Object(shape="plane", rotate=(0, 0, 1, 45.0), translate=(1.0, 0.0, 2.0))).box
    side = np.sqrt(2.0)
    np.testing.assert_allclose([low, high], [[1.0 - side, -side, 2.0], [1.0 + side, side, 2.0]], atol=1e-15)


def test_the_box_of_all_holds_each() -> None:
    objects = [Object(shape="box", scale=0.5, translate=(x, 0.0, 0.0)) for x in (-2.0, 0.0, 7.0)]
    np.testing.assert_array_equal(layout_of(*objects).box, [[-2.5, -0.5, -0.5], [7.5, 0.5, 0.5]])
    np.testing.assert_array_equal(layout_of().box, [[-1.0] * 3, [1.0] * 3])


@pytest.mark.parametrize("shape", ["box", "torus"])
def test_one_object_changed_is_laid_out_as_if_all_were(shape: str) -> None:
    objects = [Object(name=name, shape="box", translate=(x, 0.0, 0.0)) for x, name in enumerate("abc")]
    scene = Scene(camera=CAMERA, objects=tuple(objects))
    changed = scene.with_object("b", shape=shape, translate=(0.0, 5.0, 0.0))
    layout, anew = changed.layout, layout_of(*changed.objects)
    np.testing.assert_array_equal(layout.world_from_object, anew.world_from_object)
    assert [layout.meshes[k] for k in layout.mesh_of] == [anew.meshes[k] for k in anew.mesh_of]
    assert scene.layout.world_from_object[1, 0, 3] == 1.0
