"""The maps of a scene: peeled when they are first needed, kept by resolution, and bound as a frame chooses them."""

import dataclasses
import logging

import pytest

import ldtrefl
from ldtrefl.base.notices import warn_once
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.ldt.options import DEFAULT_RESOLUTION, Quality
from ldtrefl.ldt.scene_maps import RESOLUTIONS_KEPT, MapKey, MapOptions, SceneMaps
from ldtrefl.scene import shapes
from ldtrefl.world.device_scene import DeviceScene

OPTIONS = MapOptions(search="exact", quality="balanced", linear_steps="texel", binary_steps=8, resolution=64)


@pytest.fixture
def scene() -> DeviceScene:
    shapes = (ldtrefl.Object(shape="sphere"), ldtrefl.Object(shape="torus"), ldtrefl.Object(shape="box"))
    camera = ldtrefl.Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)
    return DeviceScene(ldtrefl.Scene(camera=camera, objects=shapes), launch.resolve_device(None))


def test_only_what_is_needed_is_peeled(scene: DeviceScene) -> None:
    maps, stats = SceneMaps(OPTIONS), Stats()
    tracer = maps.bound(scene, {1}, stats)
    assert stats.counters["objects_peeled"] == 1 and maps.meshes_without_maps(scene) == 2
    assert maps.bound(scene, {1}, stats) is tracer and stats.counters["objects_peeled"] == 1
    assert maps.bound(scene, {0, 1}, stats) is not tracer and stats.counters["objects_peeled"] == 2
    assert maps.has_usual_maps(scene, {0, 1}) and not maps.has_usual_maps(scene, {2})


def test_the_resolutions_used_last_are_kept(scene: DeviceScene) -> None:
    maps, stats, mesh = SceneMaps(OPTIONS), Stats(), scene.objects[0].geometry
    for resolution in range(16, 16 + RESOLUTIONS_KEPT + 2):
        maps.chosen = {mesh: resolution}
        maps.bound(scene, {0}, stats)
    maps.drop_old_maps()
    assert [key.resolution for key in maps._maps] == list(range(18, 18 + RESOLUTIONS_KEPT))
    assert stats.counters["objects_peeled"] == RESOLUTIONS_KEPT + 2


def test_coarser_maps_are_trusted_and_finer_ones_are_not_searched_exactly(scene: DeviceScene) -> None:
    maps, mesh = SceneMaps(OPTIONS), scene.objects[0].geometry
    for chosen, resolution, trusted in ((32, 32, True), (64, 64, False), (128, 64, False)):
        maps.chosen = {mesh: chosen}
        maps.bound(scene, {0}, Stats())
        assert MapKey(mesh, resolution, "balanced", trusted) in maps._maps
    assert len(maps._maps) == 2


@pytest.mark.parametrize("quality", ["balanced", "fast"])
def test_a_mirror_is_searched_for_triangle_by_triangle(quality: Quality) -> None:
    """Of a fine knot patches stand for the triangles, but not where rays leave it, nor where it is seen as a mirror."""
    camera = ldtrefl.Camera(eye=(0, -9, 0), look_at=(0, 0, 0), width=4, height=4)
    fine = {"segments": [3000, 60]}
    for material, has_patches in ((ldtrefl.Material(), True), (ldtrefl.Material(mirror=0.5), False)):
        knot = ldtrefl.Object(shape="torus_knot", params=fine, material=material)
        scene = DeviceScene(ldtrefl.Scene(camera=camera, objects=(knot,)), launch.resolve_device(None))
        maps = SceneMaps(dataclasses.replace(OPTIONS, quality=quality))
        maps.chosen = {scene.objects[0].geometry: 32}  # coarse maps, where patches would stand for most
        maps.bound(scene, {0}, Stats())
        (texture,) = maps._maps.values()
        assert texture.tree.patches == has_patches


