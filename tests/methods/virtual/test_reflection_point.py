"""Where points are seen in mirrors: Alhazen's problem, planes in closed form, meshes, and what is refused."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl import InputError, Mesh, Plane, Sphere, reflection_point
from ldtrefl.scene.shapes import make
from tests.methods.virtual.ellipsoids import directions, grazing_pairs, random_pairs, reflections

PAIRS = 5000
"""Of each kind. With ten times as many the shares are the same."""

UNIT = Sphere(centre=(0.0, 0.0, 0.0), radius=1.0)


def alhazen(eye: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Where a unit sphere mirrors a point, by the roots of the quartic in the plane of eye, point and centre.

    With complex numbers for points of that plane, z is on the unit circle and mirrors A to B where
    ``(A - z)(B - z) / z^2`` is real: ``conj(AB) z^4 - conj(A + B) z^3 + (A + B) z - AB = 0``. Of its roots on the
    circle that one is the reflection which sees both, and by which the way is shortest.
    """
    x = eye / np.linalg.norm(eye)
    y = point - (point @ x) * x
    y /= np.linalg.norm(y)
    a, b = complex(eye @ x, eye @ y), complex(point @ x, point @ y)
    roots = np.roots([np.conj(a * b), -np.conj(a + b), 0.0, a + b, -a * b])
    roots = roots / np.abs(roots)
    for _ in range(3):  # Newton's steps along the circle: roots close together are known to 1e-8 only
        turned = 1j * roots
        way_a, way_b = roots - a, roots - b
        slope = sum((np.conj(way) * turned).real / np.abs(way) for way in (way_a, way_b))
        curve = sum(
            (1.0 + (np.conj(way) * -roots).real) / np.abs(way) - ((np.conj(way) * turned).real) ** 2 / np.abs(way) ** 3
            for way in (way_a, way_b)
        )
        step = np.where(np.abs(curve) > 0.0, slope / np.where(curve == 0.0, 1.0, curve), 0.0)
        roots = roots * np.exp(-1j * np.clip(step, -1e-3, 1e-3))
    sees = np.minimum((np.conj(roots) * (a - roots)).real, (np.conj(roots) * (b - roots)).real)
    length = np.abs(a - roots) + np.abs(b - roots)
    best = np.argmin(np.where(sees >= -1e-9, length, np.inf))
    return roots[best].real * x + roots[best].imag * y


@pytest.mark.parametrize("pairs", [random_pairs, grazing_pairs])
def test_alhazens_problem(pairs: object) -> None:
    assert callable(pairs)
    eyes, points = pairs(PAIRS)
    seen = reflection_point(eyes, points, UNIT)
    truth = np.array([alhazen(eye, point) for eye, point in zip(eyes, points, strict=True)])
    errors = np.linalg.norm(seen.points - truth, axis=1)
    print(f"{pairs.__name__}: within 1e-4 {np.mean(errors <= 1e-4):.5f}, converged {seen.converged.mean():.5f}")
    print("iterations", np.bincount(seen.iterations).tolist())
    assert np.mean(errors <= 1e-4) >= 0.999
    assert np.all(errors[seen.converged] <= 1e-4) and np.all(seen.residual[seen.converged] <= 1e-5)
    assert np.mean(seen.iterations <= 10) >= 0.95 and seen.iterations.max() <= 20


def test_any_sphere_is_the_unit_sphere_moved_and_scaled() -> None:
    eyes, points = random_pairs(200)
    centre, radius = np.array([1e4, -3.0, 20.0]), 50.0
    seen = reflection_point(centre + radius * eyes, centre + radius * points, Sphere(centre=centre, radius=radius))
    assert np.allclose(seen.points, centre + radius * reflection_point(eyes, points, UNIT).points, atol=1e-5)
    assert seen.converged.all()


