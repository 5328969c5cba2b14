"""Layers in an EXR: names and values as OpenImageIO and OpenEXR find them, and what is refused."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

import ldtrefl
from ldtrefl import save_layers


def layers() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(0)
    colors = ("beauty", "direct", "reflection_1", "normal", "albedo")
    values = ("alpha", "depth", "object_id", "hit_distance")
    made = {name: rng.random((20, 30, 3)).astype(np.float32) for name in colors}
    made |= {name: rng.random((20, 30)).astype(np.float32) for name in values}
    made["depth"][0] = np.inf
    return made


EXPECTED = {
    **{letter: ("beauty", k) for k, letter in enumerate("RGB")},
    "A": ("alpha", None),
    "Z": ("depth", None),
    **{
        f"{name}.{letter}": (name, k) for name in ("direct", "reflection_1", "albedo") for k, letter in enumerate("RGB")
    },
    **{f"normal.{letter}": ("normal", k) for k, letter in enumerate("XYZ")},
    "object_id.X": ("object_id", None),
    "hit_distance.Z": ("hit_distance", None),
}
"""Channel -> (layer, which of its three numbers)."""


def assert_channels(channels: dict[str, np.ndarray]) -> None:
    assert set(channels) == set(EXPECTED)
    for channel, (layer, number) in EXPECTED.items():
        given = layers()[layer]
        np.testing.assert_array_equal(channels[channel], given if number is None else given[..., number], channel)


def test_openimageio_finds_them(tmp_path: Path) -> None:
    save_layers(tmp_path / "a.exr", layers())
    reader = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    spec, pixels = reader.spec(), np.asarray(reader.read_image(oiio.FLOAT))
    assert not reader.seek_subimage(1, 0), "one part"
    reader.close()
    assert spec.channelnames[:5] == ("R", "G", "B", "A", "Z") and (spec.alpha_channel, spec.z_channel) == (3, 4)
    assert spec.format == oiio.FLOAT and spec.get_string_attribute("oiio:ColorSpace").startswith("lin")
    assert_channels({name: pixels[..., k] for k, name in enumerate(spec.channelnames)})


def test_openexr_finds_them(tmp_path: Path) -> None:
    openexr = pytest.importorskip("OpenEXR")
    save_layers(tmp_path / "a.exr", layers())
    with openexr.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        (part,) = file.parts
        assert_channels({name: channel.pixels for name, channel in part.channels.items()})


def test_the_picture_of_it_is_its_beauty(tmp_path: Path) -> None:
    save_layers(tmp_path / "a.exr", layers())
    np.testing.assert_array_equal(ldtrefl.load_image(tmp_path / "a.exr"), layers()["beauty"])


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        ("a.png", layers(), r"a\.png: layers are written as EXR: the name must end in \.exr"),
        ("a.exr", {}, r"a\.exr: there are no layers to write"),
        ("a.exr", {"a.b": np.zeros((2, 2))}, r"a\.exr: layer 'a\.b': a name is letters, digits and _"),
        ("a.exr", {"": np.zeros((2, 2))}, r"a\.exr: layer '': a name is letters, digits and _"),
        ("a.exr", {"a": np.zeros((2, 2)), "b": np.zeros((2, 3))}, r"layer 'b': an array is \(height, width\) or"),
        ("a.exr", {"a": np.zeros((2, 2, 4))}, r"layer 'a': an array is \(height, width\) or \(height, width, 3\)"),
        ("a.exr", {"a": np.zeros((0, 2))}, r"layer 'a': an array is \(height, width\) or"),
        ("a.exr", {"a": np.zeros(2)}, r"layer 'a': an array is \(height, width\) or"),
        ("a.exr", {"beauty": np.zeros((2, 2))}, r"a\.exr: layer 'beauty': it has 3 channels, not 1"),
        ("none/a.exr", layers(), r"a\.exr: the folder .*none does not exist"),
    ],
)
def test_what_is_not_allowed_is_one_line(tmp_path: Path, name: str, given: dict[str, np.ndarray], message: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=message):
        save_layers(tmp_path / name, given)
    assert not list(tmp_path.iterdir())
