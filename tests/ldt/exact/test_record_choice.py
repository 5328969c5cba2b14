"""Whether triangles or patches are searched: by what pays and is right, and found out before it costs much."""

import numpy as np
import pytest
import trimesh
from benchmark_parts.rays import mirror_rays
from stress_cases.inputs import rays_about

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.ldt.exact import record_choice
from ldtrefl.ldt.exact.record_choice import choose_records, pays
from ldtrefl.ldt.options import Quality
from ldtrefl.scene import shapes
from ldtrefl.world.device_mesh import DeviceMesh

RESOLUTION = 256
DEVICE = launch.resolve_device(None)


def ball_with_limbs(thickness: float, detail: tuple[int, int] = (110, 240)) -> ldtrefl.Mesh:
    """A ball of 0.35 that 14 bent limbs grow from, ``thickness`` thick at their roots: 900,000 triangles."""
    rng = np.random.default_rng(3)
    ball, limb = shapes.make("sphere", {"segments": [400, 200]}), shapes.make("sphere", {"segments": list(detail)})
    vertices, faces = [0.35 * ball.vertices], [ball.faces]
    for number in range(14):
        along = rng.normal(size=3)
        along /= np.linalg.norm(along)
        aside = np.cross(along, rng.normal(size=3))
        aside /= np.linalg.norm(aside)
        x, y, z = limb.vertices.T[:, :, None]
        place = 0.5 * (z + 1.0)
        middle = (0.25 + 0.75 * place) * along + 0.1 * np.sin(3.0 * place + number) * aside
        radius = thickness * (0.6 + 0.6 * (1.0 - place))
        faces.append(limb.faces + sum(map(len, vertices)))
        vertices.append(middle + radius * (x * aside + y * np.cross(along, aside)))
    return ldtrefl.Mesh(np.concatenate(vertices), np.concatenate(faces))


def two_sheets() -> ldtrefl.Mesh:
    """Two spheres, less than a patch apart, cut open with no wall between their rims: 720,000 triangles."""
    ball = shapes.make("sphere", {"segments": [750, 360]})
    faces = np.concatenate([ball.faces, ball.faces[:, ::-1] + len(ball.vertices)])
    vertices = np.concatenate([ball.vertices, 0.992 * ball.vertices])
    return ldtrefl.Mesh(vertices, faces[vertices[faces].mean(axis=1)[:, 2] < 0.5])


def refined_scan(rise: float) -> ldtrefl.Mesh:
    """A ball of fine hills, refined by Loop's scheme to 327,680 triangles, their vertices moved by ``rise`` edges."""
    ball = trimesh.creation.icosphere(subdivisions=5)
    hills = np.sin(17.0 * ball.vertices).prod(axis=1, keepdims=True)
    scan = trimesh.Trimesh(ball.vertices * (1.0 + 0.1 * hills), ball.faces, process=False).subdivide_loop(iterations=2)
    edge = float(scan.edges_unique_length.mean())
    moved = scan.vertices + rise * edge * np.random.default_rng(0).normal(size=scan.vertices.shape)
    return ldtrefl.Mesh(moved, scan.faces)


def thin_torus(minor: float, segments: tuple[int, int] = (2000, 120)) -> ldtrefl.Mesh:
    """A torus of 480,000 triangles."""
    return shapes.make("torus", {"minor": minor, "segments": list(segments)})


DENSE = {
    "thin limbs": lambda: ball_with_limbs(0.05),
    "limbs": lambda: ball_with_limbs(0.15),
    "two sheets": two_sheets,
    "a scan": lambda: refined_scan(0.0),
    "a rough scan": lambda: refined_scan(0.3),
    "a faceted torus": lambda: thin_torus(0.12, (3000, 80)),
    "a thin torus": lambda: thin_torus(0.12),
    "a thinner torus": lambda: thin_torus(0.04),
}


