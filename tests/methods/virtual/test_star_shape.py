"""Star-shaped reflectors: radii and gradients against closed forms and finite differences, holes, and refusals."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.base.errors import NotForThisScene
from ldtrefl.methods.virtual.radius_map import node_directions
from ldtrefl.methods.virtual.star_shape import StarShape, star_shape, star_shape_of
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes import make
from ldtrefl.world.device_scene import DeviceScene

RNG = np.random.default_rng(11)
AXES = np.array([1.0, 1.4, 0.8])


def random_directions(count: int) -> np.ndarray:
    ways = RNG.normal(size=(count, 3))
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


def tangents(directions: np.ndarray) -> np.ndarray:
    """(n, 3): a unit vector at right angles to each."""
    across = np.cross(directions, random_directions(len(directions)))
    return across / np.linalg.norm(across, axis=1, keepdims=True)


def ellipsoid(smooth: bool) -> StarShape:
    sphere = make("sphere", {"segments": [256, 128]})
    normals = sphere.normals / AXES if smooth else None
    return star_shape(sphere.vertices * AXES, sphere.faces, normals, "ellipsoid")


@pytest.mark.parametrize("smooth", [False, True])
def test_the_radius_is_that_of_the_facets(smooth: bool) -> None:
    directions = random_directions(2000)
    radii, _ = ellipsoid(smooth).radii(directions)
    exact = (directions**2 @ AXES**-2.0) ** -0.5
    assert np.all(radii <= exact + 1e-12) and np.all(radii > exact - 1e-3)


def test_the_gradient_is_that_of_the_smooth_surface() -> None:
    directions = random_directions(2000)
    _, gradients = ellipsoid(smooth=True).radii(directions)
    across, step = tangents(directions), 1e-6
    ahead, behind = (
        ((directions + way * across) ** 2 @ AXES**-2.0 / ((directions + way * across) ** 2).sum(axis=1)) ** -0.5
        for way in (step, -step)
    )
    assert np.allclose(np.einsum("ij,ij->i", gradients, across), (ahead - behind) / (2 * step), atol=2e-3)
    assert np.allclose(np.einsum("ij,ij->i", gradients, directions), 0.0, atol=1e-9)


def test_the_gradient_of_facets_is_the_difference_of_their_radii() -> None:
    shape = star_shape(make("box").vertices * AXES, make("box").faces, None, "box")
    directions = random_directions(2000)
    across, step = tangents(directions), 1e-6
    ahead, behind = (directions + step * across, directions - step * across)
    r, gradients = shape.radii(directions)
    r_ahead, r_behind = (shape.radii(way / np.linalg.norm(way, axis=1, keepdims=True))[0] for way in (ahead, behind))
    is_inside = np.abs(r_ahead + r_behind - 2 * r) < 1e-9  # of a facet
    assert is_inside.mean() > 0.99
    differences = (r_ahead - r_behind) / (2 * step)
    assert np.allclose(np.einsum("ij,ij->i", gradients, across)[is_inside], differences[is_inside], atol=1e-5)


def test_an_unknown_normal_is_the_facets() -> None:
    box = make("box")
    known, unknown = (star_shape(box.vertices, box.faces, n, "box") for n in (None, np.zeros((len(box.vertices), 3))))
    directions = random_directions(100)
    assert np.allclose(known.radii(directions)[1], unknown.radii(directions)[1])


def test_a_bowl_has_no_radius_where_it_is_open_and_is_continued_a_little_beyond_its_rim() -> None:
    bowl = make("bowl", {"closed": False, "depth": 1.0})
    shape = star_shape(bowl.vertices, bowl.faces, bowl.normals, "bowl")
    radius, middle = bowl.bounds[1, 0], np.array([0.0, 0.0, bowl.bounds[1, 2]])
    directions = random_directions(5000)
    radii, _ = shape.radii(directions)
    top = bowl.bounds[1, 2] - shape.centre[2]
    rim = np.abs(bowl.bounds[1, 0])
    sines = top / np.hypot(top, rim)
    assert np.array_equal(radii > 0.0, directions[:, 2] < sines)
    values = shape.radius_map(32, wp.get_device("cpu")).values.numpy()
    heights = np.arcsin(node_directions(32)[:, 2]) - np.arcsin(sines)
    assert np.all(values[heights < 0.0, 0] > 0.0) and np.all(values[heights > 0.35, 0] == 0.0)
    is_continued = (heights > 0.0) & (heights < 0.15)
    nodes, beyond = node_directions(32)[is_continued], values[is_continued]
    # The sphere goes on above the bowl.
    along = np.einsum("ij,j->i", nodes, shape.centre - middle)
    exact = -along + np.sqrt(along**2 + radius**2 - (shape.centre - middle) @ (shape.centre - middle))
    assert np.allclose(beyond[:, 0], exact, rtol=0.03)


def test_what_hides_part_of_itself_is_refused_by_name() -> None:
    two = np.concatenate([make("sphere").vertices, 2.0 * make("sphere").vertices])
    faces = make("sphere").faces
    both = np.concatenate([faces, faces + len(make("sphere").vertices)])
    with pytest.raises(NotForThisScene, match="object 'onion' is not star-shaped: from no point"):
        star_shape(two, both, None, "object 'onion'")
    with pytest.raises(NotForThisScene, match="ring is not star-shaped"):
        star_shape(make("torus").vertices, make("torus").faces, None, "ring")


def test_a_placed_object_has_the_lengths_of_device_space() -> None:
    sphere = make("sphere", {"segments": [256, 128]})
    placed = Object(name="ball", mesh=sphere, scale=(1.0, 3.0, 0.5), rotate=(0, 0, 1, 30), translate=(5.0, 1.0, 2.0))
    far = Object(name="far", mesh=Mesh([[9, 9, 9], [9, 8, 9], [8, 9, 9]], [[0, 1, 2]]))
    camera = Camera(eye=(0.0, -9.0, 0.0), look_at=(0.0, 0.0, 0.0))
    scene = DeviceScene(Scene(camera=camera, objects=(placed, far)), wp.get_device("cpu"))
    shape = star_shape_of(scene.objects[0], scene.device_from_world)
    per_world = scene.device_units_per_world_unit
    assert np.allclose(shape.centre, (scene.device_from_world @ [5.0, 1.0, 2.0, 1.0])[:3])
    turned = np.array([-0.5, np.sqrt(0.75), 0.0])  # where the longest axis points
    radii, gradients = shape.radii(np.array([turned, [0.0, 0.0, -1.0]]))
    assert np.allclose(radii, [3.0 * per_world, 0.5 * per_world], rtol=1e-3)
    assert np.allclose(gradients, 0.0, atol=1e-2 * per_world)