def test_what_a_sphere_does_not_mirror_is_not_converged() -> None:
    hidden = reflection_point((0.0, 0.0, 5.0), [(0.0, 0.0, -5.0), (0.5, 0.0, -3.0), (0.0, 0.5, 0.0)], UNIT)
    assert not hidden.converged.any()
    assert np.isfinite(hidden.points).all() and np.isfinite(hidden.residual).all()


def test_from_inside_a_sphere_a_point_that_mirrors_is_found() -> None:
    eyes, points = (0.6 * directions(500) for _ in range(2))
    seen = reflection_point(eyes, points, UNIT)
    assert seen.converged.mean() > 0.85
    at, eye, point = seen.points[seen.converged], eyes[seen.converged], points[seen.converged]
    view, onwards = at - eye, point - at
    mirrored = view - 2.0 * np.einsum("ij,ij->i", view, at)[:, None] * at
    cosine = np.einsum("ij,ij->i", mirrored, onwards) / np.linalg.norm(view, axis=1) / np.linalg.norm(onwards, axis=1)
    assert np.allclose(cosine, 1.0, atol=1e-9)


def test_the_eye_and_the_point_on_one_line_with_the_centre() -> None:
    seen = reflection_point((0.0, 0.0, 4.0), [(0.0, 0.0, 2.0), (0.0, 0.0, 4.0)], UNIT)
    assert seen.converged.all() and np.allclose(seen.points, [0.0, 0.0, 1.0], atol=1e-6)


def test_a_plane_mirrors_as_its_mirrored_eye_sees() -> None:
    rng = np.random.default_rng(2)
    plane = Plane(point=(1.0, 2.0, 3.0), normal=(2.0, -1.0, 4.0))
    normal = np.array(plane.normal) / np.linalg.norm(plane.normal)
    eye, points = rng.normal(size=3) + 6.0 * normal, rng.normal(size=(4, 50, 3)) + 4.0 * normal
    seen = reflection_point(eye, points, plane)
    heights = (points - plane.point) @ normal
    assert np.array_equal(seen.converged, heights > 0.0) and 0 < seen.converged.sum()
    image = eye - 2.0 * ((eye - plane.point) @ normal) * normal
    share = ((np.array(plane.point) - image) @ normal) / ((points - image) @ normal)
    crossing = image + share[..., None] * (points - image)
    assert np.allclose(seen.points[seen.converged], crossing[seen.converged], atol=1e-12)
    assert np.all(seen.residual[seen.converged] < 1e-7) and not seen.iterations.any()
    behind = reflection_point(eye, points - 20.0 * normal, plane)
    assert not behind.converged.any()
    other_side = reflection_point(eye - 30.0 * normal, points - 20.0 * normal, plane)
    assert other_side.converged.all()


def test_a_fine_mesh_of_a_sphere_is_a_sphere() -> None:
    mesh = make("sphere", {"segments": [512, 256]})
    eyes, points = random_pairs(2000)
    exact, seen = reflection_point(eyes, points, UNIT), reflection_point(eyes, points, mesh)
    errors = np.linalg.norm(seen.points - exact.points, axis=1)
    print("mesh of a sphere:", np.percentile(errors, [50, 90, 99, 100]), seen.converged.mean())
    # A point a thousandth above the mesh is mirrored by a facet that is a thousandth of that off the sphere.
    assert np.percentile(errors, 99) < 2e-3 and seen.converged.mean() >= 0.99


def test_a_mesh_of_an_ellipsoid_is_an_ellipsoid() -> None:
    axes, centre = np.array([1.0, 1.4, 0.8]), np.array([3.0, -2.0, 5.0])
    sphere = make("sphere", {"segments": [512, 256]})
    mesh = Mesh(sphere.vertices * axes + centre, sphere.faces, normals=sphere.normals / axes)
    eyes, points = 3.0 * directions(2000) * axes, 4.0 * directions(2000) * axes
    exact = reflections((1.0, 1.4, 0.8), eyes, points)
    seen = reflection_point(eyes + centre, points + centre, mesh)
    assert np.mean(seen.converged == (exact["is_found"] == 1)) > 0.995
    both = seen.converged & (exact["is_found"] == 1)
    errors = np.linalg.norm(seen.points - centre - exact["point"], axis=1)[both]
    assert both.sum() > 1000 and np.percentile(errors, 99) < 1e-3


