"""Images of mirrors: what is not drawn shows the environment, and what is drawn is seen only through its mirror."""

import dataclasses

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.methods.virtual.image import VirtualImage
from ldtrefl.tracing.nothing import no_shadows
from tests.frame import flat_mirror


def test_where_nothing_is_drawn_mirrors_show_the_environment() -> None:
    given = flat_mirror.scene()
    scene = flat_mirror.on_device(given)
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    image = VirtualImage(gbuffer, shaded.rays)
    assert list(image.reflectors) == [flat_mirror.GROUND]
    found = image.reflected(no_shadows(scene.device)).radiance.numpy()
    direction = shaded.rays.direction.numpy().astype(float)
    np.testing.assert_allclose(found, flat_mirror.environment(direction), atol=1e-5)


def test_vertices_that_are_not_seen_are_not_drawn_and_the_mirror_itself_is_never() -> None:
    scene = flat_mirror.on_device(flat_mirror.scene())
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    image, asked = VirtualImage(gbuffer, shaded.rays), []

    def none_is_seen(points: wp.array, vertices: wp.array) -> None:
        asked.append(points.numpy().copy())
        vertices.zero_()

    image.draw(flat_mirror.GROUND, none_is_seen)
    (points,) = asked
    half = np.abs(flat_mirror.in_world(scene, points) - scene.scene.objects[flat_mirror.BOX].translate)
    np.testing.assert_allclose(half, flat_mirror.BOX_HALF, atol=1e-6)
    reflected = image.reflected(no_shadows(scene.device))
    assert reflected.hits is not None and (reflected.hits.object == -1).all()


def test_memory_that_is_not_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(needed: int, what: str, smaller: str) -> None:
        if "virtual" in what:
            raise ldtrefl.InputError(f"{what}: {needed} bytes")

    monkeypatch.setattr(budget, "take", refuse)
    with pytest.raises(ldtrefl.InputError, match="virtual vertices"):
        ldtrefl.render(flat_mirror.scene(), "planar")


def test_layers_and_what_is_skipped_change_nothing() -> None:
    given = flat_mirror.scene(box_mirror=0.5)
    frame = ldtrefl.render(given, "planar")
    np.testing.assert_array_equal(ldtrefl.render(given, "planar", skip="none").image, frame.image)
    np.testing.assert_allclose(frame.layers()["beauty"], frame.image, atol=1e-5)
    smaller = dataclasses.replace(given.camera, width=30, height=20)
    assert ldtrefl.Renderer(given, "planar").render(smaller).image.shape == (20, 30, 3)
