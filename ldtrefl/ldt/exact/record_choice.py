"""What a mesh is searched as: its triangles, or patches (``patches.py``) and the few triangles that none stands for.

Patches stand for triangles where that pays and is right. A survey for them is made only where it may be worth it:

    a sample of triangles -> survey -> doubtful patches, and the expected error -> bytes -> patches
                                       (too far off: once more with smaller patches)

*It pays* if patches save two thirds of the bytes. In the tree a triangle takes 53 to 58 bytes and a patch 47. A quarter
of the time is saved from a fifth to an eighth of the records on: with 0.36, 0.27, 0.20, 0.13 and 0.03 of them random
rays took 0.89, 0.84, 0.79, 0.82 and 0.70 of the time and mirror rays 0.86, 0.74, 0.77, 0.76 and 0.50 (a refined scan, a
box, thin limbs, torus knots of 500,000 and 2 million triangles; one thread). So what saves the time saves the bytes,
too.

*It is right* if few rays are expected to be wrong. A patch is a plane. Where the surface turns by ``turn`` radians from
one patch to the next, the plane is off by at most ``turn / 4`` of its side. Rays are wrong at the surface's
silhouettes: they hit what they should miss, or miss it, or hit another surface of the same object. Of silhouettes there
are ``turn`` in a side. So the share of wrong rays goes with the mean square of the turns. It was 0.08 to 0.17 of that
for random rays, from about the object and from within its box, and for mirror rays, on knots and tori from thick to
thin, a sampled isosurface, thin limbs and scans refined by Loop's scheme, with sides of 0.7 to 1.6 texels. It was half
as much again on meshes that are open, where nothing is known of backs, and twice to three times as much for a sheet in
waves, seen from its edge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.ldt.exact.patch_check import CheckedPatches, checked, unchecked
from ldtrefl.ldt.exact.sample import Sample
from ldtrefl.ldt.exact.survey import Survey
from ldtrefl.ldt.options import Quality
from ldtrefl.ldt.texel_frame import TexelFrame, texel_frame
from ldtrefl.world.device_mesh import DeviceMesh

SURVEY_CELLS = 128
"""Cells along the longest side, at most, in which patches and triangles are told apart."""
SURVEY_CELLS_PER_PATCH = 0.5
"""Cells along the side of a patch, which must be smaller than a cell. The smaller the cells, the fewer triangles are
kept about a doubtful patch."""

PATCH_TEXELS: dict[Quality, float] = {"fast": 3.2, "balanced": 1.4}
"""Texels along a side of a patch, at most. At 1.4 a torus knot of 500,000 triangles has 0.08% wrong hits at a
resolution of 256, 0.02% misses and a sixteenth of a texel of 128 at the 99th percentile; at 1.6 a quarter more, and a
quarter fewer patches."""
FACING_MOST: dict[Quality, float] = {"fast": 0.75, "balanced": 0.9}
"""|n . axis| over the largest of the three from which a map makes a patch. Where another map faces a surface much
better, its patches are good, and this map's are long and slanted: without a limit there are 15% more balanced patches
and 7% more rays are wrong. But large patches leave slits where two maps meet: of 200,000 rays 157 slipped through fast
patches that faced them with 0.9, and 16 with 0.75. In trusted maps there is no limit: on a rough surface, where normals
vary from triangle to triangle, it would leave holes."""
LARGEST_TURN: dict[Quality, float] = {"fast": 0.8, "balanced": 0.4}
"""Radians between neighbouring patches from which they are doubtful, see ``patch_check.py``: a mean hides a bad few."""
LARGEST_ERROR: dict[Quality, float] = {"fast": 0.008, "balanced": 0.00095}
"""Share of rays that may be expected to be wrong, at most."""
ERROR_OF_TURN = 0.1
"""The expected share of wrong rays, divided by the mean square of the turns."""
OPEN = 1.5
"""How many times that share is expected on a mesh that is open or wound both ways: there a ray that meets the back of a
patch at the horizon is not passed on."""

TRIANGLE_BYTES, PATCH_BYTES = 54.0, 47.0
"""Bytes of a triangle and of a patch in the tree."""
WORTH_SAVING = 2.0 / 3.0
"""Share of the bytes that patches must save."""
DENSE: dict[Quality, float] = {"fast": 25.0, "balanced": 5.0}
"""Small triangles per patch from which patches stand for them: two and a half per texel. With four of a knot's
triangles per patch twice as many rays slipped between patches."""
FEW_TRIANGLES = 50_000
"""Triangles of a mesh up to which all are kept, however fine: they fit in the cache, and a thin object stays exact."""
FEWEST_TRIANGLES = 2_000
"""The same in maps that are trusted: so few take no more room than patches."""

SAMPLED_DENSE = 0.8
"""Part of ``DENSE`` from which the sample allows a survey: a sample's density was 0.85 to 0.95 of the survey's."""
SAMPLED_ERROR = 6.0
"""Times the largest error up to which the sample allows a survey. The sample's error was 0.5 to 1.7 times the survey's
on smooth meshes, and ten times that on rough ones. What is three times too far off can still become right with patches
of half the side."""
TRIES = 3
"""Surveys with smaller and smaller patches, at most; most often the second is the last."""
SMALLER = 0.95
"""Part of the side that should be right which is tried next: the error does not quite go with its square."""
FEWER_KEPT = 0.7
"""Part of the side of patches that are right which is tried next if they leave too many triangles."""
MOST_KEPT = 0.5
"""Share of triangles kept up to which smaller patches are tried."""
MOST_DOUBTFUL = 0.12
"""Share of doubtful patches from which half the triangles and more are kept, so that they need not be counted."""


@dataclass(frozen=True, eq=False)
class PatchRecords:
    """Patches, and the triangles that none stands for."""

    numbers: wp.array
    """(n,) int32, the records: triangles from 0 on; below 0 patches, -1 for patch 0."""
    patches: wp.array
    """(m,) ``Patch``, in cells of the survey: ``cells_per_texel`` times the texels of ``frame``."""
    frame: TexelFrame
    """The box of texels whose side is a patch's."""
    cells_per_texel: float
    front: int
    """The side of the records that can be seen from outside, 1 or -1 along their normals; 0 if not known."""


