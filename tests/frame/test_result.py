"""Frames: what is made when it is asked for, once, as the caller's own; whole and in bands."""

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame import visibility
from ldtrefl.frame.bounce_hits import FirstHits
from ldtrefl.frame.camera_shading import shade_gbuffer
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import FrameParts
from ldtrefl.frame.layers import LightBand, light_of
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.frame.result import BandedFrame, Frame, WholeFrame, inner_rows, rows_of
from ldtrefl.frame.visibility import draw_gbuffer, draw_in_bands
from ldtrefl.scene.description import Scene
from ldtrefl.tracing.nothing import no_shadows
from ldtrefl.world.camera import Band, CameraView
from tests.frame import flat_mirror


class CountedSource:
    """Gives pictures, and counts how often it is asked."""

    def __init__(self) -> None:
        self.asked: list[str] = []

    def reflection(self) -> np.ndarray:
        self.asked.append("reflection")
        return np.ones((2, 3, 3), np.float32)

    def reflector_mask(self) -> np.ndarray:
        self.asked.append("reflector_mask")
        return np.ones((2, 3), bool)

    def hits(self) -> FirstHits | None:
        self.asked.append("hits")
        return None

    def cutout(self, image: np.ndarray) -> np.ndarray:
        self.asked.append("cutout")
        return np.concatenate([image, np.full((2, 3, 1), 0.5, np.float32)], axis=2)

    def layers(self, image: np.ndarray, *, cutout: bool) -> dict[str, np.ndarray]:
        self.asked.append("layers of a cutout" if cutout else "layers")
        return {"beauty": image}


def test_what_a_frame_gives_is_made_once_and_when_it_is_asked_for() -> None:
    source = CountedSource()
    frame = Frame(np.zeros((2, 3, 3), np.float32), Stats(), source)
    assert source.asked == []
    assert frame.reflection is frame.reflection and frame.reflector_mask is frame.reflector_mask
    assert frame.hits is None and frame.hits is None
    assert frame.alpha is frame.alpha and frame.cutout is frame.cutout and (frame.alpha == 0.5).all()
    assert source.asked == ["reflection", "reflector_mask", "hits", "cutout"]


def test_layers_are_made_anew_each_time() -> None:
    source = CountedSource()
    frame = Frame(np.ones((2, 3, 3), np.float32), Stats(), source)
    assert frame.layers() is not frame.layers() and frame.layers(cutout=True)["beauty"] is frame.image
    assert source.asked == ["layers", "layers", "layers of a cutout"]


def no_bands(cutout: bool) -> Iterator[LightBand]:
    raise AssertionError("nothing is rendered again")


def test_a_whole_frame_has_radiance_at_its_pixels() -> None:
    device = launch.resolve_device(None)
    pixels = wp.array([4, 1], dtype=wp.int32, device=device)
    radiance = wp.array([(1, 2, 3), (4, 5, 6)], dtype=wp.vec3, device=device)
    reflector = wp.array([0, 1, 0, 0, 1, 0], dtype=wp.uint8, device=device)
    seen = wp.array([-1, 7, 0, -1, 2, -1], dtype=wp.int32, device=device)
    whole = WholeFrame((2, 3), pixels, radiance, reflector, seen, CameraView(), None, None, no_bands)
    expected = np.zeros((2, 3, 3), np.float32)
    expected[1, 1], expected[0, 1] = (1, 2, 3), (4, 5, 6)
    np.testing.assert_array_equal(whole.reflection(), expected)
    assert whole.reflector_mask().tolist() == [[False, True, False], [False, True, False]] and whole.hits() is None
    cutout = whole.cutout(np.full((2, 3, 3), 4.0, np.float32))
    assert cutout[..., 3].tolist() == [[0.0, 1.0, 1.0], [0.0, 1.0, 0.0]] and cutout.dtype == np.float32
    np.testing.assert_array_equal(cutout[..., 0], 4.0 * cutout[..., 3])
    whole.reflector_mask()[:] = True
    assert reflector.numpy().tolist() == [0, 1, 0, 0, 1, 0], "the mask is the caller's"


def parts_of(gbuffer: GBuffer, bounces: int, *, has_rays: bool = True) -> FrameParts:
    """A band, its reflections by ray casting."""
    shaded = shade_gbuffer(gbuffer, no_shadows(gbuffer.scene.device), starts_rays=True)
    follower = flat_mirror.follower(gbuffer, bounces)
    followed = follower.follow(shaded.rays, follower.first_regions(shaded.rays))
    hits = FirstHits.of(gbuffer, followed) if has_rays else None
    return FrameParts(gbuffer, shaded, ReflectedLight(followed.radiance, hits), ())


