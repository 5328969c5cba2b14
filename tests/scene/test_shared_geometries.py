"""Objects that name the same have one mesh, which is counted once."""

import ldtrefl
from ldtrefl import Object
from ldtrefl.base import budget
from ldtrefl.scene import shapes
from ldtrefl.scene.shared_geometries import SharedGeometries


def given(*objects: Object) -> list[ldtrefl.Mesh]:
    """The mesh that each has when all have theirs."""
    shared = SharedGeometries()
    for entry in objects:
        shared.give(entry)
    return [entry.geometry for entry in objects]


def test_equal_shapes_are_counted_once() -> None:
    """The order of parameters says nothing."""
    one, other = {"minor": 0.2, "segments": [24, 16]}, {"segments": [24, 16], "minor": 0.2}
    taken = []
    for count in (1, 4):
        with budget.account() as account:
            meshes = given(*[Object(shape="torus", params=(one, other)[k % 2]) for k in range(count)])
        assert len(set(meshes)) == 1
        taken.append(account.taken)
    assert taken[0] == taken[1] > 0


def test_what_differs_has_its_own() -> None:
    fine, coarse = ({"segments": [segments, 16]} for segments in (32, 24))
    meshes = given(*[Object(shape="torus", params=params) for params in (fine, coarse)], Object(shape="box"))
    assert len(set(meshes)) == 3 and meshes[2] is shapes.make("box")


def test_a_mesh_that_an_object_has_stays() -> None:
    """Whatever the shape of its name has become since."""
    own, shape = Object(shape="box"), shapes.make("torus")
    own.share_geometry(shape)
    assert given(own, Object(shape="box")) == [shape, shapes.make("box")]


def test_meshes_in_memory_are_no_others() -> None:
    one, other = (ldtrefl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]) for _ in range(2))
    assert given(*[Object(mesh=mesh) for mesh in (one, other, one)]) == [one, other, one]
