"""The maps of a scene: peeled when they are first needed, kept by resolution, and bound as a frame chooses them."""

import pytest

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.ldt.scene_maps import RESOLUTIONS_KEPT, MapOptions, SceneMaps
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
    assert [resolution for _, resolution, _ in maps._maps] == list(range(18, 18 + RESOLUTIONS_KEPT))
    assert stats.counters["objects_peeled"] == RESOLUTIONS_KEPT + 2


def test_coarser_maps_are_trusted_and_finer_ones_are_not_searched_exactly(scene: DeviceScene) -> None:
    maps, mesh = SceneMaps(OPTIONS), scene.objects[0].geometry
    for chosen, key in ((32, (mesh, 32, True)), (64, (mesh, 64, False)), (128, (mesh, 64, False))):
        maps.chosen = {mesh: chosen}
        maps.bound(scene, {0}, Stats())
        assert key in maps._maps
    assert len(maps._maps) == 2
