"""Any mesh as a mirror, and before mirrors: where every path goes, bounce by bounce, against brute force in float64."""

import functools

import numpy as np
import pytest
from stress_cases import chrome, meshes
from stress_cases.paths import Paths, paths_of

import ldtrefl
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene

BOUNCES = 4
MIRROR = Material(albedo=(0, 0, 0), mirror=(0.9, 0.9, 0.9))

MESHES = {
    **chrome.sheets(),
    **{name: mesh for name, mesh in meshes.made().items() if "dense" not in name and "sized" not in name},
}
"""Open and crossing sheets, edges of three triangles, holes, duplicates, needles, triangles without area, ..."""

FLAT_ONLY = ("coplanar overlaps",)
"""Where triangles with other vertex normals lie in one place, either may be met: with the facet's normal it is all one.
"""

SAME_PLACE = 1e-3
"""World units between two ends of a path that is the same: curved mirrors spread four float32 roundings so far."""

FEW = 2
"""Paths of a picture that may go another way: past an edge by less than rounding."""


def glowing(*color: float) -> Material:
    return Material(albedo=(0, 0, 0), emission=color)


def scene(name: str, role: str) -> Scene:
    """The mesh as a mirror between glowing things, or glowing between mirrors."""
    mesh, smooth = MESHES[name], role != "flat mirror" and name not in FLAT_ONLY
    turn = {"mesh": mesh, "rotate": (1, 0.2, 0, 70), "smooth": smooth}
    objects = (
        Object(**turn, fit=1.2, translate=(0.9, -1.2, 0.1), material=glowing(1, 0.6, 0.2)),
        Object(shape="plane", scale=4.0, translate=(0, 0, -1), material=MIRROR),
        Object(shape="sphere", params={"segments": [24, 12]}, translate=(-0.6, 0.3, 0), material=MIRROR),
    )
    if role != "before mirrors":
        objects = (
            Object(**turn, fit=2.4, material=MIRROR),
            Object(shape="plane", scale=5.0, translate=(0, 0, -1.6), material=glowing(0.2, 0.5, 0.9)),
            Object(shape="box", scale=0.4, translate=(-1.2, -1.2, 0.3), smooth=False, material=glowing(0.1, 0.9, 0.2)),
        )
    return Scene(
        camera=Camera(eye=(0.5, -5.0, 1.6), look_at=(0, 0, -0.1), fov_y=36.0, width=72, height=48),
        environment=Environment(sky=(0.9, 0.8, 1.0), ground=(0.1, 0.2, 0.1)),
        lighting=Lighting(ambient=(0, 0, 0)),
        objects=objects,
    )


@functools.cache
def truth(name: str, role: str) -> Paths:
    return paths_of(scene(name, role), BOUNCES)


@pytest.mark.parametrize("method", ["bvh", "ldt"])
@pytest.mark.parametrize("role", ["smooth mirror", "flat mirror", "before mirrors"])
@pytest.mark.parametrize("name", MESHES)
def test_paths_go_where_they_truly_go(name: str, role: str, method: str) -> None:
    frame, paths = ldtrefl.render(scene(name, role), method, max_bounces=BOUNCES), truth(name, role)
    assert np.isfinite(frame.image).all()
    off = np.abs(frame.image - paths.image).max(axis=2) > 1e-2
    assert off.sum() <= FEW, f"{off.sum()} pixels are off"
    if frame.hits is None:
        assert name == "needles" and len(paths.ends) == 1
        return
    same, tried = np.ones(off.shape, bool), 0
    ours = (frame.hits, *frame.hits.later)
    for hits, ends in zip(ours, paths.ends[1:], strict=False):
        assert (same & (hits.followed != ends.followed)).sum() <= FEW
        compared = same & hits.followed & ends.followed
        is_hit = compared & (ends.object >= 0) & (hits.object == ends.object)
        same = is_hit.copy()
        same[is_hit] = np.abs(hits.distance[is_hit] - ends.distance[is_hit]) <= SAME_PLACE
        wrong = (compared & (hits.object != ends.object)) | (is_hit & ~same)
        assert wrong.sum() <= FEW, f"{wrong.sum()} of {compared.sum()} paths end elsewhere"
        tried += int(compared.sum())
    assert tried > 100
