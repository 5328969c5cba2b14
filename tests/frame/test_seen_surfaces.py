"""What pixels see of surfaces: depth, normals and albedo, in closed form."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.frame.seen_surfaces import SeenSurfaces
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.world.device_scene import DeviceScene
from tests.frame.flat_mirror import camera_directions

CAMERA = Camera(eye=(0.0, -5.0, 1.5), look_at=(0.2, 0.0, 0.0), width=64, height=48, fov_y=45.0)
COLOR = (0.25, 0.5, 0.75)


def seen(*objects: Object) -> tuple[SeenSurfaces, np.ndarray]:
    """What pixels see, and the numbers of the objects."""
    scene = Scene(camera=CAMERA, objects=objects)
    gbuffer = draw_gbuffer(DeviceScene(scene, launch.resolve_device(None)), CAMERA)
    return SeenSurfaces.of(gbuffer), gbuffer.objects


def way_and_axis() -> tuple[np.ndarray, np.ndarray]:
    """(h, w, 3) unit directions through the pixels, and the camera's axis."""
    axis = np.subtract(CAMERA.look_at, CAMERA.eye)
    return camera_directions(CAMERA).reshape(CAMERA.height, CAMERA.width, 3), axis / np.linalg.norm(axis)


@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_a_floor(scale: float) -> None:
    """Depth is along the camera's axis, in the world's units, whatever the scene's size."""
    floor = Object(shape="plane", scale=3.0 * scale, translate=(0.0, 0.0, -0.5), material=Material(albedo=COLOR))
    found, objects = seen(floor)
    way, axis = way_and_axis()
    on_floor = objects == 0
    depth = (-0.5 - CAMERA.eye[2]) / way[..., 2] * (way @ axis)
    np.testing.assert_allclose(found.depth[on_floor], depth[on_floor], rtol=1e-6)
    assert (found.depth[~on_floor] == np.inf).all() and (~on_floor).any()
    np.testing.assert_allclose(found.normal[on_floor], np.tile([0.0, 0.0, 1.0], (on_floor.sum(), 1)), atol=1e-6)
    np.testing.assert_array_equal(found.albedo[on_floor], np.tile(np.float32(COLOR), (on_floor.sum(), 1)))
    assert (found.normal[~on_floor] == 0.0).all() and (found.albedo[~on_floor] == 0.0).all()


def test_a_ball_and_a_mirror() -> None:
    """A ball's normal points from its middle; a mirror scatters no light."""
    ball = Object(shape="sphere", translate=(-1.0, 0.0, 0.0), material=Material(albedo=COLOR))
    mirror = Object(shape="sphere", translate=(1.2, 0.0, 0.0), material=Material(mirror=0.9))
    found, objects = seen(ball, mirror)
    way, axis = way_and_axis()
    at = np.array(CAMERA.eye) + way * (found.depth / (way @ axis))[..., None]
    for number, middle in enumerate(((-1.0, 0.0, 0.0), (1.2, 0.0, 0.0))):
        chosen = (objects == number) & (np.linalg.norm(at - middle, axis=2) > 0.999)
        assert chosen.sum() > 100
        np.testing.assert_allclose(found.normal[chosen], (at - middle)[chosen], atol=5e-3)
    assert (found.albedo[objects == 1] == 0.0).all()


def test_textures_and_glossy_materials_have_their_albedo(tmp_path: object) -> None:
    """Half of the picture is red. A metal scatters nothing, and plastic less than its colour."""
    picture = np.zeros((2, 2, 3), np.float32)
    picture[:, 0, 0] = 1.0
    path = f"{tmp_path}/halves.exr"
    ldtrefl.save_image(path, picture)
    board = Object(shape="plane", scale=2.0, translate=(0.0, 1.0, -0.8), material=Material(texture=path, albedo=0.5))
    metal = Object(shape="sphere", scale=0.6, translate=(-1.2, 0.0, 0.0), material=Material(albedo=COLOR, metallic=1.0))
    plastic = Object(shape="sphere", scale=0.6, translate=(1.4, 0, 0), material=Material(albedo=COLOR, roughness=0.5))
    found, objects = seen(board, metal, plastic)
    assert set(np.unique(found.albedo[objects == 0][:, 0].round(3))) >= {0.0, 0.5}
    assert (found.albedo[objects == 0][:, 1:] == 0.0).all()
    assert (found.albedo[objects == 1] < 1e-6).all()
    share = found.albedo[objects == 2] / np.float32(COLOR)
    assert 0.5 < share.min() and share.max() < 0.97
