"""The paper's tables beside ours."""

from __future__ import annotations

import functools
import statistics

from timing import timed_in_turn

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.ldt.peel import peel_mesh
from ldtrefl.renderer import Renderer
from ldtrefl.scene import shapes
from ldtrefl.world.device_mesh import DeviceMesh

from .common import ROOT, SKIPS_BUT_FRAMES
from .models import load
from .result import PaperModel, PaperScene, PaperTables

PAPER_TABLE_1 = {  # model: triangles, layers, milliseconds on an NVIDIA GeForce 7800 (Zhang, Hsieh and Shen)
    "Ball": (1520, 1, 24.783),
    "Hollow-box": (135, 2, 46.489),
    "Dancer": (49996, 2, 50.372),
    "Knotty-cup": (10768, 3, 63.289),
    "Genus3": (13312, 3, 63.592),
    "Elephant": (25086, 3, 65.789),
    "Horse": (96966, 3, 71.075),
    "Armadillo": (49998, 5, 95.328),
    "Tyra": (49998, 5, 95.827),
    "Happy-Buddha": (129484, 5, 110.000),
}

OUR_MODELS = {
    "Ball": "sphere",
    "Hollow-box": "hollow_box",
    "Dancer": "lucy.ply",
    "Knotty-cup": "boot.ply",
    "Genus3": "genus3",
    "Elephant": "spot.glb",
    "Horse": "bunny_open.ply",
    "Armadillo": "armadillo.ply",
    "Tyra": "sheen_chair.glb",
    "Happy-Buddha": "happy_buddha.ply",
}

PAPER_TABLE_2 = {  # scene: milliseconds for reflector and reflection on the same GPU
    "two_balls": (1.013, 1.559),
    "hollow_box": (1.019, 1.612),
    "knotty_cup": (1.023, 2.131),
    "buddha": (1.027, 2.188),
    "armadillo": (1.022, 2.337),
    "tyra": (1.021, 2.342),
    "two_elephants": (1.064, 4.324),
    "two_horses": (1.024, 4.822),
    "three_genus3": (1.013, 5.372),
    "three_dancers": (1.029, 6.261),
}

TABLE_1_COLUMNS = ["model", "paper: layers, ms (GeForce 7800)", "ours", "layers, ms (this CPU)"]
TABLE_2_COLUMNS = ["scene", "paper: reflector + reflection ms", "ours: linear", "exact"]


def table_1_rows(found: PaperTables) -> list[list[str]]:
    """The cells of Table 1."""
    rows = []
    for model, entry in found["table_1"].items():
        paper, ours = entry["paper"], entry["ours"]
        theirs = [f"{model}, {paper['triangles']}", f"{paper['layers']}, {paper['milliseconds']:.1f}"]
        mine = [f"{ours['model']}, {ours['triangles']}", f"{ours['layers']}, {ours['milliseconds']:.1f}"]
        rows.append(theirs + mine)
    return rows


def table_2_rows(found: PaperTables) -> list[list[str]]:
    """The cells of Table 2."""
    rows = []
    for name, scene in found["table_2"].items():
        figures = [sum(scene["paper"].values()), scene["ours"]["linear"], scene["ours"]["exact"]]
        rows.append([name, *(f"{figure:.1f}" for figure in figures)])
    return rows


def paper_tables(quick: bool, rounds: int) -> PaperTables:
    """The paper's Tables 1 and 2 beside ours: their milliseconds on a GeForce 7800, ours on this CPU."""
    ldtrefl.set_threads()
    device = launch.resolve_device(None)
    table_1: dict[str, PaperModel] = {}
    for model, (triangles, layers, milliseconds) in PAPER_TABLE_1.items():
        name = OUR_MODELS[model]
        mesh = load(name) if not quick or name in shapes.names() else None
        if mesh is None:
            continue
        geometry = DeviceMesh(mesh, device)
        maps = peel_mesh(geometry, search="linear")
        times = timed_in_turn({"peel": functools.partial(peel_mesh, geometry, search="linear")}, rounds)
        table_1[model] = {
            "paper": {"model": model, "triangles": triangles, "layers": layers, "milliseconds": milliseconds},
            "ours": {
                "model": name,
                "triangles": len(mesh.faces),
                "layers": max(maps.layers().values()),
                "milliseconds": times["peel"]["median"],
            },
        }
    table_2: dict[str, PaperScene] = {}
    for name, (reflector, reflection) in PAPER_TABLE_2.items():
        try:
            scene = ldtrefl.load_scene(ROOT / "scenes" / "paper" / f"{name}.toml")
        except ldtrefl.InputError:
            continue
        ours = {}
        for search in ("linear", "exact"):
            renderer = Renderer(scene, "ldt", search=search, skip=SKIPS_BUT_FRAMES, samples=1)
            frames = [renderer.render().stats.seconds for _ in range(rounds + 1)][1:]
            reflecting = [frame["cull"] + frame["march"] + frame["shade"] for frame in frames]
            ours[search] = 1000 * statistics.median(reflecting)
        table_2[name] = {"paper": {"reflector": reflector, "reflection": reflection}, "ours": ours}
        if quick:
            break
    return {"table_1": table_1, "table_2": table_2}
