"""Scenes of glTF's materials, and the surfaces of Mitsuba's that mean the same."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Reflection, Scene
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.surface_material import SurfaceMaterial
from ldtrefl.shading.finish import LEAST_ROUGHNESS

from .mitsuba_scene import base_of, colored, mitsuba
from .two_plugins import Layers, Surface

TEXTURES = Path(__file__).parent.parent.parent / "scenes" / "textures"
GOLD = (0.143, 0.375, 1.442), (3.983, 2.386, 1.603)
"""Real and imaginary part of gold's index of refraction at 630, 532 and 465 nm."""
ROUGHNESSES = 0.15, 0.3, 0.45, 0.6, 0.8, 1.0
VARNISH_ROUGHNESSES = 0.05, 0.1, 0.15, 0.2, 0.25, 0.3
INDICES = 1.2, 1.5, 2.0, 2.4
DARK = Environment(sky=(0.0, 0.0, 0.0), ground=(0.0, 0.0, 0.0))
UNSHADOWED = Lighting(ambient=(0.0, 0.0, 0.0), shadows=False)
BLACK: dict[str, object] = {"type": "rgb", "value": [0.0, 0.0, 0.0]}
VARNISH = 1.5
"""Its index of refraction (KHR_materials_clearcoat)."""
NO_RAYS = Reflection(rough_limit=0.0)
"""With it nothing rough sends rays: it shows the environment."""


@dataclass(frozen=True)
class MaterialScene:
    """A scene of ours, and what Mitsuba is given in its place."""

    scene: Scene
    surface_of: Callable[[Object, Part], Surface]
    plugins: str
    """Mitsuba's, by name."""
    differs: str
    """In what the models do, where the surfaces are put together as ours are."""


SCHLICK = "ours is Schlick's reflectance, Mitsuba's the exact one of a dielectric"


def metallic_of(entry: Object, part: Part) -> float:
    """How metallic a part is."""
    own = entry.material.metallic
    return part.material.metallic if own is None else own


def roughness_of(entry: Object, part: Part) -> float:
    """How rough a part is, as lights see it."""
    own = entry.material.roughness
    return max(part.material.roughness if own is None else own, LEAST_ROUGHNESS)


def ior_of(entry: Object, part: Part) -> float:
    """A part's index of refraction."""
    return part.material.ior if entry.material.ior is None else entry.material.ior


def base_color(entry: Object, part: Part) -> dict[str, object]:
    """A part's base colour as Mitsuba reads it."""
    return colored(mitsuba(), *base_of(entry, part), np.zeros(3))


def principled(entry: Object, part: Part) -> Surface:
    """A metal, or a dielectric with its base."""
    color, metallic, ior = base_of(entry, part)[0], metallic_of(entry, part), ior_of(entry, part)
    if 0.0 < metallic < 1.0:
        raise ValueError(f"metallic must be 0 or 1, got {metallic}")
    base, roughness = base_color(entry, part), roughness_of(entry, part)
    plugin = {"type": "principled", "base_color": base, "metallic": metallic, "roughness": roughness, "eta": ior}
    if metallic == 1.0:
        red, green, blue = color.tolist()
        return Surface(plugin, layers=Layers(roughness, (red, green, blue), plugin))
    return Surface(plugin, layers=_dielectric(roughness, ior, base))


def _dielectric(roughness: float, ior: float, base: dict[str, object]) -> Layers:
    """Microfacets that are Mitsuba's principled ones over black, above its diffuse base."""
    low = ((ior - 1.0) / (ior + 1.0)) ** 2
    black = {"type": "principled", "base_color": BLACK, "roughness": roughness, "eta": ior}
    return Layers(roughness, (low, low, low), black, {"type": "diffuse", "reflectance": base})


def varnished(entry: Object, part: Part) -> Surface:
    """A matt base beneath a varnish."""
    return _plastic(base_color(entry, part), part.material.clearcoat_roughness, VARNISH)


def _plastic(base: dict[str, object], roughness: float, ior: float) -> Surface:
    shape = {"distribution": "ggx", "alpha": roughness**2, "int_ior": ior, "ext_ior": 1.0}
    lights = {"type": "roughplastic", **shape, "diffuse_reflectance": base}
    return Surface(lights, layers=_dielectric(roughness, ior, base))


