"""The z-buffer draws many objects at once."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.frame import zbuffer
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world import triangle_numbers
from tests.frame.drawing import assert_same
from tests.frame.flat_mirror import on_device


def test_many_small_objects_are_drawn_like_one_mesh() -> None:
    """Many boxes cover the same pixels as one mesh of all of them."""
    camera = Camera(eye=(0, -6, 2), look_at=(0, 0, 0), width=96, height=64, fov_y=40)
    places = np.random.default_rng(2).uniform(-1.5, 1.5, (300, 3))
    box = shapes.make("box")
    apart = [Object(shape="box", scale=0.05, translate=tuple(place.tolist())) for place in places]
    vertices = np.concatenate([0.05 * box.vertices + place for place in places])
    faces = np.concatenate([box.faces + len(box.vertices) * k for k in range(len(places))])
    one = Object(mesh=ldtrefl.Mesh(vertices, faces))
    seen = []
    for objects in ((one,), tuple(apart)):
        renderer = ldtrefl.Renderer(Scene(camera=camera, objects=objects), "bvh")
        renderer.render()
        assert renderer.gbuffer is not None
        seen.append(renderer.gbuffer)
    number = np.where(seen[1].objects >= 0, seen[1].objects * len(box.faces) + seen[1].triangles, -1)
    # Corners are rounded to float32 in a box of another size: pixels on an edge may go to either side.
    assert (number != seen[0].triangles).mean() < 0.002


EYE = (0.0, -1.2, 0.2)


def many(count: int) -> Scene:
    """Boxes and balls of all sizes before, behind and about the camera."""
    rng = np.random.default_rng(3)
    places = rng.uniform(-1.5, 1.5, (3 * count, 3))
    places = places[np.linalg.norm(places - EYE, axis=1) > 0.6][:count]
    things = [
        Object(
            name=f"{k}",
            shape=("box", "sphere")[k % 2],
            params={} if k % 2 == 0 else {"segments": [16, 8]},
            scale=tuple(rng.uniform(0.02, 0.3, 3).tolist()),
            translate=tuple(place),
        )
        for k, place in enumerate(places.tolist())
    ]
    camera = Camera(eye=EYE, look_at=(0, 0, 0), fov_y=70, width=80, height=60)
    return Scene(camera=camera, objects=tuple(things))


@pytest.mark.parametrize("together", [1, 100, 1000])
def test_without_room_for_all_corners_the_bits_are_the_same(together: int, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = many(40)
    expected = draw_gbuffer(on_device(scene), scene.camera)
    assert len(np.unique(expected.objects)) > 20
    monkeypatch.setattr(zbuffer, "CORNERS_KEPT", 0)
    monkeypatch.setattr(zbuffer, "CORNERS_TOGETHER", together)
    assert_same(draw_gbuffer(on_device(scene), scene.camera), expected)


@pytest.mark.parametrize("most", [500, 60])
def test_with_too_many_triangles_for_their_numbers_the_bits_are_the_same(
    most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = many(40)
    expected = draw_gbuffer(on_device(scene), scene.camera)
    monkeypatch.setattr(triangle_numbers, "MOST_NUMBERS", most)
    grouped = on_device(scene)
    assert grouped.triangle_numbers.shift > 0
    assert_same(draw_gbuffer(grouped, scene.camera), expected)


def test_objects_are_drawn_together_up_to_a_number_of_corners(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zbuffer, "CORNERS_TOGETHER", 10)
    parts = [(part.start, part.stop) for part, _ in zbuffer._parts(np.array([4, 4, 4, 30, 1, 10, 5, 5]))]
    assert parts == [(0, 2), (2, 3), (3, 4), (4, 5), (5, 6), (6, 8)]
    assert list(zbuffer._parts(np.zeros(0, np.int64))) == []
