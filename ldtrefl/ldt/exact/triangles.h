// A ray against a block of eight triangles: which it passes through in float32, watertight; where, in float64.

struct TreeTriangles : TreeBoxes {
    // Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection": in coordinates in which the ray is the third
    // axis, the signs of three areas. Two triangles compute the same for an edge that they share, but for the sign. A
    // ray through the edge, or so near that the area is 0, meets both.
    SHARED bool meet_triangles(const float* rows, int row, Rays& rays, int ray, bool any_hit) {
        const float* a = rows + (size_t)row * LANES;
        const float* b = a + 3 * LANES;
        const float* c = b + 3 * LANES;
        const int x = rays.axis_row[0][ray], y = rays.axis_row[1][ray], z = rays.axis_row[2][ray];
        const Eight ox = eight(rays.permuted_origin[0][ray]), oy = eight(rays.permuted_origin[1][ray]);
        const Eight oz = eight(rays.permuted_origin[2][ray]);
        const Eight sx = eight(rays.shear[0][ray]), sy = eight(rays.shear[1][ray]);
        const Eight az = load(a + z) - oz, bz = load(b + z) - oz, cz = load(c + z) - oz;
        const Eight ax = sheared(load(a + x) - ox, sx, az), ay = sheared(load(a + y) - oy, sy, az);
        const Eight bx = sheared(load(b + x) - ox, sx, bz), by = sheared(load(b + y) - oy, sy, bz);
        const Eight cx = sheared(load(c + x) - ox, sx, cz), cy = sheared(load(c + y) - oy, sy, cz);
        const Eight u = difference_of_products(cx, by, cy, bx);
        const Eight v = difference_of_products(ax, cy, ay, cx);
        const Eight w = difference_of_products(bx, ay, by, ax);
        const Eight none = eight(0.0f);
        const EightFlags inside = (lesser(lesser(u, v), w) >= none) | (greater(greater(u, v), w) <= none);
        ++rays.steps[ray];
        if (!bits(inside)) return false;
        // The hit lies between the first and the last corner along the ray.
        const Eight scale = eight(rays.shear[2][ray]), slack = eight(DEPTH_SLACK);
        const Eight a_t = az * scale, b_t = bz * scale, c_t = cz * scale;
        const Eight first = lesser(lesser(a_t, b_t), c_t) - slack, last = greater(greater(a_t, b_t), c_t) + slack;
        const EightFlags is_passed = inside & (u + v + w != none);
        if (any_hit && bits(is_passed & (first >= slack) & (last < eight(rays.nearest[ray]) - slack))) {
            rays.record[ray] = 0;
            return true;
        }
        bool is_met = false;
        int lanes = bits(is_passed & (first <= eight(rays.nearest[ray])) & (last >= none));
        for (; lanes; lanes &= lanes - 1)
            is_met |= meet_triangle(rows, LANES * row + lowest_bit(lanes), rays, ray);
        return is_met;
    }

    SHARED Eight sheared(Eight across, Eight shear, Eight along) {
        FUSED
        return across - shear * along;
    }

    SHARED float dot(const float* a, const float* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
    SHARED double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
    SHARED void cross(const double* a, const double* b, double* product) {
        for (int k = 0; k < 3; ++k) {
            const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
            product[k] = a[i] * b[j] - a[j] * b[i];
        }
    }
    SHARED double clamped(double x, double upper) { return x > 0.0 ? (x < upper ? x : upper) : 0.0; }

    // Where a ray meets a triangle that it is known to pass through, by the triple products of Moeller and Trumbore 1997.
    // In float64: of a slim triangle float32 leaves that to chance.
    SHARED bool meet_triangle(const float* rows, int record, Rays& rays, int ray) {
        const float* corners = rows + record;
        const Query& query = rays.queries[ray];
        double origin[3], direction[3], edge_u[3], edge_v[3], across[3], normal[3];  // the origin from the first corner
        for (int k = 0; k < 3; ++k) {
            const double corner = corners[k * LANES];
            edge_u[k] = corners[(3 + k) * LANES] - corner;
            edge_v[k] = corners[(6 + k) * LANES] - corner;
            origin[k] = query.origin[k] - corner;
            direction[k] = query.direction[k];
        }
        cross(edge_u, edge_v, normal);
        cross(origin, direction, across);
        const double inverse = -1.0 / dot(normal, direction);
        double t = dot(normal, origin) * inverse, u = dot(across, edge_v) * inverse, v = -dot(across, edge_u) * inverse;
        if (!(u >= 0.0 && v >= 0.0 && u + v <= 1.0)) {
            if (u >= -BESIDE && v >= -BESIDE && u + v <= 1.0 + BESIDE) put_inside(u, v);
            else t = put_on_edge(origin, direction, edge_u, edge_v, u, v);
        }
        const float t_from_origin = greater((float)(t - rays.t_of_origin[ray]), 0.0f);
        if (!(t >= 0.0 && is_nearer(rays, ray, t_from_origin, record))) return false;
        set_nearest(rays, ray, t_from_origin, record, false);
        rays.u[ray] = (float)u;
        rays.v[ray] = (float)v;
        return true;
    }

    // The barycentrics of a place beside a triangle, by less than rounding. The ray crosses the plane there, and that of a
    // neighbour in the same plane.
    SHARED void put_inside(double& u, double& v) {
        u = clamped(u, 1.0);
        v = clamped(v, 1.0 - u);
    }

    // A ray that passes a triangle by less than rounding, and crosses its plane far away, for it grazes that, meets it
    // where it comes nearest to the edge that it passes. Sets the barycentrics; returns t.
    OUT_OF_LINE double put_on_edge(
        const double* origin, const double* direction, const double* edge_u, const double* edge_v, double& u, double& v
    ) {
        double begin[3], edge[3];  // of the edge; the beginning from the origin
        const double w = 1.0 - u - v;
        const bool is_along_v = u <= v && u <= w, is_along_u = !is_along_v && v <= w;
        for (int k = 0; k < 3; ++k) {
            begin[k] = (is_along_u || is_along_v ? 0.0 : edge_u[k]) - origin[k];
            edge[k] = is_along_v ? edge_v[k] : is_along_u ? edge_u[k] : edge_v[k] - edge_u[k];
        }
        const double direction2 = dot(direction, direction), direction_edge = dot(direction, edge);
        const double square = dot(edge, edge) * direction2 - direction_edge * direction_edge;
        double s = 0.0;  // part of the edge
        if (square > 0.0)
            s = clamped((dot(begin, direction) * direction_edge - dot(begin, edge) * direction2) / square, 1.0);
        u = is_along_v ? 0.0 : is_along_u ? s : 1.0 - s;
        v = is_along_u ? 0.0 : s;
        return (dot(begin, direction) + s * direction_edge) / direction2;
    }
};
