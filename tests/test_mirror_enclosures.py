"""What touches mirrors, and what stands inside, against paths among spheres and boxes in closed form.

Rooms and visors about the camera and the mirror, mirrors in mirrors, the camera in a mirror.
"""

import dataclasses
import functools

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene
from tests.analytic_paths import Box, Seen, Solid, Sphere, seen
from tests.frame.flat_mirror import camera_directions

METHODS = ["bvh", "ldt"]
SKY, GROUND = np.array([0.5, 0.7, 1.0]), np.array([0.05, 0.2, 0.05])
ORANGE, BLUE, WHITE = (0.9, 0.4, 0.1), (0.1, 0.3, 0.8), (0.7, 0.7, 0.6)
MIRROR = 0.9

SEGMENTS = (256, 128)
"""Of spheres: they then stand 8e-5 of their radius off their facets."""

CLOSE = 3.0
"""Degrees of a field of view that the contact fills."""

OFF, FLAT_OFF = 1e-3, 1e-6
"""Radiance by which no pixel may be off that is more than a pixel from an edge: by facets of curved mirrors, and where
all mirrors are flat by the rounding of float32."""


@dataclasses.dataclass(frozen=True)
class Case:
    """Solids, where they are seen from, and how many mirrors a path may meet."""

    solids: tuple[Solid, ...]
    eye: tuple[float, float, float]
    look_at: tuple[float, float, float]
    fov: float = 60.0
    bounces: int = 4


FLOOR = Box(half=(4, 4, 0), mirror=MIRROR)
LAMP = Box(centre=(-1.5, -0.2, 0.3), half=(0.2, 0.3, 0.3), emission=ORANGE)

TOUCHING = {
    "a ball on a mirror floor": Case(
        (FLOOR, Sphere(centre=(0, 0, 1), radius=1, emission=ORANGE)), (0.4, -3.2, 1.4), (0, 0, 0), 28
    ),
    "a box on a mirror floor": Case(
        (FLOOR, Box(centre=(0, 0, 0.6), half=(0.6, 0.6, 0.6), emission=ORANGE)), (1.4, -3.0, 1.4), (0.6, -0.6, 0), 28
    ),
    "a mirror box on a mirror floor": Case(
        (FLOOR, LAMP, Box(centre=(0, 0, 0.6), half=(0.6, 0.6, 0.6), mirror=MIRROR)),
        (-1.4, -3.0, 1.4),
        (-0.6, -0.6, 0),
        28,
    ),
    "a mirror box on a floor that glows": Case(
        (Box(half=(0.9, 0.9, 0), emission=BLUE), Box(centre=(0, 0, 0.6), half=(0.6, 0.6, 0.6), mirror=MIRROR)),
        (1.4, -3.0, 1.4),
        (0.6, -0.6, 0),
        28,
    ),
    "a mirror ball on a floor that glows": Case(
        (Box(half=(0.9, 0.9, 0), emission=BLUE), Sphere(centre=(0, 0, 1), radius=1, mirror=MIRROR)),
        (0.4, -3.2, 1.4),
        (0, 0, 0),
        28,
        1,
    ),
}

ROOM = Box(half=(2, 2, 2), emission=WHITE, open_faces=(0, 5))
"""Without the walls at +x and below."""

INSIDE = {
    "a mirror box and the camera in an open room": Case(
        (ROOM, Box(centre=(0.2, 0.9, -0.4), half=(0.5, 0.3, 0.6), mirror=MIRROR)), (-0.9, -1.4, 0.5), (0.2, 0.9, -0.4)
    ),
    "a mirror ball and the camera in an open room": Case(
        (ROOM, Sphere(centre=(0.2, 0.9, -0.4), radius=0.6, mirror=MIRROR)), (-0.9, -1.4, 0.5), (0.2, 0.9, -0.4), 45
    ),
    "a mirror box and the camera in a visor": Case(
        (Sphere(radius=2, top=0, emission=WHITE), Box(centre=(0, 0.6, -0.5), half=(0.4, 0.3, 0.4), mirror=MIRROR)),
        (0.6, -1.0, -1.2),
        (0, 0.6, -0.4),
        45,
    ),
    "a mirror ball and the camera in a visor": Case(
        (Sphere(radius=2, top=0, emission=WHITE), Sphere(centre=(0, 0.6, -0.5), radius=0.4, mirror=MIRROR)),
        (0.9, -1.0, -0.2),
        (0, 0.6, -0.4),
        45,
    ),
    "a mirror box in a mirror room": Case(
        (
            Box(half=(2, 2.3, 1.7), mirror=MIRROR),
            Box(centre=(0.4, 0.5, -0.9), half=(0.5, 0.4, 0.6), mirror=MIRROR),
            Box(centre=(-0.9, 0.7, 0.2), half=(0.2, 0.3, 0.2), emission=ORANGE),
        ),
        (-0.9, -1.6, 0.5),
        (0.2, 0.9, -0.4),
        bounces=4,
    ),
    "the camera in a mirror room with an open wall": Case(
        (
            Box(half=(2, 2.3, 1.7), mirror=MIRROR, open_faces=(1,)),
            Box(centre=(0.3, 0.7, -0.5), half=(0.2, 0.3, 0.4), emission=ORANGE),
        ),
        (-0.9, -1.6, 0.5),
        (0.2, 0.9, -0.4),
        80,
        bounces=8,
    ),
    "the camera in a mirror ball": Case(
        (Sphere(radius=2, mirror=MIRROR), Sphere(centre=(0.4, 1.0, -0.3), radius=0.4, emission=ORANGE)),
        (-0.3, -1.0, 0.4),
        (0.4, 1.0, -0.3),
        80,
        bounces=2,
    ),
    "a mirror ball in a mirror ball that is cut off": Case(
        (
            Sphere(radius=2, top=0, mirror=MIRROR),
            Sphere(centre=(0.2, 0.5, -0.8), radius=0.5, mirror=MIRROR),
            Box(centre=(-0.9, 0.6, -0.4), half=(0.2, 0.3, 0.2), emission=ORANGE),
        ),
        (0.1, -1.3, 0.6),
        (0, 0.5, -0.8),
        bounces=2,
    ),
}


