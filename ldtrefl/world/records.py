"""What kernels read of a scene: an object, lights, and all lights with the environment.

Three spaces. *World*: the scene file's. *Device*: the world moved and scaled alike along all axes
(``device_space.py``); all rays and positions in kernels are in it. Positions in it are float64, distances and
directions float32. *Unit*: an object's own vertices with their bounding box's longest side from -1 to 1, where float32
holds at any scale and offset.
"""

from __future__ import annotations

import warp as wp


@wp.struct
class ObjectRecord:
    """An object: its mesh, place and material."""

    vertices: wp.array(dtype=wp.vec3)  # unit space
    exact_vertices: wp.array(dtype=wp.vec3d)  # the same in float64 if the mesh has outliers, else empty
    normals: wp.array(dtype=wp.vec3)  # unit space, not always of unit length, zero where undefined; empty if unused
    uvs: wp.array(dtype=wp.vec2)  # texture coordinates, v = 0 at the bottom; empty if the mesh has none, or unused
    faces: wp.array(dtype=wp.vec3i)
    device_from_unit: wp.mat44d
    unit_from_device: wp.mat44d
    unit_from_direction: wp.mat33  # the linear part of unit_from_device, over unit_per_device
    unit_per_device: float  # a power of two, so that squares stay in float32's range however small the object is
    normal_from_unit: wp.mat33  # inverse transpose of device_from_unit's linear part
    centre: wp.vec3d  # bounding sphere, device space
    radius: float  # of that sphere, device units
    smooth: int  # 1 for interpolated shading normals, 0 for the facets'
    fresnel: int  # 1 for Schlick's approximation
    albedo: wp.vec3
    emission: wp.vec3  # radiance
    mirror: wp.vec3  # specular reflectance
    returns: int  # from which sides rays can come back to it (``scene/convexity.py``); both if nobody looked
    part_first: wp.array(dtype=wp.int32)  # first triangle of each part
    part_color: wp.array(dtype=wp.vec3)  # linear, times albedo
    part_texture: wp.array(dtype=wp.vec4i)  # first texel, width, height, 1 for bytes; width 0 without a texture
    texels: wp.array(dtype=wp.vec3)  # all parts' textures of floats, linear, row 0 at v = 1
    texel_bytes: wp.array(dtype=wp.vec3ub)  # all parts' textures of 8 bits, sRGB, row 0 at v = 1
    part_mips: wp.array(dtype=wp.int32)  # first texel of the mip maps of each part's texture; empty if not filtered
    mip_texels: wp.array(dtype=wp.vec3)  # the mip maps of textures of floats
    mip_bytes: wp.array(dtype=wp.vec3ub)  # and of those of 8 bits
    decoded: wp.array(dtype=float)  # the linear value of every byte
    reflects: int  # 1 if rays leave all of its surface, 2 if they may leave some parts by its look, 0 if none do
    look: int  # its number among the scene's looks; -1 if colours, textures and mirror above are all


@wp.struct
class LightRecord:
    """A light in device space."""

    is_point: int  # 1 for a point light, 0 for a directional one
    towards: wp.vec3  # directional: the way to the light, unit
    position: wp.vec3d  # point: where it is
    radiance: wp.vec3  # directional: as in the scene; point: intensity in device units


SPHERE = wp.constant(0)
RECTANGLE = wp.constant(1)
SPOT = wp.constant(2)


@wp.struct
class ShapedLightRecord:
    """A light with a shape or a cone, in device space."""

    kind: int  # SPHERE, RECTANGLE or SPOT
    distant: int  # 1 for a rectangle so far away that it is seen in one direction from everywhere; the picture shows it
    position: wp.vec3d  # where its middle is; distant: the way to it, unit
    radius: float  # sphere: of it; spot: that shadows are as soft as a sphere's; 0 for hard ones
    axis: wp.vec3  # rectangle, spot: the way that it shines, unit
    right: wp.vec3  # rectangle: from its middle to the middle of a side; distant: in distances of its middle
    up: wp.vec3  # rectangle: the same at right angles
    cone: wp.vec2  # spot: factor and offset of the cosine with the axis; what they give, from 0 to 1, is squared
    radiance: wp.vec3  # of its surface; spot: intensity in device units
    samples: int  # shadow rays
    visible: int  # 1 if its shape is seen


@wp.struct
class LightingRecord:
    """Lights and environment."""

    lights: wp.array(dtype=LightRecord)
    shaped: wp.array(dtype=ShapedLightRecord)  # further lights
    ambient: wp.vec3  # added irradiance / pi
    sky: wp.vec3  # radiance straight up
    ground: wp.vec3  # radiance straight down
    up: wp.vec3  # the camera's, unit
    image_size: wp.vec2i  # rows and columns of the equirectangular picture; 0 without one
    image: wp.array2d(dtype=wp.vec3)  # its pixels if they are floats, linear; else empty
    image_bytes: wp.array2d(dtype=wp.vec3ub)  # its pixels if they have 8 bits, sRGB; else empty
    turn: float  # of the picture about ``up``, counter-clockwise seen from above; from 0 to below 1, a whole turn
    strength: float  # times the picture
    sun: wp.vec3  # unit vector to the disc that stands before the picture
    sun_size: float  # its radius on the unit sphere, squared; 0 without one
    sun_radiance: wp.vec3  # of the disc
    decoded: wp.array(dtype=float)  # the linear value of every byte
    shadows: int  # 1 if lights cast shadows
    occlusion_distance: float  # how far off what dims ambient light may stand, device units
    occlusion_samples: int  # rays that ask for it
    noise: wp.array2d(dtype=float)  # the mask that shifts samples from pixel to pixel; empty if there are none