def choose_records(
    geometry: DeviceMesh, resolution: int, quality: Quality, *, trusted: bool = False
) -> PatchRecords | None:
    """What stands for a mesh's triangles; None if all triangles are kept.

    Args:
        resolution: texels along the mesh's longest side.
        quality: ``"exact"`` keeps all triangles.
        trusted: texels are smaller than what can be seen: patches need not be right, and stand for smaller meshes, too.
    """
    triangles = len(geometry.faces)
    few = FEWEST_TRIANGLES if trusted else FEW_TRIANGLES
    if quality == "exact" or len(geometry.mesh.outliers) > 0 or triangles <= few:
        return None
    side = PATCH_TEXELS[quality]
    sample = Sample(geometry.mesh, side / resolution)
    if sample.density < SAMPLED_DENSE * DENSE[quality]:
        return None
    if trusted:
        return _surveyed(geometry, resolution, side, quality, 0.0, trusted=True)[0]
    if ERROR_OF_TURN * sample.turn() > SAMPLED_ERROR * LARGEST_ERROR[quality]:
        return None
    edge = side * sample.longest_edge()
    for _ in range(TRIES):
        records, smaller = _surveyed(geometry, resolution, side, quality, edge)
        if records is not None or smaller == 0.0:
            return records
        side = smaller
    return None


def pays(triangles: int, patches: float, kept: int) -> bool:
    """Whether ``patches`` patches and ``kept`` triangles save enough of the bytes of all triangles."""
    before, after = TRIANGLE_BYTES * triangles, PATCH_BYTES * patches + TRIANGLE_BYTES * kept
    return after <= (1.0 - WORTH_SAVING) * before


def _surveyed(
    geometry: DeviceMesh, resolution: int, side: float, quality: Quality, edge: float, *, trusted: bool = False
) -> tuple[PatchRecords | None, float]:
    """Survey a mesh for patches of ``side`` texels; its triangles' longest edge is ``edge`` texels.

    Returns:
        records: None if patches do not pay or are not right.
        smaller: the side of smaller patches that may pay and be right; 0 if there is none.
    """
    triangles = len(geometry.faces)
    frame = texel_frame(geometry.mesh, max(1, round(resolution / side)))
    cells = max(1, min(SURVEY_CELLS, round(SURVEY_CELLS_PER_PATCH * max(frame.size))))
    survey = Survey(geometry, frame, cells, 0.0 if trusted else FACING_MOST[quality])
    if survey.count == 0 or not _may_pay(survey, survey.count, quality):
        return None, 0.0
    found = unchecked(survey) if trusted else checked(survey, LARGEST_TURN[quality])
    if found.doubtful_share > MOST_DOUBTFUL:
        return None, 0.0
    reliable, touched = found.reliable()
    kept = survey.kept_triangles(touched, found.near_doubtful)
    # Between facets that are wider than patches a turn is as large as from one facet to the next.
    facets = max(1.0, edge / side) ** 2
    allowed, squares = LARGEST_ERROR[quality] / facets, found.turn.numpy()
    is_right = trusted or _expected_error(survey, squares[-1 - reliable.numpy()], squares.size) <= allowed
    if is_right and pays(triangles, reliable.shape[0], kept.shape[0]):
        return _records(survey, found, reliable, kept), 0.0
    if trusted or kept.shape[0] > MOST_KEPT * triangles:
        return None, 0.0
    # What is doubtful now may be right with smaller patches.
    error = _expected_error(survey, np.minimum(squares, LARGEST_TURN[quality] ** 2), squares.size)
    shrink = SMALLER * math.sqrt(allowed / max(error, allowed))
    if is_right:  # but too many triangles are kept
        shrink = min(shrink, FEWER_KEPT)
    # No patches are better than facets are.
    may_be_right = side * shrink >= edge
    return None, side * shrink if may_be_right and _may_pay(survey, survey.count / shrink**2, quality) else 0.0


def _may_pay(survey: Survey, patches: float, quality: Quality) -> bool:
    """Whether so many patches may pay if no triangle is kept but the large ones."""
    return survey.small >= DENSE[quality] * patches and pays(survey.triangles, patches, survey.triangles - survey.small)


def _expected_error(survey: Survey, squares: np.ndarray, count: int) -> float:
    """Share of rays that may be expected to be wrong from the squares of the turns of some of ``count`` patches."""
    share = ERROR_OF_TURN * float(squares.sum(dtype=np.float64)) / count
    return share if survey.front else OPEN * share


def _records(survey: Survey, found: CheckedPatches, reliable: wp.array, kept: wp.array) -> PatchRecords:
    """Reliable patches, and the triangles that are kept."""
    numbers = wp.empty(reliable.shape[0] + kept.shape[0], dtype=wp.int32, device=reliable.device)
    wp.copy(numbers, reliable)
    if kept.shape[0] > 0:
        wp.copy(numbers, kept, dest_offset=reliable.shape[0])
    return PatchRecords(numbers, found.patches, survey.frame, survey.cells_per_texel, survey.front)
