"""Rays against the few triangles far outside a mesh's bulk (``world/outliers.py``), in float64."""

from __future__ import annotations

import warp as wp

from ldtrefl.device.native_sources import native_body
from ldtrefl.geometry.vectors import as_double, as_single
from ldtrefl.tracing.hit import Hit, no_hit
from ldtrefl.tracing.tracer import Query
from ldtrefl.world.outliers import BOX_MARGIN, Outliers, OutlierTriangle

NEGLIGIBLE = 1.0e-30
"""A component of a direction that is smaller than this is taken for this: the ray runs along the sides of boxes."""

ENTERED = """
    typedef Vectors V;
    const float* box = boxes.data + 48 * group;
    V::Eight in = V::eight(0.0f), out = V::eight(t_max);
    const float x = (float)origin[0], y = (float)origin[1], z = (float)origin[2];
    const float start[3] = {x, y, z};
    const float margin = BOX_MARGIN * V::greater(V::greater(V::greater(x, -x), V::greater(y, -y)), V::greater(z, -z));
    for (int k = 0; k < 3; ++k) {
        float along = direction[k];
        if (along < NEGLIGIBLE && along > -NEGLIGIBLE) along = along < 0.0f ? -NEGLIGIBLE : NEGLIGIBLE;
        const V::Eight inverse = V::eight(1.0f / along);
        const V::Eight a = (V::load(box + 16 * k) - V::eight(start[k] + margin)) * inverse;
        const V::Eight b = (V::load(box + 16 * k + 8) - V::eight(start[k] - margin)) * inverse;
        in = V::greater(V::lesser(a, b), in);
        out = V::lesser(V::greater(a, b), out);
    }
    // The margin covers the rounding of the products, which grows with them.
    return V::bits(in <= out + V::eight(BOX_MARGIN) * V::greater(in, V::greater(out, -out)));
"""


@wp.func_native(native_body({"BOX_MARGIN": BOX_MARGIN, "NEGLIGIBLE": NEGLIGIBLE}, ("device/vectors.h",), ENTERED))
def boxes_entered(
    boxes: wp.array(dtype=wp.float32), group: int, origin: wp.vec3d, direction: wp.vec3, t_max: float
) -> wp.int32:
    """A bit for each of a group's eight boxes that a ray may enter."""
    ...


@wp.func
def outlier_hit(outlier: OutlierTriangle, origin: wp.vec3d, direction: wp.vec3, t_max: float) -> Hit:
    """Test a triangle (Moeller and Trumbore 1997)."""
    hit = no_hit()
    zero, one = wp.float64(0.0), wp.float64(1.0)
    way = as_double(direction)
    edge_u, edge_v = outlier.edge_u, outlier.edge_v
    p = wp.cross(way, edge_v)
    determinant = wp.dot(edge_u, p)
    if determinant != zero:
        s = origin - outlier.a
        u = wp.dot(s, p) / determinant
        q = wp.cross(s, edge_u)
        v = wp.dot(way, q) / determinant
        t = wp.dot(edge_v, q) / determinant
        if u >= zero and v >= zero and u + v <= one and t >= zero and t < wp.float64(t_max):
            hit.t = float(t)
            hit.triangle = outlier.triangle
            hit.u = float(u)
            hit.v = float(v)
            hit.normal = as_single(wp.normalize(wp.cross(edge_u, edge_v)))
    return hit


@wp.func
def first_outlier_hit(outliers: Outliers, origin: wp.vec3d, direction: wp.vec3, t_max: float) -> Hit:
    """The outlier that a ray in unit space meets first."""
    hit = no_hit()
    for group in range((outliers.triangles.shape[0] + 7) / 8):
        entered = boxes_entered(outliers.boxes, group, origin, direction, t_max)
        if entered != 0:
            for k in range(8):
                if (entered >> k) & 1 == 1 and 8 * group + k < outliers.triangles.shape[0]:
                    nearest = t_max
                    if hit.triangle >= 0:
                        nearest = hit.t
                    one = outlier_hit(outliers.triangles[8 * group + k], origin, direction, nearest)
                    if one.triangle >= 0:
                        hit = one
    return hit


@wp.func
def merge_outliers(outliers: Outliers, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)):
    """Test rays against the outliers, and replace the hits in the bulk that lie behind one."""
    if outliers.triangles.shape[0] > 0:
        for i in range(count):
            t_max = queries[i].t_max
            if hits[i].triangle >= 0:
                t_max = hits[i].t
            outlier = first_outlier_hit(outliers, queries[i].origin, queries[i].direction, t_max)
            if outlier.triangle >= 0:
                outlier.steps = hits[i].steps
                hits[i] = outlier


@wp.func
def add_outliers_met(outliers: Outliers, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)):
    """Find whether the rays that have met nothing in the bulk meet an outlier."""
    if outliers.triangles.shape[0] > 0:
        for i in range(count):
            if hits[i].triangle < 0:
                outlier = first_outlier_hit(outliers, queries[i].origin, queries[i].direction, queries[i].t_max)
                hits[i].triangle = outlier.triangle


@wp.func
def is_outlier_met(outliers: Outliers, query: Query) -> bool:
    """Whether a ray meets an outlier."""
    if outliers.triangles.shape[0] == 0:
        return False
    return first_outlier_hit(outliers, query.origin, query.direction, query.t_max).triangle >= 0