def test_objects_share_the_maps_of_their_mesh_and_those_without_need_none() -> None:
    """A ray is met by either box through the same maps; nothing of the torus is peeled, and nothing is met of it."""
    camera = ldtrefl.Camera(eye=(0, -9, 0), look_at=(0, 0, 0), width=4, height=4)
    boxes = [ldtrefl.Object(shape="box", scale=0.5, translate=(x, 0, 0)) for x in (-2.0, 2.0)]
    torus = ldtrefl.Object(shape="torus", translate=(0, 4, 0))
    twice = DeviceScene(ldtrefl.Scene(camera=camera, objects=(*boxes, torus)), launch.resolve_device(None))
    maps, stats = SceneMaps(OPTIONS), Stats()
    tracer = maps.bound(twice, {0, 1}, stats)
    assert stats.counters["objects_peeled"] == 1 and maps.meshes_without_maps(twice) == 1
    assert tracer.tracer.name == "exact" and tracer.views.shape == (3,)


def test_what_was_peeled_for_other_frames_has_no_part_in_this_one(scene: DeviceScene) -> None:
    maps, mesh = SceneMaps(OPTIONS), scene.objects[0].geometry
    usual = maps.bound(scene, {0}, Stats())
    maps.chosen = {mesh: 32}
    coarse = maps.bound(scene, {0}, Stats())
    assert (
        coarse is not usual
        and maps._bound is not None
        and maps._bound.maps[mesh] is maps._maps[MapKey(mesh, 32, "balanced", True)]
    )
    maps.chosen = {}
    stats = Stats()
    maps.bound(scene, {0}, stats)
    assert (
        maps._bound.maps[mesh] is maps._maps[MapKey(mesh, 64, "balanced", False)]
        and "objects_peeled" not in stats.counters
    )
    # At a resolution that has not been peeled, and for rays that cannot meet it, the object is bound without maps.
    maps.chosen = {mesh: 16}
    maps.bound(scene, {1}, stats)
    assert maps._bound.maps[mesh] is None and stats.counters["objects_peeled"] == 1


def test_an_unusual_resolution_is_not_the_usual_one(scene: DeviceScene) -> None:
    maps, mesh = SceneMaps(OPTIONS), scene.objects[0].geometry
    assert maps.usual == 64 and SceneMaps(dataclasses.replace(OPTIONS, resolution=None)).usual == DEFAULT_RESOLUTION
    maps.chosen = {mesh: 32}
    maps.bound(scene, {0}, Stats())
    assert not maps.has_usual_maps(scene, {0}) and maps.meshes_without_maps(scene) == 2


def test_the_papers_search_says_once_which_objects_are_open(caplog: pytest.LogCaptureFixture) -> None:
    """Of two objects with the same mesh the first is named; the default search says nothing."""
    warn_once.cache_clear()
    bowl = ldtrefl.Object(name="a bowl", shape="bowl", params={"closed": False, "segments": [12, 4]})
    ball = shapes.make("sphere", {"segments": [12, 6]})
    turned = ball.faces.copy()
    turned[7] = turned[7][::-1]
    objects = (
        ldtrefl.Object(name="a ball", mesh=ball),
        bowl,
        dataclasses.replace(bowl, name="another bowl"),
        ldtrefl.Object(name="a ball, turned", mesh=ldtrefl.Mesh(ball.vertices, turned)),
    )
    camera = ldtrefl.Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)
    scene = DeviceScene(ldtrefl.Scene(camera=camera, objects=objects), launch.resolve_device(None))
    said: list[list[str]] = []
    with caplog.at_level(logging.WARNING, "ldtrefl"):
        for search, times in (("exact", 1), ("linear", 2)):
            for resolution in (32, 64)[:times]:
                maps = SceneMaps(dataclasses.replace(OPTIONS, search=search, resolution=resolution))
                maps.bound(scene, range(4), Stats())
                said.append([record.getMessage().partition(":")[0] for record in caplog.records])
    expected = [f"object '{name}' is open, or wound both ways" for name in ("a bowl", "a ball, turned")]
    assert said == [[], expected, expected]
