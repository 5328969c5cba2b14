"""Every shading function against its closed form, on turned, stretched and tiny objects, through both methods."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene

TURNS = [(0, 0, 1, 0), (1, 1, 0, 90), (1, -2, 3, 77), (0, 1, 0, 200)]
SIZES = [1.0, 1e-6, (1.0, 3.0, 0.2), (1e-4, 1.0, 50.0), (1e6, 1e3, 1e5)]
BLACK = Environment(sky=(0, 0, 0), ground=(0, 0, 0))
NO_LIGHT = Lighting(ambient=(0, 0, 0))


def turned(axis_and_degrees: tuple[float, ...]) -> np.ndarray:
    """(3, 3) rotation by Rodrigues' formula."""
    axis = np.array(axis_and_degrees[:3], float) / np.linalg.norm(axis_and_degrees[:3])
    angle = np.radians(axis_and_degrees[3])
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


class Facet:
    """A plane, turned and stretched, and a camera that looks at its middle at an angle to its normal."""

    def __init__(self, turn: tuple[float, ...], size: object, degrees: float, up_the: int = 0) -> None:
        matrix = turned(turn)
        self.normal, along = matrix[:, 2], matrix[:, up_the]
        scale = (size,) * 3 if isinstance(size, float) else size
        self.distance = 0.1 * min(scale[:2])
        angle = np.radians(degrees)
        self.to_eye = np.cos(angle) * self.normal + np.sin(angle) * along
        self.turn, self.size = turn, size
        up = self.normal if degrees > 1 else matrix[:, 1 - up_the]
        eye = tuple((self.distance * self.to_eye).tolist())
        self.camera = Camera(eye=eye, look_at=(0, 0, 0), up=tuple(up.tolist()), width=1, height=1, fov_y=0.01)

    def seen(self, material: Material, method: str = "bvh", **scene: object) -> np.ndarray:
        """(3,) what the camera sees of the plane with this material."""
        thing = Object(shape="plane", scale=self.size, rotate=self.turn, material=material)
        made = Scene(camera=self.camera, objects=(thing,), **{"environment": BLACK, "lighting": NO_LIGHT, **scene})
        return ldtrefl.render(made, method).image[0, 0]


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_fresnel_is_schlicks(turn: tuple, size: object) -> None:
    white = Environment(sky=(1, 1, 1), ground=(1, 1, 1))
    for degrees in (0.0, 30.0, 60.0, 80.0):
        mirror = Material(albedo=(0, 0, 0), mirror=(0.04, 0.5, 1.0), fresnel=True)
        base = np.array([0.04, 0.5, 1.0])
        expected = base + (1 - base) * (1 - np.cos(np.radians(degrees))) ** 5
        for method in ("bvh", "ldt"):
            image = Facet(turn, size, degrees).seen(mirror, method, environment=white)
            np.testing.assert_allclose(image, expected, rtol=2e-4)


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_diffuse_light_follows_the_cosine(turn: tuple, size: object) -> None:
    """``emission + albedo * (ambient + radiance * cos)``, from either side of the plane; nothing from behind."""
    for degrees in (20.0, 70.0):
        facet = Facet(turn, size, 40.0)
        angle = np.radians(degrees)
        matrix = turned(turn)
        towards = np.cos(angle) * matrix[:, 2] + np.sin(angle) * matrix[:, 1]
        white = Material(albedo=(0.5, 0.25, 1.0), emission=(0.1, 0.2, 0.3))
        for side in (1.0, -1.0):
            light = Light(kind="directional", direction=tuple((-side * towards).tolist()), radiance=(2, 3, 4))
            lit = Lighting(ambient=(0.2, 0.3, 0.4))
            arriving = np.array([2, 3, 4]) * np.cos(angle) * (side > 0) + [0.2, 0.3, 0.4]
            expected = np.array([0.5, 0.25, 1.0]) * arriving + [0.1, 0.2, 0.3]
            np.testing.assert_allclose(facet.seen(white, lights=(light,), lighting=lit), expected, rtol=2e-5)


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_point_light_falls_off_with_the_square(turn: tuple, size: object) -> None:
    facet = Facet(turn, size, 40.0)
    for degrees in (0.0, 60.0):
        angle = np.radians(degrees)
        offset = np.cos(angle) * facet.normal + np.sin(angle) * turned(turn)[:, 1]
        distance = 0.7 * facet.distance
        position = tuple((distance * offset).tolist())
        light = Light(kind="point", position=position, intensity=(distance**2, 2 * distance**2, 0))
        image = facet.seen(Material(albedo=(1, 1, 1)), lights=(light,))
        np.testing.assert_allclose(image, np.cos(angle) * np.array([1.0, 2.0, 0.0]), rtol=1e-4)


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_mirror_sees_the_environment_along_the_reflected_direction(turn: tuple, size: object) -> None:
    """``mirror * (blend of sky and ground)`` by the height of ``2 (n . v) n - v`` over the camera's up."""
    facet = Facet(turn, size, 50.0)
    mirror = Material(albedo=(0, 0, 0), mirror=(0.9, 0.5, 0.1))
    two = Environment(sky=(1, 0, 2), ground=(0, 1, 2))
    onwards = 2 * (facet.normal @ facet.to_eye) * facet.normal - facet.to_eye
    blend = 0.5 + 0.5 * onwards @ np.array(facet.camera.up)
    expected = np.array([0.9, 0.5, 0.1]) * [blend, 1 - blend, 2.0]
    for method in ("bvh", "ldt"):
        np.testing.assert_allclose(facet.seen(mirror, method, environment=two), expected, rtol=2e-5)


