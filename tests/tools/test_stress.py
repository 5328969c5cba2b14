"""The stress test's cases (``tools/stress.py``) with small counts, each held to its own limits."""

import dataclasses
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from stress import CASES, load
from stress_cases import bounds
from stress_cases.files import MEMORY, SECONDS, Case, fault_of_picture, fault_of_process
from stress_cases.inputs import rays_about
from stress_cases.judge import judge
from stress_cases.outcomes import DENSE, EXACT
from stress_cases.pictures import Held, judge_frame, reflected_hits, shows_enough, surroundings
from stress_cases.truth import Truth

import ldtrefl
from ldtrefl.ldt.options import Quality
from ldtrefl.scene import shapes

FORKING = ("files", "kills", "cache_files")
IN_THIS_PROCESS = [name for name in CASES if name not in FORKING]


@pytest.mark.parametrize("name", IN_THIS_PROCESS)
def test_case_keeps_its_limits(name: str) -> None:
    size = CASES[name][1]
    outcomes = load(name).run(size.rays, size.pictures)
    beyond = [f"{o.what}, {o.by}: {o}" for o in outcomes if not o.passed]
    assert outcomes and not beyond, beyond[0]
    assert sum(o.non_finite for o in outcomes) == 0


@pytest.mark.parametrize("quality", ["balanced", "fast"])
def test_patches_stand_for_the_dense_mesh_of_the_bounds(quality: Quality) -> None:
    mesh = shapes.make("sphere", bounds.DENSE)
    assert ldtrefl.peel(mesh.vertices, mesh.faces, bounds.COARSE, quality=quality).tree.patches


def test_files_and_kills_keep_their_limits() -> None:
    """These fork, so they get a process of their own, in which no threads run."""
    tool = Path(__file__).parent.parent.parent / "tools" / "stress.py"
    command = [sys.executable, str(tool), "--quick", *(word for name in FORKING for word in ("--only", name))]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def traced() -> tuple[Truth, np.ndarray, np.ndarray, np.ndarray, ldtrefl.Hits]:
    """A mesh, rays, the truth and the hits of a sound tracer."""
    mesh = shapes.make("torus_knot", {"segments": [32, 8]})
    origins, directions = rays_about(mesh, 4000, 1)
    truth = Truth(mesh)
    hits = ldtrefl.peel(mesh.vertices, mesh.faces).trace(origins, directions)
    return truth, origins, directions, truth.hits(origins, directions), hits


def spoilt(hits: ldtrefl.Hits, **arrays: np.ndarray) -> ldtrefl.Hits:
    """The hits with other arrays."""
    given = {name: getattr(hits, name) for name in ("t", "normal", "triangle", "barycentrics", "invalid")}
    return ldtrefl.Hits(**(given | arrays))


def test_a_defect_is_found(traced: tuple) -> None:
    """The judge must see a tracer that loses one triangle, moves another, and answers NaN once."""
    *rays, true_t, hits = traced
    sound = judge(*rays, true_t, hits, EXACT)
    assert sound.passed and sound.disagree == sound.misnamed == 0
    first, second, third = np.flatnonzero(np.isfinite(true_t))[[5, 50, 100]]
    for ray, value in ((first, np.inf), (second, 0.9 * hits.t[second]), (third, np.nan)):
        t, triangle = hits.t.copy(), hits.triangle.copy()
        t[ray], triangle[ray] = value, -1 if value == np.inf else triangle[ray]
        found = judge(*rays, true_t, spoilt(hits, t=t, triangle=triangle), EXACT)
        assert not found.passed and found.defects == 1 and found.disagree == 1


def off_by(traced: tuple, texels: float, every: int) -> ldtrefl.Hits:
    """Hits of which every so many-th lies that much farther along its ray."""
    truth, _, directions, true_t, hits = traced
    t = hits.t.copy()
    moved = np.flatnonzero(np.isfinite(true_t))[::every]
    t[moved] += texels * 2 * truth.half / 256 / np.linalg.norm(directions[moved], axis=1)
    return spoilt(hits, t=t)


