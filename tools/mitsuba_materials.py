"""Our materials against outside ones: scenes of glTF's materials by ``bvh`` and by Mitsuba 3.

    python tools/mitsuba_materials.py                      # half a minute; writes tools/results/mitsuba_materials.*
    python tools/mitsuba_materials.py --only metals        # one scene, the table on the screen
    python tools/mitsuba_materials.py --quick              # some seconds, small pictures, on the screen

What Mitsuba needs stands at the head of `mitsuba_comparison.py`. Scenes whose meshes are not in LDTREFL_MESH_PATH are
left out. Exit status 1 if a scene is beyond its limit.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mitsuba_parts import material_scenes
from mitsuba_parts.lit_pictures import LitPictures
from mitsuba_parts.material_scenes import MaterialScene
from mitsuba_parts.mitsuba_scene import mitsuba
from mitsuba_parts.outcome import arguments, write_report

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.compare.metrics.structural_similarity import ssim
from ldtrefl.shading.finish import LEAST_ROUGHNESS

ROOT = Path(__file__).parent.parent
WIDTH, QUICK_WIDTH = 768, 288
"""Pixels across."""
LEAST_SSIM = 0.98
MOST_DIFFERENCE = 0.02
"""Of the light of the whole picture."""

SCENES: dict[str, Callable[[int], MaterialScene]] = {
    "metals": material_scenes.metals,
    "highlights": material_scenes.highlights,
    "plastics": material_scenes.plastics,
    "varnish": material_scenes.varnishes,
    "golden mirrors": material_scenes.golden,
    "glazed mirrors": material_scenes.glazed,
}
FILES = {"sheen_chair.glb": (1.2, -2.0, 1.0), "spot.glb": (1.2, -2.0, 1.0)}
"""Mesh files, and where they are looked at from: in their sizes, from their middles."""


@dataclass(frozen=True)
class Likeness:
    """How like two pictures of a scene are: ours, and one by Mitsuba."""

    ssim: float
    """Of what is shown, sRGB of radiance cut to 0..1, over the pixels that see an object."""
    difference: float
    """Sum of the absolute differences of linear radiance, not cut, over the sum of Mitsuba's."""

    @property
    def passed(self) -> bool:
        """Whether they are alike."""
        return self.ssim >= LEAST_SSIM and self.difference <= MOST_DIFFERENCE


@dataclass(frozen=True)
class Row:
    """A scene's figures."""

    scene: str
    plugins: str
    differs: str
    of_plugins: Likeness
    """Ours and Mitsuba's plugins as they are."""
    of_layers: Likeness
    """Ours and Mitsuba's microfacets and bases, put together as ours are."""


def likeness(ours: np.ndarray, theirs: np.ndarray, sees: np.ndarray) -> Likeness:
    """Compare (h, w, 3) radiances; ``sees`` says which pixels see an object."""
    difference = np.abs(ours.astype(float) - theirs).sum() / theirs.sum(dtype=float)
    return Likeness(ssim(ours, theirs, sees), float(difference))


def compared(name: str, case: MaterialScene) -> Row:
    """Render a scene by both."""
    bounces = case.scene.reflection.max_bounces
    ours = ldtrefl.render(case.scene, "bvh", samples=1).image
    found = []
    for is_layered in (False, True):
        theirs, sees = LitPictures(case.scene, case.surface_of, is_layered=is_layered).render(bounces)
        found.append(likeness(ours, theirs, sees))
    return Row(name, case.plugins, case.differs, *found)


