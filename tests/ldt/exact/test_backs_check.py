"""A closed mesh of which a part is wound the other way shows backs, and is not searched as if it showed none."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.ldt.exact.backs_check import shows_backs
from ldtrefl.scene import shapes

DENSE = {"segments": [400, 200]}


@pytest.mark.parametrize("is_turned", [False, True])
def test_a_part_that_is_wound_inwards_is_seen(is_turned: bool) -> None:
    ball = shapes.make("sphere", DENSE)
    small = ball.faces[:, ::-1] if is_turned else ball.faces
    vertices = np.concatenate([ball.vertices, 0.5 * ball.vertices + np.array([2.0, 0.0, 0.0])])
    tree = ldtrefl.peel(vertices, np.concatenate([ball.faces, small + len(ball.vertices)]), quality="fast").tree
    assert tree.patches and tree.view.front == (0.0 if is_turned else 1.0)
    tree.view.front = 1.0
    assert shows_backs(tree) == is_turned