def test_beyond_the_rim_of_an_open_mesh_nothing_is_mirrored() -> None:
    # The lower half of a sphere, seen from below.
    bowl = make("bowl", {"closed": False, "depth": 1.0, "segments": [256, 128]})
    radius, top = bowl.bounds[1, 0], bowl.bounds[1, 2]
    sphere = Sphere(centre=(0.0, 0.0, top), radius=radius)
    eyes, points = (np.array([0.0, 0.0, top]) + 4.0 * directions(4000) for _ in range(2))
    is_below = (eyes[:, 2] < top - 1.0) & (points[:, 2] < top + 3.0)
    exact, seen = (reflection_point(eyes[is_below], points[is_below], mirror) for mirror in (sphere, bowl))
    is_in_bowl = exact.points[:, 2] < top - 0.02
    is_off = exact.points[:, 2] > top + 0.02
    assert (exact.converged & is_off).sum() > 50 and not seen.converged[exact.converged & is_off].any()
    assert np.mean(seen.converged[exact.converged & is_in_bowl]) > 0.99
    errors = np.linalg.norm(seen.points - exact.points, axis=1)[exact.converged & is_in_bowl & seen.converged]
    assert np.percentile(errors, 99) < 2e-3


def test_shapes_are_those_of_the_points() -> None:
    seen = reflection_point((0.0, 0.0, 3.0), np.ones((2, 5, 3)) * 2.0, UNIT)
    assert seen.points.shape == (2, 5, 3) and seen.points.dtype == float
    assert seen.converged.shape == seen.residual.shape == seen.iterations.shape == (2, 5)
    one = reflection_point((0.0, 0.0, 3.0), (2.0, 0.0, 2.0), UNIT)
    assert one.points.shape == (3,) and one.converged.shape == ()
    none = reflection_point((0.0, 0.0, 3.0), np.zeros((0, 3)), UNIT)
    assert none.points.shape == (0, 3)
    many_eyes = reflection_point(np.ones((7, 1, 3)) * 2.0, np.ones((4, 3)) * 3.0, UNIT)
    assert many_eyes.points.shape == (7, 4, 3)


@pytest.mark.parametrize(
    ("eye", "points", "reflector", "message"),
    [
        ((0, 0, np.nan), (1, 1, 1), UNIT, "eye: a number is not finite"),
        ((0, 0, 2), (1, np.inf, 1), UNIT, "points: a number is not finite"),
        ((0, 0), (1, 1, 1), UNIT, r"eye: shape \(\.\.\., 3\), got \(2,\)"),
        (np.ones((4, 3)), np.ones((3, 3)), UNIT, r"eye of shape \(4, 3\) and points of shape \(3, 3\) do not fit"),
        ("here", (1, 1, 1), UNIT, r"eye: numbers of shape \(\.\.\., 3\), got str"),
        ((0, 0, 2), (1, 1, 1), "ball", "reflector: a Sphere, a Plane or a Mesh, got str"),
        ((0, 0, 2), (1, 1, 1), make("torus"), "the mesh is not star-shaped"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(eye: object, points: object, reflector: object, message: str) -> None:
    with pytest.raises(InputError, match=message) as error:
        reflection_point(eye, points, reflector)  # type: ignore[arg-type]
    assert "\n" not in str(error.value)


def test_mirrors_are_checked() -> None:
    with pytest.raises(InputError, match="Sphere: radius"):
        Sphere(centre=(0, 0, 0), radius=0.0)
    with pytest.raises(InputError, match="Plane: normal"):
        Plane(point=(0, 0, 0), normal=(0, 0, 0))
    with pytest.raises(InputError, match="Sphere: centre"):
        ldtrefl.Sphere(centre=(0, 0, float("nan")), radius=1.0)