def gold_or_matt(entry: Object, part: Part) -> Surface:
    """Gold by its index of refraction where ours is a smooth metal."""
    if entry.material.metallic is None:
        return Surface({"type": "diffuse", "reflectance": base_color(entry, part)})
    eta, k = ({"type": "rgb", "value": list(values)} for values in GOLD)
    rough = {"type": "roughconductor", "distribution": "ggx", "alpha": LEAST_ROUGHNESS**2}
    return Surface({**rough, "eta": eta, "k": k}, {"type": "conductor", "eta": eta, "k": k})


def glazed_or_matt(entry: Object, part: Part) -> Surface:
    """A smooth dielectric over a coloured base where ours is one."""
    if entry.material.ior is None:
        return Surface({"type": "diffuse", "reflectance": base_color(entry, part)})
    base, ior = base_color(entry, part), ior_of(entry, part)
    smooth = {"type": "plastic", "int_ior": ior, "ext_ior": 1.0, "diffuse_reflectance": base}
    return dataclasses.replace(_plastic(base, LEAST_ROUGHNESS, ior), rays=smooth)


def gold_color() -> tuple[float, float, float]:
    """What gold reflects at normal incidence: ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2)."""
    eta, k = np.array(GOLD)
    red, green, blue = (((eta - 1.0) ** 2 + k**2) / ((eta + 1.0) ** 2 + k**2)).tolist()
    return red, green, blue


def balls(materials: list[list[Material]], width: int) -> Scene:
    """Rows of balls beside each other, in the light of a direction and of a point."""
    mesh = shapes.make("sphere")
    objects = [
        _placed(mesh, (2.3 * column, 0.0, -2.3 * row), material)
        for row, line in enumerate(materials)
        for column, material in enumerate(line)
    ]
    across, down = 2.3 * len(materials[0]), 2.3 * len(materials)
    middle = (0.5 * across - 1.15, 0.0, 1.15 - 0.5 * down)
    height = 16 * round(width * down / across / 16)
    camera = Camera(
        eye=(middle[0], -30.0, middle[2]),
        look_at=middle,
        fov_y=float(np.degrees(2.0 * np.arctan(0.5 * down / 30.0))),
        width=width,
        height=height,
    )
    return Scene(
        camera=camera,
        environment=DARK,
        lighting=UNSHADOWED,
        reflection=NO_RAYS,
        lights=_lights(middle, 6.0),
        objects=tuple(objects),
    )


def _placed(mesh: Mesh, at: tuple[float, float, float], material: Material) -> Object:
    return Object(mesh=mesh, translate=at, material=material)


def _lights(middle: tuple[float, float, float], size: float) -> tuple[Light, ...]:
    x, y, z = middle
    return (
        Light(kind="directional", direction=(-0.5, 1.0, -0.8), radiance=(0.9, 0.85, 0.8)),
        Light(
            kind="point",
            position=(x - 1.5 * size, y - 0.5 * size, z + size),
            intensity=(0.8 * size**2, size**2, 1.4 * size**2),
        ),
    )


def metals(width: int) -> MaterialScene:
    """Gold and a blue metal, from smooth to rough."""
    colors = (gold_color(), (0.2, 0.4, 0.8))
    rows = [[Material(albedo=color, metallic=1.0, roughness=rough) for rough in ROUGHNESSES] for color in colors]
    return MaterialScene(
        balls(rows, width), principled, "`principled`, metallic 1", "steps of our table of what is lost"
    )


def highlights(width: int) -> MaterialScene:
    """Dielectrics that are black but for what they mirror."""
    rows = [[Material(albedo=(0, 0, 0), roughness=rough, ior=ior) for rough in ROUGHNESSES] for ior in INDICES]
    return MaterialScene(balls(rows, width), principled, "`principled`, black", SCHLICK)


def plastics(width: int) -> MaterialScene:
    """Dielectrics over coloured bases."""
    colors = (0.8, 0.2, 0.1), (0.1, 0.5, 0.2), (0.7, 0.7, 0.7), (0.1, 0.2, 0.6)
    rows = [
        [Material(albedo=color, roughness=rough, ior=ior) for rough in ROUGHNESSES]
        for color, ior in zip(colors, INDICES, strict=True)
    ]
    return MaterialScene(balls(rows, width), principled, "`principled`", SCHLICK)