EXPLANATION = f"""\
Lights are a direction and a point, without shadows or indirect light; one ray goes through the middle of each pixel.
Both renderers have the same triangles and vertex normals. Ours is `bvh`; Mitsuba's pictures are made by a loop over its
own intersections, lights, BSDFs and textures. SSIM is that of what is shown, sRGB of radiance cut to 0..1, over the
pixels that see an object; the *difference* is the sum of absolute differences of linear radiance, not cut, in percent
of the sum. Alpha is the square of the roughness for both.

*As they are*: Mitsuba's plugins. They differ from glTF's model and from ours by what they leave out:

- masking of microfacets is separable (Smith), ours is correlated by height;
- what microfacets reflect more than once is lost, of a white metal seen from above 5% at roughness 0.45, 69% at 1; ours
  adds it;
- of the base of a dielectric, `principled` has Disney's diffuse lobe, from which nothing is taken for what is mirrored,
  and which is brighter along rough surfaces; `roughplastic` and `plastic` have light pass the boundary on the way in
  and out and be thrown back inside, and `roughplastic` loses more of it the rougher it is: beneath ior 1.5, seen and
  lit from above, 3% at roughness 0.15, 37% at 0.6. Ours lets through what is not mirrored to the viewer.

*Put together*: Mitsuba's microfacets (the same plugin over black) and its `diffuse` base, with factors for these three
that are made of Mitsuba's own masking (`smith_g1`) and of how much its own microfacets reflect. These are judged: SSIM
at least {LEAST_SSIM:g}, difference at most {100 * MOST_DIFFERENCE:g}%. What still differs stands beside each scene,
and for all: where an interpolated normal faces away from the viewer, at rims, Mitsuba shows black. Smooth mirrors of
ours show lights as surfaces of roughness {LEAST_ROUGHNESS:g} do; Mitsuba is given such a surface for lights.
Smooth gold is Mitsuba's plugins as they are in both columns.
"""


def table(rows: list[Row]) -> str:
    """The figures in Markdown."""
    names = ["scene", "Mitsuba's plugins", "SSIM as they are", "difference, %", "SSIM put together", "difference, %"]
    names += ["still differs", ""]
    lines = [f"| {' | '.join(names)} |", "|" + "---|" * len(names)]
    for row in rows:
        cells = [row.scene, row.plugins]
        for found in (row.of_plugins, row.of_layers):
            cells += [f"{found.ssim:.4f}", f"{100 * found.difference:.2f}"]
        lines.append(f"| {' | '.join([*cells, row.differs, '' if row.of_layers.passed else '**beyond**'])} |")
    return "\n".join(lines) + "\n"


def report(rows: list[Row], left_out: list[str]) -> str:
    """The whole page."""
    beyond = sum(not row.of_layers.passed for row in rows)
    head = f"{len(rows)} scenes, {beyond} beyond the limits; Mitsuba {mitsuba().__version__}."
    if left_out:
        head += f" Left out, as meshes are missing: {', '.join(left_out)}."
    return f"# Our materials against Mitsuba 3\n\n{head}\n\n{EXPLANATION}\n{table(rows)}"


def made(name: str, width: int) -> MaterialScene | None:
    """A scene; None if its mesh is missing."""
    if name in SCENES:
        return SCENES[name](width)
    folders = filter(None, os.environ.get("LDTREFL_MESH_PATH", "").split(os.pathsep))
    files = [file for folder in folders if (file := Path(folder) / name).is_file()]
    return material_scenes.of_file(files[0], FILES[name], width) if files else None


def main() -> int:
    """Compare the scenes that are wanted, and write the report."""
    given = arguments(__doc__, [*SCENES, *FILES], f"pictures {QUICK_WIDTH} pixels wide")
    mitsuba()
    rows, left_out = [], []
    for name in given.only or [*SCENES, *FILES]:
        case = made(name, QUICK_WIDTH if given.quick else WIDTH)
        if case is None:
            left_out.append(name)
            continue
        rows.append(compared(name, case))
        print(f"{name}: {rows[-1].of_layers.ssim:.4f}", flush=True)
    page = report(rows, left_out)
    write_report(given.output, "mitsuba_materials", page, rows)
    return 1 if any(not row.of_layers.passed for row in rows) else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except InputError as error:
        sys.exit(f"mitsuba_materials.py: {error}")