@pytest.mark.parametrize(("texels", "every"), [(1.0, 100), (0.04, 100), (20.0, 700)])
def test_no_error_is_left_out_for_being_large(traced: tuple, texels: float, every: int) -> None:
    """Of the hits that are off, one in ``every``, all count: in the percentiles, and as defects where they are some."""
    *rays, true_t, _ = traced
    found = judge(*rays, true_t, off_by(traced, texels, every), EXACT)
    moved = len(np.flatnonzero(np.isfinite(true_t))[::every])
    assert not found.passed
    assert found.p999 == pytest.approx(texels, rel=0.01) and found.worst == pytest.approx(texels, rel=0.01)
    assert found.defects == (moved if texels > EXACT.worst else 0)


def test_patches_are_held_to_what_patches_are(traced: tuple) -> None:
    """A texel more on one hit in a hundred, or on all, is no patch of 1.6 texels; ten texels on one in 50 none of 4."""
    *rays, true_t, _ = traced
    assert judge(*rays, true_t, off_by(traced, 0.1, 1), DENSE["balanced"]).passed
    for name, texels, every in (("balanced", 1.0, 100), ("balanced", 1.0, 1), ("fast", 10.0, 50), ("fast", 2.2, 1)):
        assert not judge(*rays, true_t, off_by(traced, texels, every), DENSE[name]).passed, (name, texels, every)


