"""What pixels cover of surfaces, and the rays that leave mirrors, against the rays of the pixels beside them."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.gbuffer import GBufferView, sight
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.shading.ray_footprint import meet_along
from ldtrefl.shading.surface import Surface
from ldtrefl.shading.surfaces import Sighting, look_from
from ldtrefl.world.records import ObjectRecord
from tests.frame import flat_mirror

CAMERA = Camera(eye=(0.4, -5.0, 1.5), look_at=(0.0, 0.0, 0.1), width=480, height=400, fov_y=26.0)


def mirror(shape: str, **params: object) -> Scene:
    """A mirror, turned and stretched."""
    thing = Object(shape=shape, rotate=(1, 2, 3, 50), material=Material(mirror=1.0), **params)
    return Scene(camera=CAMERA, objects=(thing,))


@pytest.mark.parametrize(
    "given",
    [mirror("sphere", scale=(1.0, 1.4, 0.8), params={"segments": [256, 128]}), mirror("plane", smooth=False)],
    ids=["ellipsoid", "plane"],
)
def test_the_rays_that_leave_a_mirror_know_their_neighbours(given: Scene) -> None:
    """Half of the way from the ray of the pixel before to that of the next one, where all three leave one triangle."""
    scene = flat_mirror.on_device(given, needs_footprints=True)
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    pixels, triangles = shaded.rays.pixel.numpy(), shaded.rays.source_triangle.numpy()
    footprints, number_of = shaded.rays.footprint.numpy(), np.full(gbuffer.pixel_count + CAMERA.width, -1)
    number_of[pixels] = np.arange(len(pixels))
    direction, origin = shaded.rays.direction.numpy().astype(float), shaded.rays.origin.numpy()
    cosine = np.abs((direction * gbuffer.surfaces[1].numpy()[pixels]).sum(axis=1))
    for axis, step in (("x", 1), ("y", CAMERA.width)):
        before, after = number_of[pixels - step], number_of[pixels + step]
        chosen = (before >= 0) & (after >= 0) & (cosine > 0.2)
        chosen &= (triangles[before] == triangles) & (triangles[after] == triangles)
        before, after = before[chosen], after[chosen]
        assert chosen.sum() > 500
        place, turn = (origin[after] - origin[before]) / 2, (direction[after] - direction[before]) / 2
        found = footprints[f"place_{axis}"][chosen]
        np.testing.assert_allclose(found, place, atol=0.002 * np.abs(place).max())
        found = footprints[f"turn_{axis}"][chosen]
        np.testing.assert_allclose(found, turn, atol=0.01 * np.abs(turn).max())


@launch.kernel
def find_spread(
    first: int,
    # In:
    gbuffer: GBufferView,
    objects: wp.array(dtype=ObjectRecord),
    pixel: int,
    place_x: wp.vec3,
    place_y: wp.vec3,
    # Out:
    sightings_out: wp.array(dtype=Sighting),
    surfaces_out: wp.array(dtype=Surface),
):
    """Find by how much barycentrics change to two places about what a pixel sees."""
    sight(gbuffer, pixel, sightings_out, 0)
    look_from(objects, 1, gbuffer.camera.eye, sightings_out, surfaces_out)
    sightings_out[0].t = 0.0
    sightings_out[0].footprint.place_x = place_x
    sightings_out[0].footprint.place_y = place_y
    meet_along(objects, 1, sightings_out, surfaces_out)


def test_barycentrics_change_as_the_way_along_the_edges() -> None:
    given = mirror("plane", scale=(2.0, 0.5, 1.0))
    scene = flat_mirror.on_device(given)
    gbuffer, _ = flat_mirror.seen_and_shaded(scene)
    pixel = int(np.flatnonzero(gbuffer.objects.ravel() == 0)[0])
    mesh, matrix = scene.meshes[0], scene.device_from_world @ scene.world_from_unit[0]
    corners = mesh.vertices.numpy()[mesh.faces.numpy()[gbuffer.triangles.ravel()[pixel]]] @ matrix[:3, :3].T
    ways = np.array([[0.3, -0.2], [0.05, 0.7]]) @ (corners[1:] - corners[0])
    device = scene.device
    sightings, surfaces = wp.zeros(8, dtype=Sighting, device=device), wp.zeros(8, dtype=Surface, device=device)
    inputs = [gbuffer.view, scene.records, pixel, wp.vec3(*ways[0]), wp.vec3(*ways[1]), sightings, surfaces]
    launch.launch(find_spread, 1, inputs, device)
    np.testing.assert_allclose(sightings.numpy()["spread"][0], [0.3, -0.2, 0.05, 0.7], rtol=1e-5)
