"""A plane turned and stretched, and a camera at an angle to it: what tests of shading look at."""

import numpy as np

import ldtrefl
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene

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