@pytest.mark.parametrize("size", [1.0, 1e-6, (1.0, 3.0, 0.2), (2.0, 0.1, 7.0)], ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_smooth_normals_of_an_ellipsoid(turn: tuple, size: object) -> None:
    """The normal of an ellipsoid at p is p over the squares of its half-axes; light shows the cosine with it."""
    half = np.array((size,) * 3 if isinstance(size, float) else size, float)
    matrix = turned(turn)
    towards = matrix @ (np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8]))
    light = Light(kind="directional", direction=tuple((-towards).tolist()), radiance=(1, 1, 1))
    ball = Object(
        shape="sphere",
        params={"segments": [512, 256]},
        scale=size,
        rotate=turn,
        material=Material(albedo=(1, 1, 1)),
    )
    for unit in ([0.5, -0.6, 0.6245], [-0.3, 0.2, 0.9327]):
        local = np.array(unit) * half
        point, normal = matrix @ local, matrix @ (local / half**2)
        normal /= np.linalg.norm(normal)
        eye = point + 3.0 * half.max() * normal
        up = np.cross(normal, [0.1, 0.7, 0.3])
        camera = Camera(
            eye=tuple(eye.tolist()),
            look_at=tuple(point.tolist()),
            up=tuple(up.tolist()),
            width=1,
            height=1,
            fov_y=1e-4,
        )
        scene = Scene(camera=camera, lighting=NO_LIGHT, lights=(light,), objects=(ball,))
        image = ldtrefl.render(scene, "bvh").image[0, 0]
        np.testing.assert_allclose(image, max(0.0, normal @ towards), atol=2e-3)


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_textures_are_bilinear_between_texel_centres(tmp_path: Path, turn: tuple, size: object) -> None:
    """A row of texels 0, 1, 0, 0 on a plane: the middle lies half-way between the second and the third."""
    picture = np.zeros((1, 4, 3), np.float32)
    picture[0, 1] = [1.0, 0.5, 0.25]
    ldtrefl.save_image(tmp_path / "row.exr", picture)
    material = Material(albedo=(1, 1, 0.5), texture=str(tmp_path / "row.exr"))
    image = Facet(turn, size, 20.0, up_the=1).seen(material, lighting=Lighting(ambient=(1, 1, 1)))
    np.testing.assert_allclose(image, [0.5, 0.25, 0.0625], atol=2e-3)