def varnishes(width: int) -> MaterialScene:
    """Matt bases beneath a varnish."""
    sphere, objects = shapes.make("sphere"), []
    scene = balls([[Material(albedo=(0.6, 0.3, 0.1)) for _ in VARNISH_ROUGHNESSES]], width)
    for entry, rough in zip(scene.objects, VARNISH_ROUGHNESSES, strict=True):
        coat = SurfaceMaterial(clearcoat=1.0, clearcoat_roughness=rough)
        mesh = Mesh(sphere.vertices, sphere.faces, sphere.stored_normals, sphere.uvs, (Part(0, coat),))
        objects.append(_placed(mesh, entry.translate, entry.material))
    return MaterialScene(scene.with_objects(dict(enumerate(objects))), varnished, "`roughplastic`", SCHLICK)


def of_file(file: Path, eye: tuple[float, float, float], width: int) -> MaterialScene:
    """A mesh file's own materials: factors and textures."""
    entry = Object(mesh=str(file), up_axis="y", material=Material(albedo=(1, 1, 1)))
    points = entry.geometry.vertices @ entry.world_from_object()[:3, :3].T + entry.world_from_object()[:3, 3]
    x, y, z = (0.5 * (points.min(axis=0) + points.max(axis=0))).tolist()
    size = float(np.ptp(points, axis=0).max())
    camera = Camera(
        eye=(x + size * eye[0], y + size * eye[1], z + size * eye[2]),
        look_at=(x, y, z),
        fov_y=26.0,
        width=width,
        height=width * 3 // 4,
    )
    scene = Scene(
        camera=camera,
        environment=DARK,
        lighting=UNSHADOWED,
        reflection=NO_RAYS,
        lights=_lights((x, y, z), size),
        objects=(entry,),
    )
    return MaterialScene(scene, principled, "`principled`", SCHLICK)


def golden(width: int) -> MaterialScene:
    """Smooth gold, which mirrors."""
    material = Material(albedo=gold_color(), metallic=1.0, roughness=0.0)
    differs = "ours is Schlick's reflectance, Mitsuba's the exact one of gold's complex index of refraction"
    return MaterialScene(_mirroring(material, width), gold_or_matt, "`conductor` and `roughconductor`", differs)


def glazed(width: int) -> MaterialScene:
    """A smooth dielectric over a coloured base, which mirrors."""
    material = Material(albedo=(0.5, 0.1, 0.05), roughness=0.0, ior=1.5)
    return MaterialScene(_mirroring(material, width), glazed_or_matt, "`plastic` and `roughplastic`", SCHLICK)


def _mirroring(material: Material, width: int) -> Scene:
    """A ball and a standing sheet of a smooth material, which mirror textured things, each other and the sky."""
    bricks, planks, ball = (
        Material(albedo=(0.9, 0.9, 0.9), texture=str(TEXTURES / f"{name}.png"))
        for name in ("bricks", "planks", "beach_ball")
    )
    objects = (
        Object(shape="plane", scale=6.0, translate=(0, 0, -1), material=planks),
        Object(shape="sphere", translate=(-1.2, 0, 0), material=material),
        Object(shape="plane", scale=2.0, rotate=(1, 0, 0, 90), translate=(0, 2.2, 1), material=material),
        Object(shape="box", scale=0.5, rotate=(0, 0, 1, 25), translate=(1.3, -0.6, -0.4), material=bricks),
        Object(shape="sphere", scale=0.5, translate=(0.1, -1.4, -0.5), material=ball),
    )
    return Scene(
        camera=Camera(eye=(1.5, -7, 2), look_at=(0, 0, 0.2), fov_y=34.0, width=width, height=width * 2 // 3),
        environment=Environment(sky=(0.4, 0.6, 0.9), ground=(0.35, 0.3, 0.25)),
        lighting=UNSHADOWED,
        reflection=Reflection(threshold=0.0, least_weight=0.0, max_bounces=4),
        lights=_lights((0.0, 0.0, 0.0), 3.0),
        objects=objects,
    )
