"""Parts of a scene moved as a whole look the same from a camera that moves with them."""

import numpy as np

import ldtrefl
from ldtrefl.scene.description import Camera, Light, Lighting, Object, Scene
from ldtrefl.scene.scene_parts import SceneParts


def rendered(parts: SceneParts) -> np.ndarray:
    """What the first camera sees of parts, lit by their lights alone."""
    lit = Lighting(ambient=0.0, shadows=True)
    scene = Scene(camera=parts.cameras[0], lighting=lit, lights=parts.lights, objects=parts.objects)
    return ldtrefl.render(scene, "bvh").image


def test_moved_parts_look_the_same_to_a_moved_camera() -> None:
    camera = Camera(eye=(0, -4, 1), look_at=(0, 0, 0), width=48, height=32)
    lights = (
        Light(kind="point", position=(1, -2, 2), intensity=3.0),
        Light(kind="directional", direction=(1, 1, -1), radiance=1.0),
        Light(kind="spot", position=(-2, -2, 1), direction=(2, 2, -1), intensity=4.0, radius=0.1),
        Light(kind="sphere", position=(-1, 1, 2), radius=0.3, radiance=5.0),
        Light(kind="rectangle", position=(0, -2, -1), direction=(0, 2, 1), up=(1, 1, 0), width=1, height=2, radiance=1),
    )
    objects = (
        Object(name="ball", shape="sphere", scale=(0.5, 1.0, 0.7), rotate=(1, 1, 0, 30)),
        Object(name="box", shape="box", scale=0.3, translate=(1, 0, 0.5)),
    )
    parts = SceneParts(objects, lights, (camera,), ("",))
    matrix = np.eye(4)
    matrix[:3, :3] = 2.0 * np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    matrix[:3, 3] = [3, -1, 5]
    after = parts.moved(matrix)
    assert [entry.name for entry in after.objects] == ["ball", "box"]
    background = ldtrefl.render(Scene(camera=camera), "bvh").image
    before = rendered(parts)
    is_seen = np.abs(before - background).max(axis=2) > 1e-3
    difference = np.abs(rendered(after) - before).max(axis=2)
    assert is_seen.sum() > 100 and np.count_nonzero(difference[is_seen] > 1e-3) <= 5  # at edges rounding decides
