// Which triangles of a cluster may be seen: nearly all of a dense mesh lie between pixel centres, or beside the only one in
// their box. Bounds are found in floats (instance_boxes.h).

struct ClusterTriangles : InstanceBoxes {
    enum { MOST_POINTS = 3 * CLUSTER };

    // The points of a cluster, in pixels.
    struct Points {
        float u[MOST_POINTS], v[MOST_POINTS], nearness[MOST_POINTS];
    };

    // A bit for each triangle that may cover a pixel's centre which sees nothing nearer already.
    //
    // points    the cluster's, in groups of eight: their x, their y, their z; the last group is filled up
    // corners   of CLUSTER triangles the first, the second and the third, as places among the points; filled up, too
    SHARED int triangles_seen(
        const float* points, int groups, const unsigned char* corners, const View& view, const Band& band
    ) {
        Points projected;
        if (!project(points, groups, view, projected)) return (1 << CLUSTER) - 1;
        int seen = 0;
        for (int k = 0; k < CLUSTER; k += 8) seen |= eight_seen(projected, corners + k, view, band) << k;
        return seen;
    }

    // Project the points; false if one does not lie in front of the camera.
    SHARED bool project(const float* points, int groups, const View& view, Points& projected) {
        FUSED
        for (int group = 0; group < groups; ++group, points += 24) {
            Eight u = eight(0.0f), v = eight(0.0f), depth = eight(view.depth);
            for (int k = 0; k < 3; ++k) {
                const Eight p = load(points + 8 * k);
                u = u + eight(view.x[k]) * p;
                v = v + eight(view.y[k]) * p;
                depth = depth + eight(view.z[k]) * p;
            }
            if (bits(depth <= eight(0.0f))) return false;
            const Eight nearness = eight(1.0f) / depth;
            store(projected.u + 8 * group, eight(view.across) + u * nearness);
            store(projected.v + 8 * group, eight(view.down) + v * nearness);
            store(projected.nearness + 8 * group, nearness);
        }
        return true;
    }

    // The corners of eight triangles.
    struct Corner {
        Eight u, v;
    };

    SHARED Corner corner(const Points& points, const unsigned char* at) {
        return {taken(points.u, at), taken(points.v, at)};
    }
    SHARED Eight taken(const float* from, const unsigned char* at) {
        return Eight{from[at[0]], from[at[1]], from[at[2]], from[at[3]], from[at[4]], from[at[5]], from[at[6]], from[at[7]]};
    }

    SHARED int eight_seen(const Points& points, const unsigned char* corners, const View& view, const Band& band) {
        const Corner a = corner(points, corners), b = corner(points, corners + CLUSTER);
        const Corner c = corner(points, corners + 2 * CLUSTER);
        const Eight before = eight(view.slack + 0.5f), after = eight(view.slack - 0.5f);
        const Eight first_x = -floor_of(before - lesser(lesser(a.u, b.u), c.u));
        const Eight first_y = -floor_of(before - lesser(lesser(a.v, b.v), c.v));
        const Eight last_x = floor_of(greater(greater(a.u, b.u), c.u) + after);
        const Eight last_y = floor_of(greater(greater(a.v, b.v), c.v) + after);
        int seen = bits((first_x <= last_x) & (first_y <= last_y));
        if (!seen) return 0;

        // Of those with one pixel in their box its centre is inside if it lies on one side of all edges; no edge is longer
        // than two pixels.
        const int of_one = bits((first_x >= last_x) & (first_y >= last_y));
        const Eight x = first_x + eight(0.5f), y = first_y + eight(0.5f), margin = eight(16.0f * view.error);
        const Eight ab = side(a, b, x, y), bc = side(b, c, x, y), ca = side(c, a, x, y);
        const Eight least = lesser(lesser(ab, bc), ca), most = greater(greater(ab, bc), ca);
        seen &= ~(of_one & bits((least < -margin) & (most > margin)));
        for (int rest = seen & of_one; rest; rest &= rest - 1) {
            const int k = lowest_bit(rest), column = (int)first_x[k], row = (int)first_y[k];
            const bool is_in = column >= band.first_x && column <= band.last_x && row >= band.first_y && row <= band.last_y;
            if (!is_in || nearness_at(band, column, row) > nearest_of(points, corners + k)) seen &= ~(1 << k);
        }
        return seen;
    }

    // Twice the area of the triangles of an edge and a point, positive on one side.
    SHARED Eight side(const Corner& from, const Corner& to, Eight x, Eight y) {
        return (to.u - from.u) * (y - from.v) - (to.v - from.v) * (x - from.u);
    }

    // Bits of the largest 1 / depth of a triangle, rounded up.
    SHARED int nearest_of(const Points& points, const unsigned char* corners) {
        const float a = points.nearness[corners[0]], b = points.nearness[corners[CLUSTER]];
        return as_int(ROUNDED_UP * greater(greater(a, b), points.nearness[corners[2 * CLUSTER]]));
    }
};
