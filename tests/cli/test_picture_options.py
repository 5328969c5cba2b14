"""``ldtrefl render``: options of the picture."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

import ldtrefl
from ldtrefl.files.tone_mapping import shown
from tests.cli.conftest import Done

TABLE = '\n[picture]\nexposure = 1.0\ntone_mapping = "agx"\n'


def bytes_of(image: np.ndarray, exposure: float, tone_mapping: str) -> np.ndarray:
    return 255.0 * shown(image, exposure, tone_mapping)  # type: ignore[arg-type]


def stored(path: Path) -> np.ndarray:
    with Image.open(path) as picture:
        return np.asarray(picture, float)


def test_the_scene_says_how_it_is_developed_and_the_command_line_wins(
    run: Callable[..., Done], scene_folder: Path
) -> None:
    """Dithered values are within one step."""
    path = scene_folder / "scene.toml"
    path.write_text(path.read_text() + TABLE)
    image = ldtrefl.render(ldtrefl.load_scene(path)).image
    assert run("render", "scene.toml").status == 0
    assert np.abs(stored(scene_folder / "scene.png") - bytes_of(image, 1.0, "agx")).max() < 1.0
    assert run("render", "scene.toml", "--tone-mapping", "none", "--exposure", "-2").status == 0
    assert np.abs(stored(scene_folder / "scene.png") - bytes_of(image, -2.0, "none")).max() <= 0.501
    assert run("render", "scene.toml", "-o", "a.exr").status == 0
    np.testing.assert_array_equal(ldtrefl.load_image(scene_folder / "a.exr"), image)


def test_files_are_as_the_options_say(run: Callable[..., Done], scene_folder: Path) -> None:
    done = run("render", "scene.toml", "-o", "a.png", "--bits", "16")
    assert done.status == 0 and not done.errors
    assert oiio.ImageBuf(str(scene_folder / "a.png")).spec().format == oiio.UINT16
    for quality in ("30", "95"):
        assert run("render", "scene.toml", "-o", f"{quality}.jpg", "--quality", quality).status == 0
    assert (scene_folder / "30.jpg").stat().st_size < (scene_folder / "95.jpg").stat().st_size


def test_a_transparent_picture(run: Callable[..., Done], scene_folder: Path) -> None:
    frame = ldtrefl.render(ldtrefl.load_scene(scene_folder / "scene.toml"))
    assert run("render", "scene.toml", "-o", "a.png", "--transparent").status == 0
    np.testing.assert_array_equal(stored(scene_folder / "a.png")[..., 3], 255 * frame.alpha)
    assert 0.1 < frame.alpha.mean() < 0.9
    assert run("render", "scene.toml", "-o", "a.exr", "--transparent").status == 0
    pixels = oiio.ImageBuf(str(scene_folder / "a.exr")).get_pixels(oiio.FLOAT)
    np.testing.assert_array_equal(pixels, frame.cutout)


@pytest.mark.parametrize("options", [(), ("--transparent",)])
def test_layers(run: Callable[..., Done], scene_folder: Path, options: tuple[str, ...]) -> None:
    done = run("render", "scene.toml", "--layers", *options)
    assert done.status == 0 and "scene.exr: 24 x 16" in done.output
    frame = ldtrefl.render(ldtrefl.load_scene(scene_folder / "scene.toml"))
    expected = frame.cutout[..., :3] if options else frame.image
    np.testing.assert_array_equal(ldtrefl.load_image(scene_folder / "scene.exr"), expected)
    names = oiio.ImageBuf(str(scene_folder / "scene.exr")).spec().channelnames
    assert {"R", "G", "B", "A", "Z", "direct.R", "reflection_1.B", "normal.Z", "object_id.X"} <= set(names)


def test_a_scene_file_that_is_saved_keeps_the_picture(run: Callable[..., Done], scene_folder: Path) -> None:
    (scene_folder / "thing.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n")
    options = ("--size", "24x16", "--tone-mapping", "aces", "--exposure", "0.5", "--save-scene", "made.toml")
    assert run("render", "thing.obj", *options).status == 0
    assert ldtrefl.load_scene(scene_folder / "made.toml").picture == ldtrefl.Picture(exposure=0.5, tone_mapping="aces")
    assert run("render", "made.toml").status == 0
    assert (scene_folder / "made.png").read_bytes() == (scene_folder / "thing.png").read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("-o", "a.jpg", "--transparent"), "a.jpg: a JPEG cannot be transparent, PNG, WebP and EXR can"),
        (("-o", "a.png", "--layers"), "a.png: layers are written as EXR: the name must end in .exr"),
        (("-o", "a.exr", "--exposure", "1"), "a.exr: exposure goes with PNG, JPEG and WebP"),
        (("--layers", "--tone-mapping", "agx"), "scene.exr: tone_mapping goes with PNG, JPEG and WebP"),
        (("--bits", "12"), "scene.png: bits: should be 8 or 16, got 12"),
        (("--quality", "90"), "scene.png: quality goes with JPEG and WebP"),
        (("--tone-mapping", "agX"), "scene.png: tone_mapping: should be 'none', 'agx' or 'aces', got 'agX'"),
        (("--exposure", "inf"), "scene.png: exposure: should be a finite number, got inf"),
    ],
)
def test_what_does_not_go_together_is_one_line(
    run: Callable[..., Done], scene_folder: Path, options: tuple[str, ...], message: str
) -> None:
    done = run("render", "scene.toml", *options)
    assert done.status == 2 and len(done.errors) == 1 and message in done.errors[0], done
    assert sorted(path.name for path in scene_folder.iterdir()) == ["scene.toml"]
