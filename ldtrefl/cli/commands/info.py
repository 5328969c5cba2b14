"""``ldtrefl info``: what a scene or a mesh holds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.table import Table

from ldtrefl.base import budget
from ldtrefl.base.errors import printable
from ldtrefl.cli.material_listing import material_listing
from ldtrefl.cli.options import Memory, allow_memory, mesh_or_shape
from ldtrefl.cli.printing import say
from ldtrefl.device.launch import resolve_device, threading_note
from ldtrefl.ldt.peel import peel_mesh
from ldtrefl.scene.description import Scene
from ldtrefl.scene.load import load_scene
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.mesh_scene import is_gltf
from ldtrefl.scene.surface_material import PLAIN
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.looks import is_mirror

PLACE_IN_HELP = 40

MESH_RESOLUTION = 128
"""Texels along the longest side of the maps that tell whether a mesh is closed."""

app = typer.Typer()


@app.command()
def info(
    file: Annotated[str, typer.Argument(metavar="SCENE|MESH", help="A scene or mesh file, or a shape's name.")],
    memory: Memory = None,
) -> None:
    """Say what a scene or a mesh holds."""
    allow_memory(memory)
    if Path(file).suffix.lower() == ".toml":
        with budget.account() as account:
            loaded = load_scene(file)
        _scene_info(loaded, account.taken)
    elif is_gltf(Path(file)):
        _gltf_info(Path(file))
    else:
        _mesh_info(mesh_or_shape(file))
    if note := threading_note():
        say(note)


def _gltf_info(path: Path) -> None:
    # Its readers take a quarter of a second.
    from ldtrefl.cli.gltf_listing import listing  # noqa: PLC0415
    from ldtrefl.scene.gltf.to_scene import faults_of, read_asset  # noqa: PLC0415

    with faults_of(path):
        for part in listing(read_asset(path)):
            say(part)


def _scene_info(scene: Scene, memory: int) -> None:
    camera = scene.camera
    say(f"camera: {camera.width} x {camera.height}, eye {list(camera.eye)}, fov_y {camera.fov_y}")
    kinds: list[str] = [light.kind for light in scene.lights]
    kinds += [] if scene.environment.preset is None else [f"those of the preset '{scene.environment.preset}'"]
    say(f"lights: {', '.join(kinds) or 'none'}; shadows: {scene.lighting.shadows}")
    say(f"method: {scene.reflection.method}, max_bounces: {scene.reflection.max_bounces}")
    table = Table("object", "geometry", "triangles", "mirrors", "size in the world")
    for entry in scene.objects:
        mesh, matrix = entry.geometry, entry.world_from_object()
        low, high = mesh.bounds
        size = np.linalg.norm(matrix[:3, :3], axis=0) * (high - low)
        source = entry.shape or (Path(entry.mesh).name if isinstance(entry.mesh, str) else "mesh")
        row = printable(entry.name), printable(source), str(len(mesh.faces))
        mirrors = "yes" if is_mirror(entry, scene.reflection) else "no"
        table.add_row(*row, mirrors, " x ".join(f"{side:.3g}" for side in size))
    say(table)
    allowed = budget.in_words(budget.memory_limit())
    say(f"memory: about {budget.in_words(memory)} for its shapes, meshes and pictures, {allowed} allowed")


def _mesh_info(mesh: Mesh) -> None:
    low, high = mesh.bounds
    say(f"{len(mesh.faces)} triangles, {len(mesh.vertices)} vertices")
    say(f"from {low.tolist()} to {high.tolist()}")
    has = {"UVs": mesh.uvs, "colours": mesh.colors}
    say(f"vertices have {', '.join(name for name, values in has.items() if values is not None) or 'positions'}")
    materials = list({part.material.key + part.material.name: part.material for part in mesh.parts}.values())
    if materials != [PLAIN]:
        for part in material_listing(materials, len(materials)):
            say(part)
    maps = peel_mesh(DeviceMesh(mesh, resolve_device(None)), MESH_RESOLUTION, search="linear")
    crossings = ", ".join(f"{axis} {count}" for axis, count in maps.crossings().items())
    say(f"surfaces over one texel at {MESH_RESOLUTION}: {crossings}")
    odd = sum(int((maps.counts(axis) % 2).sum()) for axis in range(3))
    say("closed: every texel has an even number" if odd == 0 else f"open: {odd} texels have an odd number")
