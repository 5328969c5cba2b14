"""Pixels near an edge, against those marked by hand."""

import numpy as np
from picture_edges import around, near_edge


def test_a_pixel_is_near_an_edge_if_any_bounce_of_a_neighbour_meets_something_else() -> None:
    met = np.ones((5, 6, 2), np.uint32)
    met[1, 4, 1] = 2
    expected = np.zeros((5, 6), bool)
    expected[0:3, 3:6] = True
    np.testing.assert_array_equal(near_edge(met), expected)


def test_each_of_the_3_x_3_around_a_pixel_takes_its_place_once() -> None:
    picture = np.arange(20).reshape(4, 5)
    places = np.array([moved[[1, 0], [2, 0]] for moved in around(picture)])
    assert places[:, 0].tolist() == [1, 2, 3, 6, 7, 8, 11, 12, 13]
    assert places[:, 1].tolist() == [0, 0, 1, 0, 0, 1, 5, 5, 6], "the border repeats"
