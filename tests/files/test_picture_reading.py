"""Pictures of every kind are read as what they mean, held against Pillow and against what was put into them."""

import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image, PngImagePlugin

import ldtrefl
from ldtrefl import InputError, load_image
from ldtrefl.base import budget
from ldtrefl.files.picture_reading import stored_picture
from ldtrefl.files.srgb import linear_from_srgb
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Material, Object, Scene
from ldtrefl.scene.mesh import Mesh, Part
from tests.part_materials import textured

COLOR = (200, 100, 50)
CLEAR = (*COLOR, 128)


def write(path: Path, pixels: np.ndarray, kind: Any, names: tuple[str, ...] = (), tile: int = 0, **said: Any) -> Path:
    """Write a picture by OpenImageIO, with channels of these names and attributes of the file."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    if names:
        spec.channelnames = names
    spec.tile_width = spec.tile_height = tile
    for key, value in said.items():
        spec.attribute(f"oiio:{key}", value)
    writer = oiio.ImageOutput.create(str(path))
    assert writer.open(str(path), spec) and writer.write_image(np.ascontiguousarray(pixels)) and writer.close()
    return path


def large_png(path: Path, side: int) -> Path:
    """A picture of one colour, ``side`` x ``side``, in a file a thousandth of its size."""
    squeezer = zlib.compressobj(9)
    row = b"\0" + bytes(COLOR) * side
    data = b"".join(squeezer.compress(row) for _ in range(side)) + squeezer.flush()
    parts = ((b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)), (b"IDAT", data), (b"IEND", b""))
    chunks = (struct.pack(">I", len(d)) + t + d + struct.pack(">I", zlib.crc32(t + d)) for t, d in parts)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))
    return path


@pytest.mark.parametrize("name", ["float.tif", "half.exr", "double.tif", "float.exr", "float.hdr"])
def test_floats_are_linear(tmp_path: Path, name: str) -> None:
    kind = {"half": oiio.HALF, "double": oiio.DOUBLE, "float": oiio.FLOAT}[Path(name).stem]
    path = write(tmp_path / name, np.full((4, 6, 3), 0.5), kind)
    np.testing.assert_array_equal(load_image(path), np.full((4, 6, 3), 0.5, np.float32))


def test_a_pfm_is_linear(tmp_path: Path) -> None:
    """Written byte by byte: its rows go from the bottom up."""
    image = np.random.default_rng(0).normal(size=(3, 5, 3)).astype("<f4")
    (tmp_path / "a.pfm").write_bytes(b"PF\n5 3\n-1.0\n" + image[::-1].tobytes())
    np.testing.assert_array_equal(load_image(tmp_path / "a.pfm"), image)


ENCODED = {
    "rgb.png": ("RGB", COLOR),
    "rgba.png": ("RGBA", CLEAR),
    "rgba.tga": ("RGBA", CLEAR),
    "rgba.tif": ("RGBA", CLEAR),
    "rgba.webp": ("RGBA", CLEAR),
    "rgba.bmp": ("RGBA", CLEAR),
    "rgba.jp2": ("RGBA", CLEAR),
    "nothing.png": ("RGBA", (*COLOR, 0)),
    "nothing.tga": ("RGBA", (*COLOR, 0)),
    "la.png": ("LA", (200, 128)),
    "l.png": ("L", 77),
    "l.jpg": ("L", 77),
    "bit.png": ("1", 1),
    "cmyk.jpg": ("CMYK", (10, 80, 120, 30)),
    "rgb.gif": ("RGB", COLOR),
    "rgb.tif": ("RGB", COLOR),
}


@pytest.mark.parametrize("name", sorted(ENCODED))
def test_integers_are_encoded_and_not_multiplied_by_alpha(tmp_path: Path, name: str) -> None:
    mode, color = ENCODED[name]
    exact = {"lossless": True, "exact": True} if name.endswith("webp") else {}
    Image.new(mode, (6, 4), color).save(tmp_path / name, **exact)
    truth = np.asarray(Image.open(tmp_path / name).convert("RGB"))
    stored = stored_picture(tmp_path / name).pixels
    assert stored.dtype == np.uint8
    np.testing.assert_array_equal(stored, truth)
    np.testing.assert_allclose(load_image(tmp_path / name), linear_from_srgb(truth / 255), atol=1e-6)
    if mode == "RGBA":
        np.testing.assert_array_equal(stored, np.broadcast_to(np.uint8(COLOR), (4, 6, 3)))


def test_a_palette_with_clear_colors(tmp_path: Path) -> None:
    picture = Image.new("P", (6, 4))
    picture.putpalette([*COLOR, *(0, 0, 0) * 255])
    picture.save(tmp_path / "a.png", transparency=bytes([128] * 256))
    stored = stored_picture(tmp_path / "a.png").pixels
    np.testing.assert_array_equal(stored, np.broadcast_to(np.uint8(COLOR), (4, 6, 3)))


@pytest.mark.parametrize("name", ["grey.png", "rgb.png", "rgb.tif"])
def test_sixteen_bits_keep_them(tmp_path: Path, name: str) -> None:
    values = np.arange(24, dtype=np.uint16).reshape(4, 6, 1) * 2700 + 11
    if name == "grey.png":
        Image.fromarray(values[..., 0]).save(tmp_path / name)
    else:
        write(tmp_path / name, values.repeat(3, axis=2), oiio.UINT16)
    expected = linear_from_srgb((values / 65535).repeat(3, axis=2))
    np.testing.assert_allclose(load_image(tmp_path / name), expected, rtol=1e-6)


def test_a_file_may_say_the_opposite(tmp_path: Path) -> None:
    for gamma, expected in ((1.0, 128 / 255), (1 / 2.2, linear_from_srgb(np.float32(128 / 255)))):
        said = PngImagePlugin.PngInfo()
        said.add(b"gAMA", struct.pack(">I", round(100_000 * gamma)))
        Image.new("RGB", (6, 4), (128, 128, 128)).save(tmp_path / "a.png", pnginfo=said)
        np.testing.assert_allclose(load_image(tmp_path / "a.png"), expected, atol=1e-6)
    for name in ("a.exr", "a.tif"):
        path = write(tmp_path / name, np.full((4, 6, 3), 0.5), oiio.FLOAT, ColorSpace="sRGB")
        np.testing.assert_allclose(load_image(path), linear_from_srgb(np.float32(0.5)), atol=1e-6)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("G", "Z", "B", "A", "R"), (0.5, 0.1, 0.3)),
        (("d.G", "d.Z", "d.B", "N.x", "d.R"), (0.5, 0.1, 0.3)),
        (("left.R", "R", "G", "B", "left.G"), (0.2, 0.3, 0.4)),
        (("RY", "Y", "BY"), (0.2, 0.2, 0.2)),
        (("Y", "A"), (0.1, 0.1, 0.1)),
        (("Z",), (0.1, 0.1, 0.1)),
    ],
)
@pytest.mark.parametrize("tile", [0, 16])
def test_channels_of_an_exr(tmp_path: Path, names: tuple[str, ...], expected: tuple[float, ...], tile: int) -> None:
    values = np.array([0.1, 0.2, 0.3, 0.4, 0.5], np.float32)[: len(names)]
    ramp = np.arange(40 * 35, dtype=np.float32).reshape(40, 35, 1)
    path = write(tmp_path / "a.exr", values * ramp, oiio.FLOAT, names, tile)
    np.testing.assert_array_equal(load_image(path), np.float32(expected) * ramp)


@pytest.mark.parametrize("name", ["a.exr", "a.png", "a.tif", "a.hdr", "a.jpg"])
def test_a_changed_byte_of_a_header(tmp_path: Path, name: str) -> None:
    """A picture or a line, whatever the byte is; in names and messages it may be no letter."""
    path = tmp_path / name
    if name == "a.jpg":
        Image.new("RGB", (6, 4), COLOR).save(path)
    else:
        write(path, np.full((4, 6, 3), 100), oiio.UINT8 if name == "a.png" else oiio.FLOAT)
    whole = path.read_bytes()
    refused = 0
    for place in range(min(len(whole), 240)):
        for value in (0xE7, 0xFF):
            path.write_bytes(whole[:place] + bytes([value]) + whole[place + 1 :])
            try:
                assert load_image(path).shape[2] == 3
            except InputError as error:
                assert str(path) in str(error)
                refused += 1
    assert refused


def test_what_is_no_number_is_refused_and_what_is_below_zero_is_kept(tmp_path: Path) -> None:
    path = write(tmp_path / "a.exr", np.full((4, 6, 3), -2.0), oiio.FLOAT)
    np.testing.assert_array_equal(load_image(path), np.full((4, 6, 3), -2.0, np.float32))
    for value in (np.nan, np.inf):
        path = write(tmp_path / "b.exr", np.full((4, 6, 3), value), oiio.FLOAT)
        with pytest.raises(InputError, match=r"b\.exr: the picture holds values that are not finite"):
            load_image(path)


def test_a_picture_stands_as_it_is_stored(tmp_path: Path) -> None:
    turned = Image.Exif()
    turned[0x112] = 6
    Image.new("RGB", (6, 4), COLOR).save(tmp_path / "a.jpg", exif=turned)
    assert load_image(tmp_path / "a.jpg").shape == (4, 6, 3)


def test_stored_pictures_are_shared_and_loaded_images_are_not(tmp_path: Path) -> None:
    path = write(tmp_path / "a.exr", np.full((4, 6, 3), 0.5), oiio.FLOAT)
    first = stored_picture(path)
    assert stored_picture(path) is first and not first.pixels.flags.writeable
    load_image(path)[:] = 7.0
    np.testing.assert_array_equal(load_image(path), np.full((4, 6, 3), 0.5, np.float32))
    write(path, np.full((5, 6, 3), 0.25), oiio.FLOAT)
    assert stored_picture(path).pixels.shape == (5, 6, 3)


def scene_of(texture: np.ndarray, environment: str) -> Scene:
    """A textured plane before a mirror ball under an environment's picture."""
    plane = shapes.make("plane", {})
    mesh = Mesh(plane.vertices, plane.faces, None, plane.uvs, (Part(0, textured(StoredPicture(texture))),))
    return Scene(
        camera=Camera(eye=(0, -5, 2), look_at=(0, 0, 0), width=48, height=32),
        environment=Environment(image=environment),
        objects=(
            Object(shape="sphere", params={"segments": [32, 16]}, material=Material(mirror=(0.9, 0.9, 0.9))),
            Object(mesh=mesh, scale=3.0, translate=(0.0, 0.0, -1.0)),
        ),
    )


