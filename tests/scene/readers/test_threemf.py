"""3MF files: objects where they are built, in millimetres, with the colours and pictures that triangles have."""

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

import ldtrefl

NAMESPACES = (
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02" '
    'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
)
VERTICES = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in ((0, 0, 0), (1, 0, 0), (0, 1, 0)))
TRIANGLE = '<triangle v1="0" v2="1" v3="2"/>'


def mesh_object(number: int, triangles: str = TRIANGLE, more: str = "") -> str:
    mesh = f"<mesh><vertices>{VERTICES}</vertices><triangles>{triangles}</triangles></mesh>"
    return f'<object id="{number}" type="model" {more}>{mesh}</object>'


def loaded(folder: Path, resources: str, build: str, unit: str = "", **files: bytes | str) -> ldtrefl.Mesh:
    """The mesh of a 3MF file, with other files in its archive: 'a_png' stands for 3D/a.png."""
    model = f'<?xml version="1.0"?><model {unit} {NAMESPACES}><resources>{resources}</resources>'
    with zipfile.ZipFile(folder / "a.3mf", "w") as archive:
        archive.writestr("3D/3dmodel.model", f"{model}<build>{build}</build></model>")
        for name, data in files.items():
            archive.writestr(f"3D/{name.replace('_', '.')}", data)
    return ldtrefl.load_mesh(folder / "a.3mf")


def test_objects_stand_where_they_are_built(tmp_path: Path) -> None:
    """Two items and an object of two components, one of them mirrored; an inch has 25.4 millimetres."""
    parts = (
        '<component objectid="1" transform="1 0 0 0 1 0 0 0 1 0 0 5"/>'
        '<component objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>'
    )
    resources = mesh_object(1) + f'<object id="2"><components>{parts}</components></object>'
    build = '<item objectid="1" transform="0 1 0 -1 0 0 0 0 1 10 20 30"/><item objectid="2"/>'
    mesh = loaded(tmp_path, resources, build)
    turned, raised, mirrored = mesh.vertices[mesh.faces]
    np.testing.assert_allclose(turned, [[10, 20, 30], [10, 21, 30], [9, 20, 30]])
    np.testing.assert_allclose(raised, [[0, 0, 5], [1, 0, 5], [0, 1, 5]])
    a, b, c = mirrored
    np.testing.assert_allclose(np.cross(b - a, c - a), [0, 0, 1])
    inches = loaded(tmp_path, resources, build, 'unit="inch"')
    np.testing.assert_allclose(inches.vertices, 25.4 * mesh.vertices)
    with pytest.raises(ldtrefl.InputError, match=r"a\.3mf: .*unit 'mile', allowed are micron"):
        loaded(tmp_path, resources, build, 'unit="mile"')


def test_colors_of_corners_triangles_and_objects(tmp_path: Path) -> None:
    colors = '<m:colorgroup id="5"><m:color color="#FF0000"/><m:color color="#00FF0080"/></m:colorgroup>'
    base = '<basematerials id="6"><base name="b" displaycolor="#0000FF"/></basematerials>'
    triangles = (
        '<triangle v1="0" v2="1" v3="2" pid="5" p1="0" p2="1" p3="0"/>'
        '<triangle v1="0" v2="1" v3="2" pid="5" p1="1"/><triangle v1="0" v2="1" v3="2"/>'
    )
    mesh = loaded(tmp_path, colors + base + mesh_object(1, triangles, 'pid="6" pindex="0"'), '<item objectid="1"/>')
    red, green, blue = [1, 0, 0, 1], [0, 1, 0, 128 / 255], [0, 0, 1, 1]
    white = [1, 1, 1, 1]
    np.testing.assert_allclose(mesh.colors[mesh.faces], [[red, green, red], [green] * 3, [white] * 3], atol=1e-6)
    assert [part.material.base_color for part in mesh.parts] == [(1, 1, 1), tuple(blue[:3])]


