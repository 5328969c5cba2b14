"""Which objects hide backs: what files and scenes say, and where it could be seen."""

from dataclasses import replace

import numpy as np
import pytest

from ldtrefl.scene import shapes
from ldtrefl.scene.material import Material
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.surface_material import PLAIN, SurfaceMaterial
from ldtrefl.world.hidden_backs import hides_backs, is_double_sided
from tests.square import square

SINGLE = SurfaceMaterial(name="single", double_sided=False)


@pytest.mark.parametrize(
    ("material", "own", "expected"),
    [
        (SINGLE, Material(), False),
        (PLAIN, Material(), True),
        (SINGLE, Material(albedo=0.5, roughness=0.1, metallic=1.0, emission=1.0), False),
        (SINGLE, Material(mirror=(0.0, 0.1, 0.0)), True),
        (SINGLE, Material(double_sided=True), True),
        (SINGLE, Material(mirror=0.5, double_sided=False), False),
        (PLAIN, Material(double_sided=False), False),
    ],
)
def test_the_scene_is_asked_first_and_a_mirror_takes_the_material_s_place(
    material: SurfaceMaterial, own: Material, expected: bool
) -> None:
    assert is_double_sided(material, own) == expected
    assert hides_backs(square(material), [own]) == (not expected)


def test_solids_hide_nothing_unless_alpha_lets_one_look_inside() -> None:
    box = shapes.make("box")
    for material, faces, expected in (
        (SINGLE, box.faces, False),
        (SINGLE, box.faces[:, ::-1], True),
        (SINGLE, box.faces[1:], True),
        (PLAIN, box.faces[1:], False),
        (replace(SINGLE, alpha_mode="mask"), box.faces, True),
    ):
        mesh = Mesh(box.vertices, np.ascontiguousarray(faces), parts=(Part(0, material),))
        assert hides_backs(mesh, [Material()]) == expected


def test_one_part_is_enough() -> None:
    corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    mesh = Mesh(corners, [[0, 1, 2], [0, 2, 3]], parts=(Part(0, PLAIN), Part(1, SINGLE)))
    assert hides_backs(mesh, [Material(), Material()]) and not hides_backs(mesh, [Material(), Material(mirror=1.0)])
