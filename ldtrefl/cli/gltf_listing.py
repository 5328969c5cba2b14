"""What a glTF file holds, as ``ldtrefl info`` says it: nodes, materials, textures, cameras, lights, extensions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.table import Table

from ldtrefl.base.errors import printable
from ldtrefl.cli.material_listing import MOST_ROWS, material_listing, numbers_in_words
from ldtrefl.scene.gltf.asset import Asset
from ldtrefl.scene.gltf.primitives import Primitive


def listing(asset: Asset) -> Iterator[str | Table]:
    """Lines and tables about an asset.

    Raises:
        InputError: something of it is not sound.
    """
    yield from _nodes(asset)
    count = len(asset.document.entries("materials"))
    yield from material_listing(map(asset.materials.material, range(count)), count)
    for camera in asset.cameras():
        lens = f"fov_y {camera.fov_y:.4g}" if camera.is_perspective else "orthographic, not shown"
        yield f"camera '{printable(camera.name)}': at {numbers_in_words(camera.position)}, {lens}"
    for light in asset.lights():
        unit = "lux" if light.kind == "directional" else "candela"
        yield f"light '{printable(light.name)}': {light.kind}, {numbers_in_words(light.color)} {unit}"
    used = asset.document.root.get("extensionsUsed", [])
    if used:
        yield "extensions: " + printable(", ".join(map(str, used)))
    for line in asset.not_shown():
        yield f"not shown: {printable(line)}"


def _nodes(asset: Asset) -> Iterator[str | Table]:
    table, count, triangles = Table("node", "triangles", "vertices have", "size"), 0, 0
    for node in asset.mesh_nodes():
        own = sum(len(one.faces) for one in node.primitives)
        count, triangles = count + 1, triangles + own
        if count > MOST_ROWS:
            continue
        corners = np.concatenate([one.vertices for one in node.primitives])
        size = (corners.max(axis=0) - corners.min(axis=0)) * np.sqrt((node.matrix[:3, :3] ** 2).sum(axis=0))
        has = sorted({name for one in node.primitives for name in _attributes(one)})
        sides = " x ".join(f"{side:.3g}" for side in size)
        table.add_row(printable(node.name), str(own), ", ".join(has) or "positions", sides)
    yield f"{count} nodes with meshes, {triangles} triangles"
    if count:
        yield table
    if count > MOST_ROWS:
        yield f"... and {count - MOST_ROWS} more"


def _attributes(primitive: Primitive) -> list[str]:
    named = {"normals": "normals", "tangents": "tangents", "colors": "colours"}
    found = [word for name, word in named.items() if getattr(primitive, name) is not None]
    sets = sum(uv is not None for uv in primitive.uvs)
    return found + ([f"{sets} UVs"] if sets else [])
