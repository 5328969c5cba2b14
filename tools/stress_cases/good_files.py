"""Good files of every kind that the renderer reads, to be spoilt by ``mutations.py``."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import trimesh
from PIL import Image
from trimesh.exchange import gltf, obj

from ldtrefl.scene import shapes

MESHES: dict[str, tuple[str, ...]] = {
    "thing.ply": ("thing.ply",),
    "ascii.ply": ("ascii.ply",),
    "thing.obj": ("thing.obj", "thing.mtl", "thing-obj.png"),
    "thing.stl": ("thing.stl",),
    "ascii.stl": ("ascii.stl",),
    "thing.off": ("thing.off",),
    "thing.glb": ("thing.glb",),
    "thing.gltf": ("thing.gltf", "thing-1.bin", "thing-0.bin", "thing-gltf.png"),
}
"""Mesh files, and the files that each is made of."""

PICTURES = (
    "8.png", "16.png", "palette.png", "alpha.png", "a.jpg", "a.exr", "half.exr", "a.hdr", "float.tif", "8.tif", "a.pfm",
    "a.tga", "a.bmp",
)  # fmt: skip
"""Picture files, each used as the environment and as a texture in turn."""

LOOP = "loop.ply"
"""A link to itself."""


def write_good_meshes(folder: Path) -> None:
    """A ball in every format: with stored normals, texture coordinates and a texture where the format has them."""
    ball = shapes.make("sphere", {"segments": [16, 8]})
    plain = trimesh.Trimesh(ball.vertices, ball.faces, process=False)
    for name, options in {
        "thing.ply": {},
        "ascii.ply": {"encoding": "ascii"},
        "thing.stl": {},
        "ascii.stl": {"file_type": "stl_ascii"},
        "thing.off": {},
    }.items():
        plain.export(folder / name, **options)
    picture = Image.fromarray(np.random.default_rng(1).integers(0, 256, (8, 8, 3), dtype=np.uint8))

    def textured(material: trimesh.visual.material.Material) -> trimesh.Trimesh:
        visual = trimesh.visual.TextureVisuals(uv=ball.uvs, material=material)
        return trimesh.Trimesh(ball.vertices, ball.faces, vertex_normals=ball.normals, visual=visual, process=False)

    simple = textured(trimesh.visual.material.SimpleMaterial(image=picture))
    text, beside = obj.export_obj(
        simple, include_texture=True, include_normals=True, mtl_name="thing.mtl", return_texture=True
    )
    (folder / "thing.obj").write_text(text)
    for name, data in beside.items():
        if name.endswith(".png"):
            (folder / "thing-obj.png").write_bytes(data)
        else:
            (folder / "thing.mtl").write_bytes(re.sub(rb"map_Kd .*", b"map_Kd thing-obj.png", data))

    physical = textured(
        trimesh.visual.material.PBRMaterial(baseColorTexture=picture, baseColorFactor=[255, 200, 200, 255])
    )
    (folder / "thing.glb").write_bytes(gltf.export_glb(trimesh.Scene([physical]), include_normals=True))
    parts = gltf.export_gltf(trimesh.Scene([physical]), include_normals=True)
    tree = json.loads(parts.pop("model.gltf"))
    for i, buffer in enumerate(tree["buffers"]):
        data, buffer["uri"] = parts[buffer["uri"]], f"thing-{i}.bin"
        (folder / buffer["uri"]).write_bytes(data)
    picture.save(folder / "thing-gltf.png")
    tree["images"] = [{"uri": "thing-gltf.png"}]
    (folder / "thing.gltf").write_text(json.dumps(tree))


def write_good_pictures(folder: Path) -> None:
    """Eight by sixteen pixels in every format."""
    rng = np.random.default_rng(0)
    pixels = rng.uniform(0.0, 1.0, (8, 16, 4)).astype(np.float32)
    kinds = {
        "8.png": (oiio.UINT8, 3),
        "16.png": (oiio.UINT16, 3),
        "alpha.png": (oiio.UINT8, 4),
        "a.jpg": (oiio.UINT8, 3),
        "a.exr": (oiio.FLOAT, 3),
        "half.exr": (oiio.HALF, 3),
        "a.hdr": (oiio.FLOAT, 3),
        "float.tif": (oiio.FLOAT, 3),
        "8.tif": (oiio.UINT8, 3),
        "a.tga": (oiio.UINT8, 3),
        "a.bmp": (oiio.UINT8, 3),
    }
    for name, (kind, channels) in kinds.items():
        buffer = oiio.ImageBuf(oiio.ImageSpec(16, 8, channels, oiio.FLOAT))
        buffer.set_pixels(oiio.ROI(0, 16, 0, 8, 0, 1, 0, channels), np.ascontiguousarray(pixels[..., :channels]))
        assert buffer.write(str(folder / name), kind), buffer.geterror()
    Image.fromarray((255 * pixels[..., :3]).astype(np.uint8)).convert("P").save(folder / "palette.png")
    (folder / "a.pfm").write_bytes(b"PF\n16 8\n-1.0\n" + pixels[::-1, :, :3].astype("<f4").tobytes())