def test_base_materials_are_parts_of_their_names(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A ball of two materials is smooth over their border."""
    ball = trimesh.creation.icosphere(3)
    is_upper = ball.triangles_center[:, 2] > 0
    base = (
        '<basematerials id="6"><base name="unused"/><base name="Red PLA" displaycolor="#FF0000"/>'
        '<base name="Blue PLA" displaycolor="#0000FF80"/></basematerials>'
    )
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in ball.vertices)
    triangles = "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}"' + (' pid="6" p1="2"/>' if upper else "/>")
        for (a, b, c), upper in zip(ball.faces, is_upper, strict=True)
    )
    mesh_text = f"<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>"
    resources = base + f'<object id="1" pid="6" pindex="1">{mesh_text}</object>'
    mesh = loaded(tmp_path, resources, '<item objectid="1"/>')
    named = {part.material.name: part.material.base_color for part in mesh.parts}
    assert named == {"Red PLA": (1, 0, 0), "Blue PLA": (0, 0, 1)} and mesh.colors is None
    assert "not shown: alpha of its colours" in caplog.text
    first = {part.material.name: part.first_triangle for part in mesh.parts}
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    upper = np.roll(np.arange(len(mesh.faces)) < is_upper.sum(), first["Blue PLA"])
    np.testing.assert_array_equal(centres[:, 2] > 0, upper)
    np.testing.assert_allclose(mesh.normals, mesh.vertices, atol=0.01)
    (tmp_path / "a.toml").write_text(
        "[camera]\neye = [0, -5, 0]\nlook_at = [0, 0, 0]\n"
        '[[object]]\nmesh = "a.3mf"\nparts = { "Blue*" = { mirror = 0.9 } }\n'
    )
    entry = ldtrefl.load_scene(tmp_path / "a.toml").objects[0]
    assert entry.material_of("Blue PLA").mirror[0] == 0.9 and entry.material_of("Red PLA").mirror[0] == 0


def test_pictures_are_parts(tmp_path: Path) -> None:
    stream = io.BytesIO()
    Image.new("RGB", (2, 2), (9, 8, 7)).save(stream, "PNG")
    texture = (
        '<m:texture2d id="7" path="/3D/a.png" contenttype="image/png" tilestyleu="mirror"/>'
        '<m:texture2dgroup id="8" texid="7"><m:tex2coord u="0" v="0.25"/><m:tex2coord u="1" v="2"/></m:texture2dgroup>'
    )
    triangles = '<triangle v1="0" v2="1" v3="2" pid="8" p1="0" p2="1" p3="1"/>' + TRIANGLE
    resources = texture + mesh_object(1, triangles)
    mesh = loaded(tmp_path, resources, '<item objectid="1"/>', a_png=stream.getvalue())
    picture = mesh.parts[0].material.base_texture
    assert len(mesh.parts) == 2 and picture is not None and picture.wrap == ("mirror", "repeat")
    assert (picture.picture.pixels == [9, 8, 7]).all() and mesh.parts[1].material.base_texture is None
    np.testing.assert_allclose(mesh.uvs[mesh.faces[0]], [[0, 0.25], [1, 2], [1, 2]])


def test_models_of_several_files_are_one(tmp_path: Path) -> None:
    """The production extension; each file has a unit of its own."""
    other = f'<model unit="centimeter" {NAMESPACES}><resources>{mesh_object(1)}</resources></model>'
    build = '<item objectid="1" p:path="/3D/b.model" transform="1 0 0 0 1 0 0 0 1 0 0 3"/>'
    mesh = loaded(tmp_path, "", build, b_model=other)
    np.testing.assert_allclose(mesh.vertices[mesh.faces[0]], [[0, 0, 3], [10, 0, 3], [0, 10, 3]])


def test_what_is_not_shown_is_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    extra = '<m:multiproperties id="9" pids="5 6"/><m:texture2d id="7" path="/3D/none.png"/>'
    loaded(tmp_path, extra + mesh_object(1), '<item objectid="1"/>')
    assert "not shown: the element 'multiproperties'" in caplog.text
    assert "not shown: the picture '3D/none.png'" in caplog.text


def test_what_it_requires_and_supports_are_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Of the extensions that a file requires those that are read are not (core specification 2.3.1)."""
    space = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"
    support = mesh_object(2).replace('type="model"', 'type="support"')
    head = f'requiredextensions="m p b" xmlns:b="{space}"'
    mesh = loaded(tmp_path, mesh_object(1) + support, '<item objectid="1"/><item objectid="2"/>', head)
    assert len(mesh.faces) == 1
    assert [record.getMessage().partition("not shown: ")[2] for record in caplog.records] == [
        f"the extension '{space}' that it requires",
        "objects of the type 'support'",
    ]


@pytest.mark.parametrize(
    ("resources", "says"),
    [
        ("", "the mesh has no triangles"),
        (mesh_object(1, TRIANGLE.replace('"2"', '"3"')), "triangle 0 has a vertex that there is not"),
        ("<object", "is not XML"),
    ],
)
def test_what_is_wrong_is_a_line(tmp_path: Path, resources: str, says: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=rf"a\.3mf: .*({says})"):
        loaded(tmp_path, resources, '<item objectid="1"/>')


def test_entities_are_not_unfolded(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.3mf", "w") as archive:
        archive.writestr("3D/3dmodel.model", '<!DOCTYPE m [<!ENTITY a "b">]><model>&a;</model>')
    with pytest.raises(ldtrefl.InputError, match="document type"):
        ldtrefl.load_mesh(tmp_path / "a.3mf")


def made_of(number: int, other: int, times: int) -> str:
    """An object that is another one, some times over."""
    component = f'<component objectid="{other}"/>'
    return f'<object id="{number}"><components>{component * times}</components></object>'


def test_objects_of_objects_come_to_an_end(tmp_path: Path) -> None:
    """A chain of doublings, and an object that is made of itself."""
    chain = mesh_object(1) + "".join(made_of(k, k - 1, 2) for k in range(2, 30))
    with pytest.raises(ldtrefl.InputError, match=r"a\.3mf: more than 100000 objects are placed"):
        loaded(tmp_path, chain, '<item objectid="29"/>')
    with pytest.raises(ldtrefl.InputError, match=r"a\.3mf: objects are made of each other more than 32 deep"):
        loaded(tmp_path, made_of(1, 1, 1), '<item objectid="1"/>')