def test_pictures_of_bytes_give_the_bits_of_pictures_of_floats(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (37, 53, 3), dtype=np.uint8)
    Image.fromarray(pixels).save(tmp_path / "a.png")
    floats = load_image(tmp_path / "a.png")
    write(tmp_path / "a.exr", floats, oiio.FLOAT)
    bytes_frame = ldtrefl.render(scene_of(pixels, str(tmp_path / "a.png")))
    floats_frame = ldtrefl.render(scene_of(floats, str(tmp_path / "a.exr")))
    np.testing.assert_array_equal(bytes_frame.image, floats_frame.image)
    assert np.ptp(bytes_frame.image) > 0.5


def test_large_pictures_are_asked_for_first(tmp_path: Path, small_limit: None) -> None:
    path = large_png(tmp_path / "a.png", 600)
    with pytest.raises(InputError, match=r"a\.png: a picture of 600 x 600 pixels needs 1\.0 MiB, allowed are 1\.0 MiB"):
        stored_picture(path)
    path = large_png(tmp_path / "b.png", 400)
    assert stored_picture(path).pixels.shape == (400, 400, 3)
    with pytest.raises(InputError, match=r"as floats a picture of 400 x 400 pixels needs 1\.8 MiB"):
        load_image(path)


@pytest.mark.parametrize("kind", ["jp2", "gif", "webp", "tga", "jpg"])
def test_pictures_that_are_unpacked_when_they_are_opened(tmp_path: Path, small_limit: None, kind: str) -> None:
    """A name that promises another format changes nothing."""
    for name in (f"a.{kind}", "a.png"):
        with (tmp_path / name).open("wb") as file:
            Image.new("RGB", (700, 600), COLOR).save(file, {"jp2": "jpeg2000", "jpg": "jpeg"}.get(kind, kind))
        with pytest.raises(InputError, match=r"a\.\w+: unpacking 700 x 600 pixels needs [14]\.\d MiB"):
            load_image(tmp_path / name)
    budget.set_memory_limit()
    assert load_image(tmp_path / "a.png").shape == (600, 700, 3)


