"""What a glTF file holds, in words: every kind of thing, and what is not shown."""

import io
import re

import numpy as np
from rich.console import Console

from ldtrefl.cli.gltf_listing import listing
from ldtrefl.cli.material_listing import MOST_ROWS
from ldtrefl.scene.gltf.asset import Asset
from tests.scene.gltf.writer import QUAD, Written, nothing_beside


def said(file: Written) -> str:
    """The listing as text, with one blank between words."""
    console = Console(file=io.StringIO(), width=200)
    for part in listing(Asset.read(file.as_glb(), nothing_beside)):
        console.print(part)
    assert isinstance(console.file, io.StringIO)
    return re.sub(r"[\s│]+", " ", console.file.getvalue())


def test_everything_is_named() -> None:
    file = Written(
        materials=[{"name": "paint", "pbrMetallicRoughness": {"roughnessFactor": 0.25}, "alphaMode": "BLEND"}],
        cameras=[{"type": "perspective", "perspective": {"yfov": 0.5}, "name": "front"}],
        extensions={"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 7, "name": "bulb"}]}},
        extensionsUsed=["KHR_lights_punctual", "KHR_materials_sheen"],
    )
    file.quad(attributes={"TEXCOORD_0": file.accessor(np.zeros((4, 2), np.float32))}, material=0)
    file.tree["nodes"][0] |= {"name": "sheet", "scale": [2, 3, 1]}
    file.tree["nodes"] += [{"camera": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}]
    text = said(file)
    for line in (
        "1 nodes with meshes, 2 triangles",
        "sheet 2 1 UVs 4 x 3 x 0",
        "paint 1 1 1 1 0.25 blend front none",
        "camera 'front': at 0 0 0, fov_y 28.65",
        "light 'bulb': point, 7 7 7 candela",
        "extensions: KHR_lights_punctual, KHR_materials_sheen",
        "not shown: KHR_materials_sheen",
    ):
        assert line in text


def test_a_file_of_many_nodes_is_cut_short() -> None:
    file = Written()
    number = file.mesh({"POSITION": file.accessor(QUAD[:3])})
    file.tree["nodes"] += [{"mesh": number}] * (MOST_ROWS + 4)
    text = said(file)
    assert f"{MOST_ROWS + 5} nodes with meshes" in text and "... and 5 more" in text
