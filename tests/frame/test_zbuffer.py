"""The z-buffer draws many objects at once."""

import numpy as np

import ldtrefl
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Object, Scene


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
