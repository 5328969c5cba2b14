"""The paper's cone test of flat mirror triangles: against brute force in float64, and what it loses of curved ones."""

import numpy as np
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.flat_regions import flat_regions, shows_flat
from ldtrefl.scene.description import Object
from ldtrefl.tracing.object_sets import RUN, ObjectSets, entries
from tests.conftest import SCENES
from tests.frame import flat_mirror
from tests.frame.random_mirrors import meet, on_device, random_mirrors, reflected


@launch.kernel
def answer_flat(
    first: int,
    eye: wp.array(dtype=wp.vec3),
    corners: wp.array2d(dtype=wp.vec3),
    centre: wp.array(dtype=wp.vec3),
    radius: wp.array(dtype=float),
    flat_out: wp.array(dtype=int),
):
    """Ask of one mirror triangle whether it shows a sphere."""
    i = first + wp.tid()
    flat_out[i] = int(shows_flat(eye[i], corners[i, 0], corners[i, 1], corners[i, 2], centre[i], radius[i]))


def test_flat_is_exact_for_flat_mirrors() -> None:
    """Drops nothing that reflects, but for float32's roots; keeps little else: what lies in the infinite cone."""
    n = 30_000
    mirrors = random_mirrors(n, 0.0)
    rng = np.random.default_rng(14)
    centre, radius = 3 * rng.normal(size=(n, 3)), 10.0 ** rng.uniform(-2, 0.3, n)
    vectors = [on_device(mirrors["eye"]), on_device(mirrors["corners"]), on_device(centre)]
    radii = wp.array(radius.astype(np.float32), dtype=float, device=vectors[0].device)
    flat = wp.zeros(n, dtype=int, device=vectors[0].device)
    launch.launch(answer_flat, n, [*vectors, radii, flat], vectors[0].device)
    truth = np.zeros(n, bool)
    for part in range(0, n, 5000):
        span = slice(part, part + 5000)
        rays = reflected({name: values[span] for name, values in mirrors.items()}, 200, flat=True)
        truth[span] = meet(*rays, centre[span, None], (1 - 1e-4) * radius[span, None]).any(axis=1)  # not by rounding
    shown = flat.numpy() != 0
    assert 0.02 < truth.mean() < 0.98
    assert (truth & ~shown).mean() < 1e-4
    assert (shown & ~truth).mean() < 0.02


def test_flat_loses_pixels_of_curved_mirrors() -> None:
    """Why it is not the default: the normals turn within a triangle."""
    scene = ldtrefl.load_scene(SCENES / "bowl_mirror.toml")
    flat, safe = ldtrefl.render(scene, "ldt", cull="flat"), ldtrefl.render(scene, "ldt")
    assert flat.hits is not None and safe.hits is not None
    lost = (safe.hits.object >= 0) & (flat.hits.object < 0)
    assert 0 < lost.sum() < 0.03 * (safe.hits.object >= 0).sum()
    assert not ((flat.hits.object >= 0) & (safe.hits.object < 0)).any()


def test_a_flat_mirror_shows_what_stands_before_it_alone() -> None:
    """The plane's two triangles against a box above it, a box below it, and one that they do not show from there."""
    below = Object(shape="box", scale=0.3, translate=(0.0, 0.5, -2.0))
    aside = Object(shape="box", scale=0.1, translate=(30.0, 0.5, 1.0))
    given = flat_mirror.scene()
    scene = flat_mirror.on_device(flat_mirror.scene(objects=(*given.objects, below, aside)))
    gbuffer, shaded = flat_mirror.seen_and_shaded(scene)
    stats = Stats()
    regions = flat_regions(gbuffer, shaded.rays, stats)
    assert regions.shown == {flat_mirror.BOX}
    assert stats.counters["triangles_tested"] == 2
    reflects = np.isin(shaded.rays.pixel.numpy(), _pixels_that_show_the_box(given))
    assert reflects.sum() > 100 and can_meet(regions.sets, flat_mirror.BOX, len(reflects))[reflects].all()
    runs, objects = entries(regions.sets)
    assert set(objects.tolist()) == {flat_mirror.BOX} and len(np.unique(runs)) == len(runs)


def can_meet(sets: ObjectSets, k: int, rays: int) -> np.ndarray:
    """(rays,) whether each can meet object ``k``, by the lists of their runs."""
    start, count = sets.start.numpy(), sets.count.numpy()
    met = np.zeros((len(start), int(RUN)), bool)
    for run, (begin, listed) in enumerate(zip(start, count, strict=True)):
        for entry in range(begin, begin + listed):
            if sets.object.numpy()[entry] == k:
                met[run] |= sets.rays.numpy()[entry] >> np.arange(int(RUN), dtype=np.uint64) & np.uint64(1) != 0
    return met.ravel()[:rays]


def _pixels_that_show_the_box(given: ldtrefl.Scene) -> np.ndarray:
    expected = flat_mirror.reflection(given)
    return expected.pixels[expected.object == flat_mirror.BOX]
