"""Frames of scenes whose objects have looks: methods agree, history changes no bit, parts reflect by themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ldtrefl
from ldtrefl.compare.metrics.structural_similarity import ssim
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Light, Lighting, Material, Object, Scene
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.surface_material import SurfaceMaterial, Texture
from tests.frame_scenes import assert_as_fresh

METHODS = ["ldt", "bvh"]
GLTF = SurfaceMaterial(name="of a file", specular=1.0)
BUMPS = np.random.default_rng(5).integers(96, 160, (16, 16, 3), dtype=np.uint8) | np.array([0, 0, 224], np.uint8)
HOLES = np.where(np.indices((16, 16)).sum(axis=0) % 2 == 0, 255, 0).astype(np.uint8)


def with_material(shape: str, material: SurfaceMaterial, **params: object) -> Mesh:
    mesh = shapes.make(shape, params)
    return Mesh(mesh.vertices, mesh.faces, mesh.normals, mesh.uvs, (Part(0, material),))


def scene(*, shadows: bool = True) -> Scene:
    """A polished floor with a metal ball, a rough one, a varnished one, one with bumps, a pierced and a clear one."""
    bumpy = replace(GLTF, metallic=1.0, roughness=0.1, normal_texture=Texture(StoredPicture(BUMPS), is_data=True))
    white = np.full((16, 16, 3), 255, np.uint8)
    pierced = replace(GLTF, alpha_mode="mask", base_texture=Texture(StoredPicture(white, HOLES), is_nearest=True))
    varnished = replace(GLTF, base_color=(0.6, 0.1, 0.1), roughness=0.6, clearcoat=1.0)
    clear = replace(GLTF, base_color=(0.1, 0.6, 0.2), roughness=0.0, alpha=0.3, alpha_mode="blend")
    segments = [48, 24]
    balls = {
        "metal": {"shape": "sphere", "material": Material(albedo=(1.0, 0.77, 0.34), metallic=1.0)},
        "rough": {"shape": "sphere", "material": Material(albedo=0.9, metallic=1.0, roughness=0.5)},
        "varnished": {"mesh": with_material("sphere", varnished, segments=segments)},
        "bumpy": {"mesh": with_material("sphere", bumpy, segments=segments)},
        "pierced": {"mesh": with_material("sphere", pierced, segments=segments)},
        "clear": {"mesh": with_material("sphere", clear, segments=segments)},
    }
    placed = [
        Object(name=name, scale=0.45, translate=(1.1 * (k % 3) - 1.1, 1.2 * (k // 3) - 0.6, 0.46), **given)
        for k, (name, given) in enumerate(balls.items())
    ]
    floor = Object(name="floor", shape="plane", scale=4.0, material=Material(albedo=0.3, roughness=0.05))
    light = Light(kind="point", position=(-2.0, -3.0, 5.0), intensity=(25.0, 25.0, 25.0))
    camera = Camera(eye=(0.5, -4.5, 1.8), look_at=(0, 0, 0.3), width=128, height=96, fov_y=40)
    lit = Lighting(ambient=(0.2, 0.2, 0.2), shadows=shadows)
    return Scene(camera=camera, lighting=lit, lights=(light,), objects=(floor, *placed))


@pytest.mark.parametrize("shadows", [False, True])
def test_both_methods_agree(shadows: bool) -> None:
    found, truth = (ldtrefl.render(scene(shadows=shadows), method).image for method in METHODS)
    assert ssim(found, truth, np.ones(truth.shape[:2], bool)) >= 0.999
    assert np.isfinite(found).all()


@pytest.mark.parametrize("method", METHODS)
def test_frames_with_history_are_those_of_a_new_renderer(method: str) -> None:
    renderer = ldtrefl.Renderer(scene(shadows=False), method)
    renderer.render()
    for name, place in (("metal", (0.0, 0.2, 0.7)), ("clear", (0.3, 0.3, 0.9)), ("clear", (0.2, 0.3, 0.9))):
        renderer.move(name, translate=place)
        assert_as_fresh(renderer, renderer.render(), method)


def test_parts_reflect_by_themselves() -> None:
    """Of a square of a matt and a metal triangle only one is a reflector."""
    corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    parts = (Part(0, replace(GLTF, specular=0.0)), Part(1, replace(GLTF, metallic=1.0, roughness=0.1)))
    thing = Object(mesh=Mesh(corners, [[0, 1, 2], [0, 2, 3]], parts=parts))
    camera = Camera(eye=(0, 0, 5), look_at=(0, 0, 0), up=(0, 1, 0), width=8, height=8, fov_y=15)
    frame = ldtrefl.render(Scene(camera=camera, objects=(thing,)), "bvh")
    assert frame.reflector_mask[0, 0] and not frame.reflector_mask[-1, -1]
    assert 0 < frame.stats.counters["rays"] < 64