def object_of(solid: Solid, size: float) -> Object:
    """A solid as triangles."""
    glow = Material(albedo=(0, 0, 0), emission=solid.emission, mirror=(solid.mirror,) * 3)
    place = {"translate": tuple(size * np.array(solid.centre)), "material": glow}
    if isinstance(solid, Sphere):
        mesh = shapes.make("sphere", {"segments": SEGMENTS})
        if solid.top < solid.radius:
            faces = mesh.faces[mesh.vertices[mesh.faces].mean(axis=1)[:, 2] < solid.top / solid.radius]
            mesh = ldtrefl.Mesh(mesh.vertices, faces, mesh.normals)
        return Object(mesh=mesh, scale=size * solid.radius, **place)
    assert isinstance(solid, Box)
    if solid.half[2] == 0.0:
        return Object(
            shape="plane", scale=tuple(size * h for h in (*solid.half[:2], solid.size)), smooth=False, **place
        )
    mesh = shapes.make("box")
    axis = np.ptp(mesh.vertices[mesh.faces], axis=1).argmin(axis=1)
    face = 2 * axis + (mesh.vertices[mesh.faces[:, 0], axis] < 0)
    mesh = ldtrefl.Mesh(mesh.vertices, mesh.faces[~np.isin(face, solid.open_faces)])
    return Object(mesh=mesh, scale=tuple(size * h for h in solid.half), smooth=False, **place)


def scene_of(case: Case, size: float = 1.0) -> Scene:
    """A case in triangles, of a size."""
    eye, look_at = (tuple(size * np.array(point)) for point in (case.eye, case.look_at))
    return Scene(
        camera=Camera(eye=eye, look_at=look_at, fov_y=case.fov, width=120, height=90),
        environment=Environment(sky=tuple(SKY), ground=tuple(GROUND)),
        lighting=Lighting(ambient=(0, 0, 0)),
        objects=tuple(object_of(solid, size) for solid in case.solids),
    )


@functools.cache
def truth(case: Case) -> Seen:
    camera = scene_of(case).camera
    directions = camera_directions(camera)
    o = np.broadcast_to(np.array(case.eye, float), directions.shape)
    return seen(case.solids, o, directions, (camera.height, camera.width), sky=SKY, ground=GROUND, most=case.bounces)


def rendered(case: Case, method: str, size: float = 1.0) -> ldtrefl.Frame:
    return ldtrefl.render(scene_of(case, size), method, max_bounces=case.bounces)


def shows_enough(frame: ldtrefl.Frame, case: Case) -> bool:
    """Whether mirrors fill some of the picture away from edges, and more than one thing is seen in them."""
    compared = frame.reflector_mask & truth(case).is_clear
    return bool(compared.mean() > 0.08 and truth(case).image[compared].std(axis=0).max() > 0.03)


def largest_error(frame: ldtrefl.Frame, case: Case) -> float:
    """Radiance by which the worst of the pixels is off that are clear of edges; NaN if one of them is."""
    return float(np.abs(frame.image - truth(case).image)[truth(case).is_clear].max())


def allowed(case: Case) -> float:
    is_flat = all(isinstance(solid, Box) or not solid.mirror for solid in case.solids)
    return FLAT_OFF if is_flat else OFF


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("size", [1.0, 1e-4, 1e4])
@pytest.mark.parametrize("name", TOUCHING)
def test_what_touches_a_mirror_shows_no_gap_and_no_speckle(name: str, size: float, method: str) -> None:
    case = TOUCHING[name]
    frame = rendered(case, method, size)
    assert shows_enough(frame, case)
    assert largest_error(frame, case) <= allowed(case)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", [name for name, case in TOUCHING.items() if FLOOR in case.solids])
def test_close_by_the_floor_may_be_a_million_times_larger(name: str, method: str) -> None:
    far = dataclasses.replace(FLOOR, half=(1e6, 1e6, 0))
    solids = tuple(far if solid is FLOOR else solid for solid in TOUCHING[name].solids)
    case = dataclasses.replace(TOUCHING[name], solids=solids, fov=CLOSE)
    frame = rendered(case, method)
    assert truth(case).is_clear.mean() > 0.9
    assert largest_error(frame, case) <= allowed(case)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", INSIDE)
def test_inside(name: str, method: str) -> None:
    case = INSIDE[name]
    frame = rendered(case, method)
    assert shows_enough(frame, case)
    assert largest_error(frame, case) <= allowed(case)
