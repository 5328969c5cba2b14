"""Materials of MTL files: what each statement says, how pictures are laid, and a line for what is not shown."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import ldtrefl
from ldtrefl.scene.readers.mtl import MaterialLibrary
from ldtrefl.scene.readers.pictures import Pictures
from ldtrefl.scene.surface_material import SurfaceMaterial

RED, GREEN = (200, 10, 30), (20, 180, 60)


def png(*rows: list, mode: str = "RGB") -> bytes:
    """A picture of these rows of colours."""
    kind = np.uint16 if mode == "I;16" else np.uint8
    picture = Image.fromarray(np.array(rows, kind))
    if mode == "1":
        picture = picture.point(lambda value: 255 * (value > 0)).convert("1")
    elif mode == "P":
        picture = picture.convert("P", palette=Image.Palette.ADAPTIVE)
    stream = io.BytesIO()
    picture.save(stream, "PNG")
    return stream.getvalue()


def library(text: str, **files: bytes) -> MaterialLibrary:
    """The materials of a text, with pictures beside it: 'a_png' is called a.png."""
    beside = {name.replace("_", "."): data for name, data in files.items()}
    made = MaterialLibrary(Pictures(lambda name: beside[name]))
    made.add(text.encode())
    return made


def material(text: str, **files: bytes) -> SurfaceMaterial:
    """The only material of a text, of which nothing is left out."""
    made = library(f"newmtl a\n{text}", **files)
    found = made.material("a")
    assert found is not None and made.not_shown + made.pictures.not_shown == []
    return found


def test_numbers_of_a_material() -> None:
    """Colours are linear, as in Blender's files; Tr is what d lacks, and d counts where both are given."""
    plain = material("Ka 1 1 1\nKd 0.8 0.2 0.1\nKe 2 0 0\nNi 1.45\nillum 2\n")
    assert plain.base_color == (0.8, 0.2, 0.1) and plain.emission == (2, 0, 0) and plain.alpha_mode == "opaque"
    assert plain.specular == 0 and plain.metallic == 0, "without Ks it is matt"
    assert material("Kd 0.5\n").base_color == (0.5, 0.5, 0.5)
    for text, alpha in (("d 0.25\n", 0.25), ("Tr 0.25\n", 0.75), ("Tr 1\nd 1\n", 1.0), ("d -halo 0.5\n", 0.5)):
        made = material(text)
        assert made.alpha == alpha and made.alpha_mode == ("opaque" if alpha == 1 else "blend")


def test_reflection_follows_blender() -> None:
    """Its 0.5 is a reflectance of 0.04; illum 0 and 1 have none. Pr and Pm are glTF's."""
    made = material("Ks 0.5 0.5 0.5\nNs 250\nillum 2\n")
    assert (made.specular, made.specular_color, made.roughness) == (1.0, (1, 1, 1), 0.5)
    made = material("Ks 0.1 0.2 0.05\nNs 1000\n")
    f0 = 0.04 * made.specular * np.array(made.specular_color)
    np.testing.assert_allclose(f0, 0.08 * np.array([0.1, 0.2, 0.05]))
    assert made.roughness == 0 and material("Ks 1 1 1\nNs 10\nillum 1\n").specular == 0
    made = material("Kd 1 0.5 0\nPr 0.3\nPm 1\n")
    assert (made.metallic, made.roughness, made.specular) == (1, 0.3, 1)


def test_options_lay_a_picture() -> None:
    """-s scales and -o then moves texture coordinates whose v is 0 at the bottom; names may hold blanks."""
    beside = {"my wood.png": png([RED])}
    made = MaterialLibrary(Pictures(lambda name: beside[name]))
    made.add(b"newmtl a\nmap_Kd -clamp on -o 0.25 0.5 -s 2 4 1 my wood.png\nnewmtl b\nmap_Kd my wood.png # mine\n")
    texture = made.material("a").base_texture
    assert texture is not None and texture.wrap == ("clamp", "clamp")
    a, b, c, d, e, f = texture.transform
    for u, v in ((0.0, 0.0), (0.3, 0.9)):
        x, y = a * u + b * (1 - v) + c, d * u + e * (1 - v) + f
        np.testing.assert_allclose([x, 1 - y], [2 * u + 0.25, 4 * v + 0.5])
    assert made.material("b").base_texture.picture is texture.picture
    assert made.not_shown == made.pictures.not_shown == []


def test_pictures_of_every_kind() -> None:
    """16 bits of grey are not clipped; palettes and single bits are what they show; a black Kd is no colour of its."""
    made = material("Kd 0 0 0\nmap_Kd a.png\n", a_png=png([RED, GREEN], mode="P"))
    assert made.base_color == (1, 1, 1)
    np.testing.assert_array_equal(made.base_texture.picture.pixels, [[RED, GREEN]])
    grey = material("map_Kd a.png\n", a_png=png([0, 30000, 65535], mode="I;16")).base_texture.picture
    wanted = [0, ((30000 / 65535 + 0.055) / 1.055) ** 2.4, 1]
    np.testing.assert_allclose(grey.pixels[0, :, 1], wanted, atol=1e-6)
    bits = material("map_Kd a.png\n", a_png=png([0, 1], mode="1")).base_texture.picture
    np.testing.assert_array_equal(bits.pixels[0, :, 0], [0, 255])