def banded(
    monkeypatch: pytest.MonkeyPatch, given: Scene | None = None, bounces: int = 1, *, has_rays: bool = True
) -> BandedFrame:
    """The flat mirror's image in bands of 16 rows, of which the first see no mirror."""
    scene = flat_mirror.on_device(given or flat_mirror.scene())
    camera = scene.scene.camera
    monkeypatch.setattr(visibility, "BAND_PIXELS", 16 * camera.width)

    def bands() -> Iterator[FrameParts]:
        for gbuffer in draw_in_bands(scene, camera):
            yield parts_of(gbuffer, bounces, has_rays=has_rays)

    mask = np.empty((camera.height, camera.width), bool)
    for parts in bands():
        mask[rows_of(parts.gbuffer)] = parts.gbuffer.reflector_mask
    assert not mask[0].any() and mask[20].any() and mask[-10].any()

    def light(cutout: bool) -> Iterator[LightBand]:
        for parts in bands():
            yield LightBand(parts, *inner_rows(parts.gbuffer.band, camera, 0), light_of(parts, bounces, cutout=cutout))

    return BandedFrame(mask, np.ones(mask.shape, np.uint16), bands, light)


def test_bands_make_the_pictures_of_the_whole_image(monkeypatch: pytest.MonkeyPatch) -> None:
    frame, expected = banded(monkeypatch), flat_mirror.reflection(flat_mirror.scene())
    reflection, hits = frame.reflection(), frame.hits()
    np.testing.assert_allclose(reflection.reshape(-1, 3)[expected.pixels], expected.radiance, rtol=2e-5)
    assert (reflection[~frame.reflector_mask()] == 0.0).all()
    assert hits is not None
    np.testing.assert_allclose(hits.distance.ravel()[expected.pixels], expected.distance, rtol=1e-5)
    np.testing.assert_array_equal(hits.object.ravel()[expected.pixels], expected.object)
    assert (hits.object[~frame.reflector_mask()] == -1).all()


def test_bands_make_the_later_hits_of_the_whole_image(monkeypatch: pytest.MonkeyPatch) -> None:
    """The last bounces are of some bands alone."""
    given, bounces = flat_mirror.scene(place=(0.1, 0.2, 0.8), box_mirror=0.5), 4
    frame, expected = banded(monkeypatch, given, bounces), flat_mirror.reflection(given, bounces)
    hits = frame.hits()
    assert hits is not None and len(hits.later) == bounces - 1
    numbers = [len(parts.reflected.hits.later) for parts in frame.render_bands() if parts.reflected.hits is not None]
    assert min(numbers) < bounces - 1 == max(numbers)
    for k, bounce in enumerate(hits.later):
        for found, known in (
            (bounce.followed, expected.later_followed),
            (bounce.object, expected.later_object),
        ):
            np.testing.assert_array_equal(found.ravel()[expected.pixels], known[:, k])
        known_distance = expected.later_distance[:, k]
        np.testing.assert_allclose(bounce.distance.ravel()[expected.pixels], known_distance, rtol=1e-5)


def test_bands_make_the_cutout_of_the_whole_image(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = draw_gbuffer(flat_mirror.on_device(flat_mirror.scene()), flat_mirror.CAMERA).objects
    image = ldtrefl.render(flat_mirror.scene(), "bvh", max_bounces=1).image
    made = banded(monkeypatch).cutout(image)
    np.testing.assert_array_equal(made[..., 3], (seen >= 0).astype(np.float32))
    np.testing.assert_allclose(made[..., :3], image * (seen >= 0)[..., None], atol=1e-6)


@pytest.mark.parametrize(("first_row", "rows", "inside"), [(0, 18, (0, 16)), (14, 20, (16, 32)), (30, 22, (32, 52))])
def test_rows_that_bands_are_right_for(first_row: int, rows: int, inside: tuple[int, int]) -> None:
    """Of an image of 52 rows, in bands of 16 that go on for 2, if the image does."""
    in_image, in_band = inner_rows(Band(first_row, rows), flat_mirror.CAMERA, 2)
    assert (in_image.start, in_image.stop) == inside
    assert (in_band.start + first_row, in_band.stop + first_row) == inside


def test_bands_of_a_method_without_rays_have_no_hits(monkeypatch: pytest.MonkeyPatch) -> None:
    assert banded(monkeypatch, has_rays=False).hits() is None


def test_pictures_of_bands_that_need_too_much_memory_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    frame = banded(monkeypatch)
    wide = dataclasses.replace(frame, mask=np.ones((4000, 4000), bool))
    budget.set_memory_limit(150 << 20)
    with pytest.raises(ldtrefl.InputError, match=r"the reflection in an image of 4000 x 4000 pixels needs .*MiB"):
        wide.reflection()
    with pytest.raises(ldtrefl.InputError, match=r"the reflected rays of an image of 4000 x 4000 .*camera\.width"):
        wide.hits()
