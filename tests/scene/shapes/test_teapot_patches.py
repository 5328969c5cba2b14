"""The teapot's control points: every one is used, and by patches of sixteen."""

from ldtrefl.scene.shapes.teapot_patches import FOURFOLD, POINTS, TWOFOLD


def test_every_point_has_a_patch() -> None:
    patches = [*FOURFOLD, *TWOFOLD]
    assert all(len(patch) == 16 for patch in patches)
    assert {point for patch in patches for point in patch} == set(range(len(POINTS)))
