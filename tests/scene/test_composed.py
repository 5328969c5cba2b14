"""Objects -> a scene to look at."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl import Camera, Light, Material, Object
from ldtrefl.scene.composed import BESIDE_OWN_LIGHTS, composed
from ldtrefl.scene.stages import CHROME, STAGES, STUDIO
from ldtrefl.scene.studio import studio_lighting, studio_lights

THING = Object(name="thing", shape="torus_knot", params={"segments": [96, 16]})
LIGHT = Light(kind="point", position=(1.0, 2.0, 3.0), intensity=5.0)
CAMERA = Camera(eye=(0.0, -9.0, 0.0), look_at=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("on", [None, *STAGES])
def test_objects_stay_where_they_are_and_come_first(on: str | None) -> None:
    scene = composed((THING, dataclasses.replace(THING, translate=(3.0, 0.0, 0.0))), on)
    assert scene.objects[1].translate == (3.0, 0.0, 0.0) and scene.objects[0].name == "thing"
    if on is None:
        assert scene.lights == studio_lights() and scene.lighting == studio_lighting()
    else:
        assert scene.lights == () and scene.environment == STUDIO and scene.lighting.shadows
    assert (len(scene.objects) == 2) == (on is None)


@pytest.mark.parametrize("on", [None, *STAGES])
@pytest.mark.parametrize(("scale", "offset"), [(1e-6, 1e-6), (1e6, 1e6), (1.0, 1e6), (1e6, 0.0), (1e-6, 1e6)])
def test_a_scene_of_any_size_and_place_looks_the_same(on: str | None, scale: float, offset: float) -> None:
    """To the digits that coordinates are written with."""
    base = ldtrefl.render(composed((THING,), on, size=(48, 32))).image
    moved = dataclasses.replace(THING, scale=scale, translate=(offset, -offset, offset))
    image = ldtrefl.render(composed((moved,), on, size=(48, 32))).image
    different = np.abs(image - base).max(axis=2) > 0.05
    assert different.mean() < 0.06, f"{different.mean():.3f} of the pixels differ"


def test_all_of_the_subject_is_in_the_picture() -> None:
    """No pixel of the edge sees it, and the middle does."""
    scene = composed((THING,), "studio")
    frame = ldtrefl.render(scene)
    alone = ldtrefl.render(composed((dataclasses.replace(THING, material=Material(albedo=0.0)),), None)).image
    edge = np.concatenate([alone[0], alone[-1], alone[:, 0], alone[:, -1]])
    assert (edge > 0.1).all() and (alone.max(axis=2) == 0.0).mean() > 0.1
    assert frame.image.max() < 1.0


def test_its_own_lights_and_camera_count_without_a_stage() -> None:
    own = composed((THING,), None, lights=(LIGHT,), camera=CAMERA)
    assert own.lights == (LIGHT,) and own.camera == CAMERA and own.lighting == BESIDE_OWN_LIGHTS
    staged = composed((THING,), "studio", lights=(LIGHT,), camera=CAMERA)
    assert staged.lights == () and staged.camera != CAMERA
    sized = composed((THING,), None, camera=CAMERA, size=(10, 20)).camera
    assert sized == dataclasses.replace(CAMERA, width=10, height=20)
    assert composed((THING,), None, lights=(LIGHT,)).camera == composed((THING,), None).camera


def test_chrome_is_a_mirror_on_any_stage() -> None:
    scene = composed((THING,), "mirror-ball", mirror_self=True)
    assert scene.objects[0].material == CHROME and scene.objects[2].is_reflector
    assert composed((THING,), None, mirror_self=True).objects[0].is_reflector


def test_an_unknown_stage_is_refused() -> None:
    with pytest.raises(ldtrefl.InputError, match=r"^unknown stage 'mirror-bal'; did you mean 'mirror-ball'\?"):
        composed((THING,), "mirror-bal")
