"""Fermat's points in (u, v): the gradient by finite differences, a ball's points by bisection, poles, hidden ones."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.methods.virtual.star_shape import StarShape
from ldtrefl.methods.virtual.uv_search import (
    FLATTEST,
    LOWEST,
    PathTriangle,
    find_uv_reflection,
    path_gradient,
    third_point,
    with_furthest_replaced,
    zero_of,
)
from ldtrefl.methods.virtual.uv_surface import UvPoint, UvSurface, uv_surface

RNG = np.random.default_rng(5)
CPU = wp.get_device("cpu")
CENTRE = np.array([0.4, -0.3, 0.2])
NEAR_POLE = np.radians(15.0)


class Ball(StarShape):
    """Of radius 1, in closed form."""

    def radii(self, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.ones(len(directions)), np.zeros_like(directions)


def ball() -> UvSurface:
    shape = Ball(CENTRE, np.zeros((0, 3)), np.zeros((0, 3), int), None)
    return uv_surface(shape, np.array([0.0, 0.0, 1.0]), 256, CPU)


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def on_device(values: np.ndarray, kind: type) -> wp.array:
    return wp.array(values, dtype=kind, device=CPU)


@launch.kernel
def search(
    first: int,
    # In:
    surface: UvSurface,
    eyes: wp.array(dtype=wp.vec3d),
    vertices: wp.array(dtype=wp.vec3d),
    steps: int,
    # Out:
    point_out: wp.array(dtype=wp.vec3d),
    is_seen_out: wp.array(dtype=int),
    steps_out: wp.array(dtype=int),
):
    """Search for one vertex' reflection."""
    i = first + wp.tid()
    found = find_uv_reflection(surface, eyes[i], vertices[i], steps)
    point_out[i] = found.point
    is_seen_out[i] = found.is_seen
    steps_out[i] = found.steps