def all_rays(mesh: ldtrefl.Mesh) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Rays from about and from within the box of a mesh in unit space, and such as a ball beside it reflects."""
    origins, directions = rays_about(mesh, 100_000, 4)
    rng = np.random.default_rng(5)
    within = rng.uniform(*mesh.bounds, (50_000, 3)).astype(np.float32)
    ways = rng.normal(size=(50_000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    points, reflected = mirror_rays(900, 600)
    # The ball beside the unit cube, and not in it.
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    beside = (0.65 * (points - middle) + [-0.25, 1.6, -0.2]).astype(np.float32)
    random = np.concatenate([origins, within]), np.concatenate([directions, ways]).astype(np.float32)
    return {"random": random, "mirror": (beside, reflected)}


@pytest.mark.parametrize("name", DENSE)
def test_dense_meshes_are_right_at_silhouettes(name: str) -> None:
    """The default's limits on what patches are worst at: thin limbs, folds, rims with a surface behind."""
    given = DENSE[name]()
    mesh = ldtrefl.Mesh(given.unit_vertices, given.faces)
    exact = ldtrefl.peel(mesh.vertices, mesh.faces, RESOLUTION, quality="exact")
    default = ldtrefl.peel(mesh.vertices, mesh.faces, RESOLUTION)
    for rays, (origins, directions) in all_rays(mesh).items():
        truth, found = exact.trace(origins, directions), default.trace(origins, directions)
        true_hit, hit = truth.triangle >= 0, found.triangle >= 0
        both, count = hit & true_hit, int(true_hit.sum())
        off = np.abs(found.t[both].astype(float) - truth.t[both]) * 64.0
        wrong = 100.0 * (int((hit & ~true_hit).sum()) + int((off > 1.0).sum())) / count
        missed = 100.0 * int((true_hit & ~hit).sum()) / count
        p99, p999 = np.percentile(off, [99.0, 99.9])
        what = f"{name}, {rays}: wrong {wrong:.3f}%, missed {missed:.3f}%, p99 {p99:.3f}, p99.9 {p999:.3f}"
        assert wrong <= 0.2 and missed <= 0.05 and p99 <= 0.2 and p999 <= 1.0, what


def chosen(mesh: ldtrefl.Mesh, quality: Quality = "balanced") -> record_choice.PatchRecords | None:
    return choose_records(DeviceMesh(mesh, DEVICE), RESOLUTION, quality)


def test_patches_must_save_two_thirds_of_the_bytes() -> None:
    assert pays(1_000_000, 50_000, 0) and pays(1_000_000, 50_000, 250_000)
    assert not pays(1_000_000, 50_000, 310_000) and not pays(1_000_000, 400_000, 0)
    mesh = shapes.make("torus_knot", {"segments": [2000, 125]})
    mixed = chosen(mesh)
    assert mixed is not None
    items = mixed.numbers.numpy()
    assert len(np.unique(items)) == len(items) and items.min() >= -len(mixed.patches) and items.max() < len(mesh.faces)
    assert pays(len(mesh.faces), int((items < 0).sum()), int((items >= 0).sum()))


@pytest.mark.parametrize("segments", [(2000, 125), (5000, 200)])
def test_dense_knots_stay_few_patches(segments: tuple[int, int]) -> None:
    """The number of records, and with it the time of a search, does not depend on the mesh."""
    mixed = chosen(shapes.make("torus_knot", {"segments": list(segments)}))
    assert mixed is not None and (mixed.numbers.numpy() < 0).all() and len(mixed.numbers) < 70_000


def test_patches_are_smaller_where_limbs_are_thin() -> None:
    sides = []
    for minor in (0.35, 0.12):
        mixed = chosen(thin_torus(minor))
        assert mixed is not None
        sides.append(RESOLUTION / max(mixed.frame.size))
    assert sides[0] == pytest.approx(record_choice.PATCH_TEXELS["balanced"], rel=0.01) and sides[1] < 0.9 * sides[0]


@pytest.mark.parametrize(
    ("mesh", "quality"),
    [
        (lambda: shapes.make("torus_knot", {"segments": [600, 80]}), "balanced"),  # as large as patches
        (lambda: shapes.make("torus_knot", {"segments": [2000, 125]}), "exact"),
        (lambda: refined_scan(0.3), "balanced"),
        (lambda: refined_scan(0.3), "fast"),
    ],
)
def test_what_cannot_pay_is_not_surveyed(mesh: object, quality: Quality, monkeypatch: pytest.MonkeyPatch) -> None:
    def survey(*_: object, **__: object) -> None:
        raise AssertionError("a survey in vain")

    monkeypatch.setattr(record_choice, "Survey", survey)
    assert chosen(mesh(), quality) is None


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e-90, 1.0, 1e90])
def test_triangles_without_area_are_kept(size: float) -> None:
    """Nothing can stand for what has no surface, and no size of a mesh is too large or too small to say so."""
    rng = np.random.default_rng(0)
    along = rng.uniform(-1, 1, (3 * 60_000, 1)) * np.array([[1.0, 2.0, 3.0]]) * size
    faces = np.arange(3 * 60_000).reshape(-1, 3)
    assert not ldtrefl.peel(along, faces).tree.patches