def test_a_picture_of_alpha() -> None:
    """Its grey, or its own alpha; brought to the size of the colours; alone it is over white."""
    colors, mask = png([RED, GREEN]), png([0, 255])
    made = material("map_Kd a.png\nmap_d b.png\n", a_png=colors, b_png=mask)
    assert made.alpha_mode == "blend"
    np.testing.assert_array_equal(made.base_texture.picture.alpha, [[0, 255]])
    np.testing.assert_array_equal(made.base_texture.picture.pixels, [[RED, GREEN]])
    made = material("map_d b.png\n", b_png=mask)
    np.testing.assert_array_equal(made.base_texture.picture.alpha, [[0, 255]])
    both = png([(*RED, 40), (*GREEN, 50)], mode="RGBA")
    made = material("map_Kd a.png\nmap_d a.png\n", a_png=both)
    np.testing.assert_array_equal(made.base_texture.picture.alpha, [[40, 50]])
    made = material("map_Kd a.png\nmap_d b.png\n", a_png=png([RED] * 4, [RED] * 4), b_png=png([99]))
    np.testing.assert_array_equal(made.base_texture.picture.alpha, np.full((2, 4), 99))


def test_pictures_of_roughness_metal_normals_and_light() -> None:
    rough, metal = png([50, 60]), png([0, 255])
    made = material("map_Pr r.png\nmap_Pm m.png\n", r_png=rough, m_png=metal)
    both = made.metallic_roughness_texture
    assert both is not None and both.is_data and made.roughness == made.metallic == 1
    np.testing.assert_array_equal(both.picture.pixels[..., 1:], [[[50, 0], [60, 255]]])
    made = material("map_Pr r.png\nPm 0.5\n", r_png=rough)
    assert made.metallic == 0.5
    np.testing.assert_array_equal(made.metallic_roughness_texture.picture.pixels[..., 2], [[255, 255]])
    made = material("map_Bump -bm 0.4 n.png\n", n_png=png([(128, 128, 255)]))
    assert made.normal_texture is not None and made.normal_texture.is_data and made.normal_scale == 0.4
    made = material("map_Ke e.png\nKe 0 0 0\n", e_png=png([RED]))
    assert made.emission == (1, 1, 1) and made.emission_texture is not None


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("Kd 0.1 0.2 0.3\nmap_Kd b.png\n", "the picture 'b.png' (it is not beside the file)"),
        ("map_Kd bad.png\n", "the picture 'bad.png' (not a picture that can be read (PNG, JPEG or WebP))"),
        ("map_Bump a.png\n", "material 'a': map_bump (heights)"),
        ("disp a.png\n", "material 'a': disp"),
        ("Kd spectral a.rfl\n", "material 'a': kd spectral a.rfl (it should be numbers)"),
        ("map_Kd -mm 0 2 a.png\n", "material 'a': the option -mm of map_kd"),
        ("map_Kd\n", "material 'a': map_kd names no picture"),
        ("d 0\n", "material 'a': d or Tr makes it wholly transparent"),
        ("map_Kd alpha.png\n", "material 'a': the alpha of its picture (no map_d names it)"),
    ],
)
def test_what_is_not_shown_is_named(text: str, line: str) -> None:
    files = {"a_png": png([7, 9]), "bad_png": b"no", "alpha_png": png([(*RED, 9)], mode="RGBA")}
    made = library(f"newmtl a\n{text}", **files)
    found = made.material("a")
    assert found is not None and made.not_shown + made.pictures.not_shown == [line]
    assert found.base_color == ((0.1, 0.2, 0.3) if text.startswith("Kd 0.1") else (1, 1, 1)), "its plain colour"


def test_several_pictures_of_a_mesh(tmp_path: Path) -> None:
    """Each of its own material; a file named with another system's path is found beside the mesh, none outside."""
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "one.png").write_bytes(png([RED]))
    (inside / "two.png").write_bytes(png([GREEN]))
    (tmp_path / "out.png").write_bytes(png([RED]))
    (inside / "a.mtl").write_text(
        'newmtl a\nmap_Kd C:\\work\\one.png\nnewmtl b\nmap_Kd "two.png"\nnewmtl c\nmap_Kd ../out.png\n'
    )
    text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl {}\n"
    faces = "".join(f"usemtl {name}\nf 1/1 2/1 3/1\n" for name in "abc")
    (inside / "a.obj").write_text(text.format("c") + faces)
    one, two, none = (part.material.base_texture for part in ldtrefl.load_mesh(inside / "a.obj").parts)
    assert one.picture.pixels.tolist() == [[list(RED)]] and two.picture.pixels.tolist() == [[list(GREEN)]]
    assert none is None


def test_pictures_are_asked_for_before_they_are_unpacked(small_limit: None) -> None:
    with pytest.raises(ldtrefl.InputError, match="400 x 400 pixels needs"):
        material("map_Kd a.png\n", a_png=png(*[[RED] * 400] * 400))