def test_explained_answers_are_few(traced: tuple) -> None:
    """Near a silhouette any answer counts as a slip between patches; if there are many of those, it is none."""
    truth, origins, directions, true_t, hits = traced
    aimed = np.flatnonzero(np.isfinite(true_t))
    t, triangle = hits.t.copy(), hits.triangle.copy()
    lost = aimed[: len(aimed) // 20]
    t[lost], triangle[lost] = np.inf, -1
    anywhere = dataclasses.replace(DENSE["balanced"], radius=np.inf)
    assert not judge(truth, origins, directions, true_t, spoilt(hits, t=t, triangle=triangle), anywhere).passed


def test_what_is_hit_must_be_named(traced: tuple) -> None:
    """Barycentrics exchanged, normals turned over, another triangle's number: right distances, wrong pictures."""
    *rays, true_t, hits = traced
    hit = np.flatnonzero(hits.triangle >= 0)
    other = hits.triangle.copy()
    other[hit] = np.roll(hits.triangle[hit], 1)
    for arrays in (
        {"barycentrics": np.ascontiguousarray(hits.barycentrics[:, ::-1])},
        {"normal": -hits.normal},
        {"triangle": other},
    ):
        found = judge(*rays, true_t, spoilt(hits, **arrays), EXACT)
        assert not found.passed and found.misnamed > 0.9 * len(hit) and found.disagree == 0, list(arrays)


def picture(share: float, met: float) -> tuple[np.ndarray, np.ndarray]:
    """A mask of the reflector, (20, 20), and where its rays meet something."""
    mirrors = (np.arange(400) < 400 * share).reshape(20, 20)
    return mirrors, (np.arange(400) < 400 * share * met).reshape(20, 20)


def test_pictures_without_a_reflector_show_nothing() -> None:
    assert shows_enough(*picture(0.5, 0.5), Held())
    assert not shows_enough(*picture(0.0, 0.0), Held())
    assert not shows_enough(*picture(0.01, 1.0), Held())
    assert not shows_enough(*picture(0.5, 0.0), Held())
    assert shows_enough(*picture(0.0, 0.0), Held(reflector=0.0, hits=0.0))
    assert not shows_enough(*picture(0.1, 0.5), Held(reflector=0.0, hits=0.0))


def test_a_picture_of_wrong_reflections_is_found() -> None:
    """A frame without reflections, one of hits elsewhere, and one of another object, against the reference."""
    ball = ldtrefl.Object(shape="sphere", params={"segments": [32, 16]}, material=ldtrefl.Material(mirror=(1, 1, 1)))
    camera = ldtrefl.Camera(eye=(0.4, -4, 0.5), look_at=(0, 0, 0), width=40, height=40, fov_y=40.0)
    scene = ldtrefl.Scene(camera=camera, objects=(ball, surroundings()))
    reference = reflected_hits(scene)
    mirrors, texels = reference[0] == 0, np.array([2.0, 16.0]) / 256
    frame = ldtrefl.render(scene, "ldt")
    assert judge_frame(frame, reference, mirrors, texels, Held(), False).passed
    assert frame.hits is not None
    seen = {name: getattr(frame, name) for name in ("image", "reflection", "reflector_mask", "hits", "stats")}
    hits = vars(frame.hits) | {name: getattr(frame.hits, name) for name in ("object", "distance")}
    for changes in (
        {"object": np.full((40, 40), -1), "distance": np.full((40, 40), np.inf)},
        {"distance": hits["distance"] + 0.6 * texels[1]},
        {"distance": hits["distance"] * np.nan},
        {"object": np.where(hits["object"] == 1, 0, hits["object"])},
    ):
        other: Any = SimpleNamespace(**(seen | {"hits": SimpleNamespace(**(hits | changes))}))
        assert not judge_frame(other, reference, mirrors, texels, Held(), False).passed, list(changes)
    none: Any = SimpleNamespace(**(seen | {"reflector_mask": np.zeros((40, 40), bool)}))
    assert not judge_frame(none, reference, mirrors, texels, Held(), False).passed


@pytest.mark.parametrize(
    ("status", "text", "fault"),
    [
        (-11, "", "killed by signal 11"),
        (1, "Traceback (most recent call last):\n  ...\nValueError: x", "a traceback: ValueError: x"),
        (1, "", "status 1"),
        (2, "", "0 lines"),
        (2, "ldtrefl: one\ntwo", "2 lines"),
        (0, "x.py:1: RuntimeWarning: invalid value", "a warning"),
    ],
)
def test_faults_of_a_command_are_found(status: int, text: str, fault: str) -> None:
    assert fault in fault_of_process(status, text, 0.1, 0, [])


def test_what_a_command_used_and_left_is_found() -> None:
    assert fault_of_process(0, "", 0.1, 0, []) == fault_of_process(2, "ldtrefl: wrong", 0.1, 0, []) == ""
    assert "s" in fault_of_process(0, "", SECONDS + 1, 0, [])
    assert "GiB" in fault_of_process(0, "", 0.1, MEMORY + 1, [])
    assert "left behind" in fault_of_process(2, "ldtrefl: wrong", 0.1, 0, [".a-1.png"])


def test_pictures_that_are_none_are_found(tmp_path: Path) -> None:
    """Too small, not finite, another than is kept, or none at all."""
    scene, out = tmp_path / "case.toml", tmp_path / "out.exr"
    scene.write_text("[camera]\nwidth = 6\nheight = 4\n")
    good = np.ones((4, 6, 3), np.float32)
    case = Case(scene, "row")
    assert fault_of_picture(case, out, 0) == "no picture"
    ldtrefl.save_image(out, good)
    assert fault_of_picture(case, out, 0) == fault_of_picture(Case(scene, "row", same=good), out, 0) == ""
    assert "another picture" in fault_of_picture(Case(scene, "row", same=good + 1e-6), out, 0)
    assert fault_of_picture(case, out, 2) == "a picture on error"
    assert "refused" in fault_of_picture(Case(scene, "row", always=True), out, 2)
    ldtrefl.save_image(out, good[:3])
    assert "shape" in fault_of_picture(case, out, 0)
    broken = good.copy()
    broken[1, 1, 0] = np.nan
    ldtrefl.save_image(out, broken)
    assert "not finite" in fault_of_picture(case, out, 0)


def test_triangles_near_a_ray_are_all_that_rays_beside_it_meet(traced: tuple) -> None:
    truth, origins, directions, *_ = traced
    texel = 2 * truth.half / 256
    rng = np.random.default_rng(2)
    for o, d in zip(origins[:100].astype(float), directions[:100].astype(float), strict=True):
        few = truth.near(o, d, 3 * texel)
        aside = rng.normal(size=(20, 3))
        beside = o + 3 * texel * aside / np.linalg.norm(aside, axis=1, keepdims=True)
        ways = np.broadcast_to(d, (20, 3))
        np.testing.assert_array_equal(few.hits(beside, ways), truth.hits(beside, ways))
