"""Our ground truth against an outside one: emission-only versions of the shipped scenes by ``bvh`` and by Mitsuba 3.

    python tools/mitsuba_comparison.py                     # two minutes; writes tools/results/mitsuba.json and .md
    python tools/mitsuba_comparison.py --only teapot       # one scene, the table on the screen
    python tools/mitsuba_comparison.py --quick             # half a minute, small pictures, on the screen

Mitsuba comes with ``pip install -e .[peers]``, and needs an LLVM library of version 16 or newer (Debian: ``libllvm19``;
DRJIT_LIBLLVM_PATH names the file). Scenes whose meshes are not in LDTREFL_MESH_PATH are left out. Exit status 1 if a
scene is beyond its limit.
"""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

from mitsuba_parts.emission_only import emission_only
from mitsuba_parts.judge import MOST_OFF, OFF, Judgement, judgement
from mitsuba_parts.mirror_paths import MitsubaPictures
from mitsuba_parts.mitsuba_scene import ENVIRONMENT_ROWS, VARIANT, mitsuba
from mitsuba_parts.outcome import arguments, write_report
from mitsuba_parts.pixel_rays import SMALL_LIFT

import ldtrefl
from ldtrefl.base.errors import InputError

ROOT = Path(__file__).parent.parent
BOUNCES = 8
QUICK_SIZE = 192, 128
"""Pixels across and down."""


def shipped() -> dict[str, Path]:
    """Name -> file of every shipped scene."""
    folder = ROOT / "scenes"
    paths = [path for place in (".", "paper", "meshes") for path in sorted((folder / place).glob("*.toml"))]
    return {str(path.relative_to(folder).with_suffix("")): path for path in paths}


def judged(name: str, scene: ldtrefl.Scene) -> Judgement:
    """Render a scene's emission-only version by both, and count the pixels that differ."""
    scene = emission_only(scene)
    ours = ldtrefl.render(scene, "bvh", max_bounces=BOUNCES, samples=1)
    theirs = MitsubaPictures(scene)
    paths, spawned = theirs.followed(BOUNCES, SMALL_LIFT), theirs.followed(BOUNCES, None)
    return judgement(name, ours.image, paths, spawned, theirs.by_path_integrator(BOUNCES))


EXPLANATION = f"""\
Every surface radiates its emission and its albedo times texture to all sides; mirrors keep their reflectance, without
Fresnel's law; there are no lights, and the environment is the blend from ground to sky, for Mitsuba a picture of it
with {ENVIRONMENT_ROWS} rows. One ray goes through the middle of each pixel, and at most {BOUNCES} are reflected; beyond
them mirrors show the environment. Both renderers have the same triangles and vertex normals. Ours is `bvh`; Mitsuba's
paths are followed by a loop over its own intersections, shading normals, mirrors and emitters (`{VARIANT}`).

- *mask*: pixels that see a mirror first. *mirrored again*: in the mirror they see another, or the same again.
- *below a facet*: at some bounce the shading normal sends the ray to the other side of the triangle that it came to.
  Mitsuba follows it through the surface; ours does not have to. These pixels are not judged; those that are off stand
  in brackets.
- *near an edge*: of the others, those around which the paths of the 3 x 3 pixels do not all meet the same surfaces in
  the same order, by Mitsuba.
- *judged*: the rest of the mask. *off*: pixels that differ by more than {OFF:g} in a channel, in percent of those
  judged; at most {100 * MOST_OFF:g} are allowed. *off anywhere*: in percent of the whole mask. *unlike all around*: of
  the mask but those below a facet, pixels that differ by more than {OFF:g} from each of the 3 x 3 around: no edge that
  lies a pixel aside tells why; again at most {100 * MOST_OFF:g} are allowed.
- *off by spawn_ray*: in percent of those judged, if rays start where Mitsuba's `spawn_ray` lets them, 9e-5 * (1 + the
  largest coordinate) above the surface, as in its `path` integrator. Elsewhere they start {SMALL_LIFT:.0e} * (1 + the
  same) above it, as its own distance moves what is mirrored near by.
- *path*: the largest difference between the picture by Mitsuba's `path` integrator and that by the loop with
  `spawn_ray`.
"""


def table(judgements: list[Judgement]) -> str:
    """The counts in Markdown."""
    names = ["scene", "mask", "mirrored again", "below a facet", "near an edge", "off anywhere, %"]
    names += ["unlike all around, %", "judged", "off", "off, %", "off by spawn_ray, %", "path", ""]
    lines = [f"| {' | '.join(names)} |", "|" + "---|" * len(names)]
    for j in judgements:
        cells = [j.scene, j.mask, j.mirrored_again, f"{j.below_facet} ({j.off_below_facet})", j.near_edge]
        cells += [percent(part, j.mask) for part in (j.off_anywhere, j.unlike_all_around)]
        cells += [j.judged, j.off, *(percent(part, j.judged) for part in (j.off, j.off_by_spawn_ray))]
        cells += [f"{j.path_differs:.1e}", "" if j.passed else "**beyond**"]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines) + "\n"


def percent(part: int, whole: int) -> str:
    """A share; a dash of nothing."""
    return f"{100 * part / whole:.4f}" if whole else "-"


def report(judgements: list[Judgement], left_out: list[str]) -> str:
    """The whole page."""
    beyond = sum(not j.passed for j in judgements)
    head = f"{len(judgements)} scenes, {beyond} beyond the limit; Mitsuba {mitsuba().__version__}."
    if left_out:
        head += f" Left out, as meshes are missing: {', '.join(left_out)}."
    return f"# Our ground truth against Mitsuba 3\n\n{head}\n\n{EXPLANATION}\n{table(judgements)}"


def main() -> int:
    """Compare the scenes that are wanted, and write the report."""
    given = arguments(__doc__, shipped(), f"pictures of {QUICK_SIZE[0]} x {QUICK_SIZE[1]} pixels")
    mitsuba()
    judgements, left_out = [], []
    for name in given.only or shipped():
        try:
            scene = ldtrefl.load_scene(shipped()[name])
        except InputError as error:
            if "LDTREFL_MESH_PATH" not in str(error):
                raise
            left_out.append(name)
            continue
        if given.quick:
            width, height = QUICK_SIZE
            scene = scene.with_camera(dataclasses.replace(scene.camera, width=width, height=height))
        judgements.append(judged(name, scene))
        last = judgements[-1]
        print(f"{name}: {last.off} of {last.judged} off{'' if last.passed else ', beyond the limit'}", flush=True)
    page = report(judgements, left_out)
    write_report(given.output, "mitsuba", page, judgements)
    return 1 if any(not j.passed for j in judgements) else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except InputError as error:
        sys.exit(f"mitsuba_comparison.py: {error}")