def searched(eyes: np.ndarray, vertices: np.ndarray, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The ball's points, whether they are seen, and the steps taken."""
    count = len(eyes)
    outputs = [wp.zeros(count, dtype=kind, device=CPU) for kind in (wp.vec3d, int, int)]
    inputs = [ball(), on_device(eyes, wp.vec3d), on_device(vertices, wp.vec3d), steps]
    launch.launch(search, count, [*inputs, *outputs], CPU)
    point, is_seen, taken = (output.numpy() for output in outputs)
    return point, is_seen == 1, taken


def random_pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Eyes and vertices about the ball."""
    eyes, vertices = (
        CENTRE + unit(RNG.normal(size=(count, 3))) * RNG.uniform(nearest, 6.0, (count, 1)) for nearest in (1.5, 1.2)
    )
    return eyes, vertices


def true_points(eyes: np.ndarray, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) float64 where the path by way of the ball is shortest, by bisection of the arc between eye and vertex in
    their plane; (n,) the cosine of the angle to the normal there, 0 or less for a vertex that the ball hides."""
    eye, vertex = eyes - CENTRE, vertices - CENTRE
    x = unit(eye)
    y = unit(vertex - (vertex * x).sum(axis=1, keepdims=True) * x)
    low, high = np.zeros(len(eye)), np.arctan2((vertex * y).sum(axis=1), (vertex * x).sum(axis=1))
    for _ in range(60):
        middle = (low + high) / 2.0
        cosine, sine = np.cos(middle)[:, None], np.sin(middle)[:, None]
        point, along = cosine * x + sine * y, cosine * y - sine * x
        is_beyond = (along * (unit(eye - point) + unit(vertex - point))).sum(axis=1) < 0.0
        low, high = np.where(is_beyond, low, middle), np.where(is_beyond, middle, high)
    cosines = [(point * unit(end - point)).sum(axis=1) for end in (eye, vertex)]
    return CENTRE + point, np.minimum(*cosines)


def pole_angle(points: np.ndarray) -> np.ndarray:
    """From the nearer pole."""
    return np.arccos(np.abs(points - CENTRE)[:, 2].clip(0.0, 1.0))


@launch.kernel
def find_gradients(
    first: int,
    # In:
    points: wp.array(dtype=UvPoint),
    eye: wp.vec3d,
    vertex: wp.vec3d,
    # Out:
    gradient_out: wp.array(dtype=wp.vec2d),
):
    """Find the gradient at one point."""
    i = first + wp.tid()
    gradient_out[i] = path_gradient(points[i], eye, vertex)


def test_the_gradient_is_the_paths_by_finite_differences() -> None:
    """On a wavy sheet f(u, v), for a path by way of it."""

    def sheet(uv: np.ndarray) -> np.ndarray:
        u, v = uv.T
        return np.stack([u + 0.2 * v * v, v, 0.3 * np.sin(3.0 * u) * v], axis=1)

    eye, vertex, step = np.array([0.5, -1.0, 4.0]), np.array([-2.0, 1.5, 3.0]), 1e-6
    uv = RNG.uniform(-1.0, 1.0, size=(200, 2))
    u, v = uv.T
    points = np.zeros(len(uv), dtype=UvPoint.numpy_dtype())
    points["point"] = sheet(uv)
    points["du"] = np.stack([np.ones_like(u), np.zeros_like(u), 0.9 * np.cos(3.0 * u) * v], axis=1)
    points["dv"] = np.stack([0.4 * v, np.ones_like(u), 0.3 * np.sin(3.0 * u)], axis=1)
    found = wp.zeros(len(uv), dtype=wp.vec2d, device=CPU)
    inputs = [wp.array(points, dtype=UvPoint, device=CPU), wp.vec3d(*eye), wp.vec3d(*vertex)]
    launch.launch(find_gradients, len(uv), [*inputs, found], CPU)

    def length(uv: np.ndarray) -> np.ndarray:
        point = sheet(uv)
        return np.linalg.norm(point - eye, axis=1) + np.linalg.norm(point - vertex, axis=1)

    expected = [(length(uv + way) - length(uv - way)) / (2.0 * step) for way in step * np.eye(2)]
    np.testing.assert_allclose(found.numpy(), np.stack(expected, axis=1), atol=1e-8)


@launch.kernel
def step_once(
    first: int,
    # In:
    triangles: wp.array(dtype=PathTriangle),
    # Out:
    zero_out: wp.array(dtype=wp.vec2d),
    triangle_out: wp.array(dtype=PathTriangle),
):
    """Find the zero of one triangle's gradients, and replace the furthest corner by it."""
    i = first + wp.tid()
    zero_out[i] = zero_of(triangles[i])
    triangle_out[i] = with_furthest_replaced(triangles[i], zero_out[i], wp.vec2d(wp.float64(7.0), wp.float64(8.0)))


def stepped(corners: np.ndarray, gradients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The zeros, and the triangles after them, as structured arrays."""
    triangles = np.zeros(len(corners), dtype=PathTriangle.numpy_dtype())
    for k, name in enumerate("abc"):
        triangles[name], triangles[f"gradient_{name}"] = corners[:, k], gradients[:, k]
    zero = wp.zeros(len(corners), dtype=wp.vec2d, device=CPU)
    after = wp.zeros(len(corners), dtype=PathTriangle, device=CPU)
    launch.launch(step_once, len(corners), [wp.array(triangles, dtype=PathTriangle, device=CPU), zero, after], CPU)
    return zero.numpy(), after.numpy()


def test_a_linear_gradient_is_0_where_equations_3_1_and_3_2_say() -> None:
    corners, zeros = RNG.uniform(-1.0, 1.0, size=(100, 3, 2)), RNG.uniform(-3.0, 3.0, size=(100, 1, 2))
    matrix = RNG.normal(size=(100, 2, 2))
    found, _ = stepped(corners, (corners - zeros) @ matrix)
    np.testing.assert_allclose(found, zeros[:, 0], atol=1e-6)


def test_the_furthest_corner_is_replaced() -> None:
    corners = RNG.uniform(-1.0, 1.0, size=(100, 3, 2))
    zero, after = stepped(corners, corners - RNG.uniform(-1.0, 1.0, size=(100, 1, 2)))
    furthest = np.linalg.norm(corners - zero[:, None], axis=2).argmax(axis=1)
    assert set(furthest) == {0, 1, 2}
    for k, name in enumerate("abc"):
        is_replaced = furthest == k
        np.testing.assert_array_equal(after[name], np.where(is_replaced[:, None], zero, corners[:, k]))
        np.testing.assert_array_equal((after[f"gradient_{name}"] == [7.0, 8.0]).all(axis=1), is_replaced)


def test_gradients_that_are_alike_have_no_zero() -> None:
    corners = RNG.uniform(-1.0, 1.0, size=(3, 3, 2))
    gradients = np.ones((3, 3, 2))
    gradients[1, :, 0] += [0.0, 1.0, 2.0]  # in a row
    gradients[2, :, 1] += [0.0, 1.0, -5.0]
    assert (np.abs(stepped(corners, gradients)[0]).max(axis=1) > 1e6).all()


@launch.kernel
def find_third_points(
    first: int,
    # In:
    surface: UvSurface,
    a: wp.array(dtype=wp.vec2d),
    b: wp.array(dtype=wp.vec2d),
    likely: wp.array(dtype=wp.vec3d),
    # Out:
    c_out: wp.array(dtype=wp.vec2d),
):
    """Find the third point of one triangle."""
    i = first + wp.tid()
    c_out[i] = third_point(surface, a[i], b[i], likely[i])


def test_the_first_triangle_is_not_too_flat() -> None:
    a = RNG.uniform([-np.pi, 0.0], [np.pi, np.pi], size=(500, 2))
    b = a + RNG.uniform(-3.0, 3.0, size=(500, 2))
    b[:100] = a[:100] + np.array([1e-3, 0.0])
    likely = RNG.normal(size=(500, 3))
    likely[::5] = 0.0
    c = wp.zeros(500, dtype=wp.vec2d, device=CPU)
    inputs = [ball(), on_device(a, wp.vec2d), on_device(b, wp.vec2d), on_device(likely, wp.vec3d), c]
    launch.launch(find_third_points, 500, inputs, CPU)
    side, way = b - a, c.numpy() - (a + b) / 2.0
    length = np.linalg.norm(side, axis=1)
    height = np.abs(side[:, 0] * way[:, 1] - side[:, 1] * way[:, 0]) / length
    assert (height >= np.maximum(float(FLATTEST) * length, float(LOWEST)) - 1e-9).all()


def test_a_balls_reflections_are_found_in_five_steps() -> None:
    eyes, vertices = random_pairs(20_000)
    truth, cosine = true_points(eyes, vertices)
    found, is_seen, taken = searched(eyes, vertices, 5)
    error = np.linalg.norm(found - truth, axis=1)
    is_away = pole_angle(truth) > NEAR_POLE
    chosen = is_away & (cosine > 0.2)
    assert chosen.sum() > 10_000 and taken.max() == 5
    assert (is_seen & (error < 0.01))[chosen].mean() > 0.99, (is_seen & (error < 0.01))[chosen].mean()
    assert np.median(error[chosen]) < 3e-5, np.median(error[chosen])
    at_grazing = is_away & (cosine > 0.0)
    assert (is_seen & (error < 0.01))[at_grazing].mean() > 0.97, (is_seen & (error < 0.01))[at_grazing].mean()


def test_four_or_five_steps_suffice() -> None:
    """Section 3.3.3; then what is left is that of the textures."""
    eyes, vertices = random_pairs(20_000)
    truth, cosine = true_points(eyes, vertices)
    chosen = (pole_angle(truth) > NEAR_POLE) & (cosine > 0.2)
    found = [searched(eyes, vertices, steps) for steps in (1, 2, 3, 4, 5, 8)]
    errors = [np.linalg.norm(point - truth, axis=1)[chosen] for point, _, _ in found]
    right = [(error < 0.01).mean() for error in errors]
    assert right == sorted(right) and right[0] < 0.9 and right[3] > 0.995 and right[4] > 0.998, right
    # The search ends before its last step where the triangle is small.
    assert found[-1][2][chosen].mean() < 6.5


def reflected_pairs(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eyes before these points of the ball, and vertices that they are mirrored to, at angles of up to 70 degrees."""
    normal = points - CENTRE
    way = unit(unit(RNG.normal(size=points.shape)) + 1.5 * normal)
    mirrored = 2.0 * (way * normal).sum(axis=1, keepdims=True) * normal - way
    far, near = RNG.uniform(1.0, 5.0, size=(2, len(points), 1))
    return points + far * way, points + near * mirrored


def test_near_a_pole_more_searches_fail() -> None:
    """The paper's trouble (section 4): there df/du is nearly 0, and meridians run together. More steps do not help."""
    wrong = {}
    for least, most in ((0.0, 3.0), (3.0, 8.0), (30.0, 90.0)):
        height = np.cos(np.radians(RNG.uniform(least, most, 5000)))
        around = RNG.uniform(0.0, 2.0 * np.pi, 5000)
        level = np.sqrt(1.0 - height**2)
        points = CENTRE + np.stack([level * np.cos(around), level * np.sin(around), height], axis=1)
        for steps in (5, 20):
            found, is_seen, _ = searched(*reflected_pairs(points), steps)
            wrong[most, steps] = (~is_seen | (np.linalg.norm(found - points, axis=1) > 0.01)).mean()
    for steps in (5, 20):
        assert wrong[3.0, steps] > 0.05 > 5.0 * wrong[8.0, steps] and wrong[90.0, steps] < 1e-3, wrong


def test_what_the_ball_hides_is_not_seen() -> None:
    """The way is shortest where the line of sight pierces the ball: that is no reflection."""
    eyes, vertices = random_pairs(40_000)
    _, cosine = true_points(eyes, vertices)
    _, is_seen, _ = searched(eyes, vertices, 5)
    hidden = cosine < -0.05
    assert hidden.sum() > 3000 and is_seen[hidden].mean() < 2e-3, is_seen[hidden].mean()


def test_from_inside_the_inner_side_reflects() -> None:
    """A vertex beside the eye is seen on the far side and the near one of the line from the centre through both."""
    eyes = CENTRE + np.array([[0.4, 0.1, 0.05], [-0.1, 0.5, 0.2]])
    vertices = eyes + unit(eyes - CENTRE) * 0.2
    found, is_seen, _ = searched(eyes, vertices, 8)
    assert is_seen.all()
    np.testing.assert_allclose(found, CENTRE + unit(eyes - CENTRE), atol=1e-3)
    outside = CENTRE + 3.0 * unit(eyes - CENTRE)
    assert not searched(eyes, outside, 8)[1].any()


def test_eye_and_vertex_in_one_direction_or_at_the_centre() -> None:
    """Where triangles have no side of their own, and directions no length."""
    way = unit(np.array([[1.0, 2.0, 0.3]]))
    found, is_seen, _ = searched(CENTRE + 3.0 * way, CENTRE + 2.0 * way, 5)
    assert is_seen.all()
    np.testing.assert_allclose(found, CENTRE + way, atol=3e-5)
    found, _, _ = searched(CENTRE + 3.0 * way, CENTRE[None], 5)
    assert np.isfinite(found).all()
    assert not searched(CENTRE + 3.0 * way, CENTRE - 2.0 * way, 5)[1].any(), "behind the ball"