PEAK = """
import sys
from pathlib import Path
from ldtrefl.files.picture_reading import stored_picture
peak = lambda: int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0]) << 10
own = peak()
picture = stored_picture(sys.argv[1]).pixels
print((peak() - own) / (picture.shape[0] * picture.shape[1]))
"""


@pytest.mark.skipif(not Path("/proc/self/status").is_file(), reason="no system to ask for the peak of memory")
def test_eight_bits_take_three_bytes_a_pixel(tmp_path: Path) -> None:
    """At the peak, in a process of its own: no copy, no floats. (Some rows at a time are in the half byte.)"""
    path = large_png(tmp_path / "a.png", 8192)
    done = subprocess.run([sys.executable, "-c", PEAK, str(path)], capture_output=True, text=True, check=True)
    assert 2.9 < float(done.stdout) < 3.5


def test_pictures_that_cannot_be_read(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    Image.fromarray(pixels).save(tmp_path / "a.png")
    whole = (tmp_path / "a.png").read_bytes()
    for length, fault in (
        (0, "not a picture"),
        (10, "not a picture"),
        (40, "not a picture"),
        (len(whole) // 2, "cut off"),
    ):
        (tmp_path / "cut.png").write_bytes(whole[:length])
        with pytest.raises(InputError, match=rf"cut\.png: .*{fault}"):
            load_image(tmp_path / "cut.png")
    with pytest.raises(InputError, match="no such picture"):
        load_image(tmp_path / "none.png")


@pytest.mark.parametrize("mode", ["L", "P", "RGBA", "1", "LA"])
def test_every_kind_of_png_is_read_as_rgb(tmp_path: Path, mode: str) -> None:
    Image.fromarray(np.full((4, 6, 3), 255, np.uint8)).convert(mode).save(tmp_path / "a.png")
    np.testing.assert_allclose(load_image(tmp_path / "a.png"), np.ones((4, 6, 3)), atol=1e-6)
