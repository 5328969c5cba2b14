"""The layers of a picture, in closed form, and what they add up to."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.frame import visibility
from ldtrefl.frame.layers import Layers, coverage, joined_cutout
from ldtrefl.frame.result import Frame
from tests import frame_scenes
from tests.frame import flat_mirror

SUM_ERROR = 1e-5
NAMES = ["beauty", "alpha", "direct", "reflection_1", "depth", "normal", "albedo", "object_id", "hit_distance"]


def total(layers: Layers) -> np.ndarray:
    return layers["direct"] + sum(layer for name, layer in layers.items() if name.startswith("reflection_"))


@pytest.fixture(scope="module")
def mirrored() -> tuple[Frame, Layers]:
    """The flat mirror under a box that mirrors it, three bounces."""
    frame = ldtrefl.render(flat_mirror.scene((0.1, 0.2, 0.8), 0.5), "bvh", max_bounces=3, least_weight=0.0, samples=1)
    return frame, frame.layers()


def test_layers_have_their_names_sizes_and_types(mirrored: tuple[Frame, Layers]) -> None:
    frame, layers = mirrored
    assert list(layers) == [*NAMES[:4], "reflection_2", "reflection_3", *NAMES[4:]]
    size = frame.image.shape[:2]
    for name, layer in layers.items():
        assert layer.dtype == np.float32 and layer.shape in (size, (*size, 3)), name
    np.testing.assert_array_equal(layers["beauty"], frame.image)
    layers["beauty"][:] = -1.0
    assert frame.image.min() >= 0.0, "layers are the caller's"
    layers["beauty"][:] = frame.image


def test_direct_light_and_reflections_bounce_by_bounce_are_the_known_ones(mirrored: tuple[Frame, Layers]) -> None:
    _, layers = mirrored
    given = flat_mirror.scene((0.1, 0.2, 0.8), 0.5)
    expected = flat_mirror.reflection(given, 3)
    picked = {name: layer.reshape(-1, *layer.shape[2:])[expected.pixels] for name, layer in layers.items()}
    np.testing.assert_allclose(picked["direct"], np.tile(flat_mirror.GROUND_DIRECT, (len(expected.pixels), 1)))
    met = expected.object == flat_mirror.BOX
    first = np.where(met[:, None], flat_mirror.BOX_DIRECT, flat_mirror.environment(expected.direction))
    np.testing.assert_allclose(picked["reflection_1"], flat_mirror.GROUND_MIRROR * first, rtol=3e-5)
    again = met & (expected.later_object[:, 0] == flat_mirror.GROUND)
    assert again.sum() > 20 and not met.all()
    second = flat_mirror.GROUND_MIRROR * 0.5 * flat_mirror.GROUND_DIRECT
    np.testing.assert_allclose(picked["reflection_2"][again], np.tile(second, (again.sum(), 1)), rtol=2e-4)
    assert (picked["reflection_2"][~met] == 0.0).all()
    np.testing.assert_allclose(picked["hit_distance"], expected.distance, rtol=1e-5)
    assert (picked["object_id"] == flat_mirror.GROUND).all() and (picked["alpha"] == 1.0).all()


def test_where_nothing_is_seen(mirrored: tuple[Frame, Layers]) -> None:
    frame, layers = mirrored
    empty = layers["alpha"] == 0.0
    assert 0.1 < empty.mean() < 0.9
    np.testing.assert_array_equal(frame.alpha, layers["alpha"])
    np.testing.assert_array_equal(layers["direct"][empty], frame.image[empty])
    for name, value in (("object_id", -1.0), ("depth", np.inf), ("hit_distance", np.inf), ("normal", 0.0)):
        assert (layers[name][empty] == value).all(), name


@pytest.mark.parametrize("samples", [1, 4, 16])
@pytest.mark.parametrize("method", ["ldt", "bvh", "envmap"])
def test_direct_light_and_reflections_add_up_to_the_image(method: str, samples: int) -> None:
    """Pixels of several samples, too: layers are sampled and filtered as the image is."""
    frame = ldtrefl.render(frame_scenes.scene(), method, samples=samples)
    layers = frame.layers()
    assert layers["reflection_1"].max() > 0.1 and (frame.sample_counts.max() > 1) == (samples > 1)
    np.testing.assert_array_equal(layers["beauty"], frame.image)
    np.testing.assert_allclose(total(layers), layers["beauty"], atol=SUM_ERROR)


def test_alpha_is_a_mean_and_what_stands_for_centres_is_not() -> None:
    """Every sample is looked at, so that alpha is that of sixteen times as fine an image, filtered."""
    one, many = (ldtrefl.render(frame_scenes.scene(), "bvh", samples=samples).layers() for samples in (1, 16))
    for name in ("depth", "normal", "albedo", "object_id", "hit_distance"):
        np.testing.assert_array_equal(many[name], one[name], err_msg=name)
    steps = (many["alpha"] > 0.01) & (many["alpha"] < 0.99)
    assert set(np.unique(one["alpha"])) == {0.0, 1.0} and steps.any()
    assert abs(many["alpha"].mean() - one["alpha"].mean()) < 2e-3


def test_layers_of_looks_add_up_too() -> None:
    """Glossy plastic and rough metal: part of what they reflect is environment, in ``direct``."""
    given = frame_scenes.scene()
    materials = [ldtrefl.Material(metallic=1.0, roughness=0.1), ldtrefl.Material(roughness=0.4)]
    changed = [dataclasses.replace(entry, material=m) for entry, m in zip(given.objects[2:4], materials, strict=True)]
    glossy = dataclasses.replace(given, objects=(*given.objects[:2], *changed, given.objects[4]))
    layers = ldtrefl.render(glossy, "bvh").layers()
    np.testing.assert_allclose(total(layers), layers["beauty"], atol=SUM_ERROR)


def test_a_frame_without_mirrors_has_the_same_layers() -> None:
    given = frame_scenes.scene()
    layers = ldtrefl.render(dataclasses.replace(given, objects=given.objects[1:]), "ldt").layers()
    assert list(layers) == NAMES and not layers["reflection_1"].any() and np.isinf(layers["hit_distance"]).all()
    np.testing.assert_array_equal(layers["direct"], layers["beauty"])


def test_layers_are_those_of_the_frame_whatever_has_moved_since() -> None:
    renderer = ldtrefl.Renderer(frame_scenes.scene(), "ldt")
    frame = renderer.render()
    renderer.move("knot", translate=(1.5, -1.0, 0.6))
    assert (renderer.render().image != frame.image).any()
    np.testing.assert_allclose(total(frame.layers()), frame.image, atol=SUM_ERROR)


@pytest.mark.parametrize("samples", [1, 4])
def test_bands_make_the_layers_of_the_whole_image(monkeypatch: pytest.MonkeyPatch, samples: int) -> None:
    """The last bounces are of some bands alone."""
    frame = ldtrefl.render(frame_scenes.scene(), "bvh", samples=samples)
    whole = frame.layers()
    monkeypatch.setattr(visibility, "BAND_PIXELS", 16 * 160)
    in_bands = frame.layers()
    assert list(in_bands) == list(whole)
    for name, layer in whole.items():
        np.testing.assert_array_equal(in_bands[name], layer, err_msg=name)


def test_layers_that_need_too_much_memory_are_refused() -> None:
    frame = ldtrefl.render(frame_scenes.scene(), "bvh")
    tall = dataclasses.replace(frame, image=np.zeros((40_000, 160, 3), np.float32))
    budget.set_memory_limit(150 << 20)
    with pytest.raises(ldtrefl.InputError, match=r"the layer direct of 160 x 40000 pixels needs .*camera\.width"):
        tall.layers()


def test_a_cutout_leaves_out_what_lies_behind(mirrored: tuple[Frame, Layers]) -> None:
    frame, layers = mirrored
    made = frame.layers(cutout=True)
    np.testing.assert_allclose(np.dstack([made["beauty"], made["alpha"]]), frame.cutout, atol=1e-6)
    np.testing.assert_allclose(total(made), made["beauty"], atol=SUM_ERROR)
    assert list(made) == list(layers) and (made["direct"][made["alpha"] == 0.0] == 0.0).all()
    assert coverage(np.array([-1, 0, 5])).tolist() == [0.0, 1.0, 1.0]


def test_a_cutout_that_needs_too_much_memory_is_refused() -> None:
    budget.set_memory_limit(100 << 20)
    with pytest.raises(ldtrefl.InputError, match=r"a cutout of 4000 x 3000 pixels needs .*camera\.width"):
        joined_cutout((3000, 4000), [])
