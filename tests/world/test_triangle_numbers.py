"""Numbers that lead back to every triangle of every object."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.world import triangle_numbers
from ldtrefl.world.triangle_numbers import TriangleNumbers, first_triangle_of, number_of, numbered, object_of

CPU = launch.resolve_device("cpu")


@launch.kernel
def go_and_come_back(
    first: int,
    # In:
    numbers: TriangleNumbers,
    objects: wp.array(dtype=int),
    triangles: wp.array(dtype=int),
    # Out: the number, the object, the first triangle of its group
    found_out: wp.array(dtype=wp.vec3i),
):
    """Number one triangle, and find it by its number."""
    i = first + wp.tid()
    number = number_of(numbers, objects[i], triangles[i])
    index = object_of(numbers, number)
    found_out[i] = wp.vec3i(number, index, first_triangle_of(numbers, index, number))


@pytest.mark.parametrize(("most", "shift"), [(None, 0), (200, 1), (30, 4), (5, 7)])
def test_every_triangle_is_found_by_its_number(most: int | None, shift: int, monkeypatch: pytest.MonkeyPatch) -> None:
    if most is not None:
        monkeypatch.setattr(triangle_numbers, "MOST_NUMBERS", most)
    counts = np.array([12, 1, 128, 100, 17])
    numbers = numbered(counts, CPU)
    assert numbers.shift == shift
    objects = np.repeat(np.arange(len(counts)), counts)
    triangles = np.concatenate([np.arange(count) for count in counts])
    given = [wp.array(values.astype(np.int32), dtype=int, device=CPU) for values in (objects, triangles)]
    found = wp.empty(len(objects), dtype=wp.vec3i, device=CPU)
    launch.launch(go_and_come_back, len(objects), [numbers, *given, found], CPU)
    number, index, first = found.numpy().T
    np.testing.assert_array_equal(index, objects)
    np.testing.assert_array_equal(first, triangles >> shift << shift)
    assert (np.diff(number) >= 0).all() and number[0] == 0 and number[-1] <= (most or triangle_numbers.MOST_NUMBERS)
    assert len(np.unique(number)) == number[-1] + 1


def test_ten_thousand_million_triangles_are_numbered() -> None:
    numbers = numbered(np.full(100_000, 100_000), CPU)
    assert numbers.shift == 3 and numbers.first.numpy()[-1] == 99_999 * 12_500
    assert numbered(np.zeros(0, np.int64), CPU).first.shape == (0,)
