// Rays against an eight-wide tree (tree.py): eight boxes of a node, or eight records of a block, at once.
//
// One ray goes down the tree nearest child first. Rays that stay together, such as reflections of neighbouring pixels,
// go as a *packet*: a node's boxes are tested against all eight of them at once. Rays that do not, in a tree that the
// cache does not hold, go *in turn*, a step each, so that memory works for the others while one waits. Which way a ray
// goes changes no bit of its answer: what it meets is decided by the record alone, and of two records at one t by their
// places.

struct TreeWalk : Vectors {
    enum {
        LANES = 8,
        NODE = TREE_NODE,          // floats of a node: per axis eight lows, then eight highs; then eight children
        CHILDREN = 6 * LANES,
        TRIANGLE_NUMBER = 9,       // row of a triangle's number, after its three corners
        PATCH_NUMBER = 6,          // and of a patch's, after its plane and the middle of its texel
        PATCH_KIND = 7,
#if defined(__CUDA_ARCH__)
        BLOCK = 1,
#else
        BLOCK = RAY_BLOCK,         // rays searched for together
#endif
        EIGHTS = (BLOCK + LANES - 1) / LANES,
        TURN = BLOCK < 8 ? BLOCK : 8,  // of them in turn
        STACK = TREE_STACK,        // entries; no tree needs more (tree_build.py)
        FEW = 2,                   // rays up to which a packet's go alone
    };

    // Where to look. A child is a node's number, or ~(2 * row + 1) of a block of patches, or ~(2 * row) of triangles.
    struct Tree {
        const float *nodes, *rows;
        const float *low, *high;  // the box about all
        float half_patch;
    };

    // A ray as it is asked for (trace.py): hits at 0 <= t < t_max count.
    struct Query {
        double origin[3];
        float direction[3], t_max;
    };

    // Eight rays, a lane each.
    struct Rays {
        float origin[3][LANES], direction[3][LANES];
        float inverse[3][LANES], scaled[3][LANES];  // 1 / direction, and origin / direction
        float turned[3][LANES], shear[3][LANES];  // the origin along the axes of ``along``, and Woop's shear
        float nearest[LANES];  // t of what was met, or up to where something is looked for
        const Query* asked;  // of each lane
        double skipped[LANES];  // t from where it was asked for to ``origin``
        float u[LANES], v[LANES];  // barycentrics in the triangle that was met
        int near_side[3][LANES];  // in a node; the far side is the other of a pair
        int along[3][LANES];  // rows of a corner's coordinates: across, across, and where the direction is longest
        int met[LANES];  // LANES * row + lane of a record, -1 for nothing
        int steps[LANES];
        bool met_patch[LANES];
    };

    // Make rays ready: a bit for each that enters the box about all. They may begin anywhere.
    SHARED int start(Rays& rays, const Tree& tree, const Query* queries, int count) {
        double from[LANES][3];
        float t_max[LANES];
        for (int lane = 0; lane < LANES; ++lane) {
            const Query& query = queries[lane < count ? lane : 0];
            for (int k = 0; k < 3; ++k) {
                from[lane][k] = query.origin[k];
                rays.direction[k][lane] = query.direction[k];
            }
            rays.skipped[lane] = is_near(from[lane]) ? 0.0 : come_near(from[lane], query.direction);
            t_max[lane] = lane < count ? (float)(query.t_max - rays.skipped[lane]) : -1.0f;
            for (int k = 0; k < 3; ++k) rays.origin[k][lane] = (float)from[lane][k];
            rays.met[lane] = -1;
            rays.steps[lane] = 0;
        }
        rays.asked = queries;

        // Slab tests. A ray along planes would reach them in 1e18 boxes.
        const Eight none = eight(0.0f);
        Eight in = none, out = load(t_max), way[3], inverse[3];
        for (int k = 0; k < 3; ++k) {
            way[k] = load(rays.direction[k]);
            const Eight least = chosen(way[k] < none, eight(-NEGLIGIBLE), eight(NEGLIGIBLE));
            inverse[k] = eight(1.0f) / chosen(greater(way[k], -way[k]) < eight(NEGLIGIBLE), least, way[k]);
            const Eight origin = load(rays.origin[k]);
            const Eight a = (eight(tree.low[k]) - origin) * inverse[k], b = (eight(tree.high[k]) - origin) * inverse[k];
            in = greater(lesser(a, b), in);
            out = lesser(greater(a, b), out);
        }
        const int live = bits(in <= out + eight(BOX_SLACK) * in);
        if (!live) return 0;

        // They are moved to the box in float64, and stop before it by the rounding of ``in``.
        float skipped[LANES];
        store(skipped, in - eight(BOX_SLACK) * in);
        store(rays.nearest, load(t_max) - load(skipped));
        for (int rest = live & bits(in > none); rest; rest &= rest - 1) {
            const int lane = lowest_bit(rest);
            const double passed = skipped[lane];
            rays.skipped[lane] += passed;
            for (int k = 0; k < 3; ++k)
                rays.origin[k][lane] = (float)(from[lane][k] + passed * (double)rays.direction[k][lane]);
        }

        // The axis along which each goes farthest is the last of three.
        const Eight x = greater(way[0], -way[0]), y = greater(way[1], -way[1]), z = greater(way[2], -way[2]);
        const EightFlags is_x = (x >= y) & (x >= z), is_y = y >= z;
        const Eight along = chosen(is_x, way[0], chosen(is_y, way[1], way[2]));
        const int longest_x = bits(is_x), longest_y = bits(is_y);
        for (int k = 0; k < 3; ++k) {
            const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;  // the axes after it
            const Eight across = chosen(is_x, way[i], chosen(is_y, way[j], way[k]));
            store(rays.shear[k], (k == 2 ? eight(1.0f) : across) / along);
            const Eight origin = load(rays.origin[k]);
            store(rays.turned[k], chosen(is_x, load(rays.origin[i]), chosen(is_y, load(rays.origin[j]), origin)));
            store(rays.inverse[k], inverse[k]);
            store(rays.scaled[k], origin * inverse[k]);
            const int up = bits(inverse[k] > none);
            for (int lane = 0; lane < LANES; ++lane) {
                rays.near_side[k][lane] = LANES * (2 * k + 1 - (up >> lane & 1));
                rays.along[k][lane] = LANES * (longest_x >> lane & 1 ? i : longest_y >> lane & 1 ? j : k);
            }
        }
        return live;
    }

    // Whether float32 does for where a ray begins.
    SHARED bool is_near(const double* from) {
        bool is = true;
        for (int k = 0; k < 3; ++k) is &= from[k] <= NEAR && from[k] >= -NEAR;
        return is;
    }

    // Move the beginning of a ray to where it may come near; t of that.
    OUT_OF_LINE double come_near(double* from, const float* direction) {
        double along = 0.0, square = 0.0;
        for (int k = 0; k < 3; ++k) {
            along -= from[k] * direction[k];
            square += (double)direction[k] * direction[k];
        }
        const double passed = (along - NEAR * sqrt(square)) / square;
        if (!(passed > 0.0)) return 0.0;
        for (int k = 0; k < 3; ++k) from[k] += passed * direction[k];
        return passed;
    }

    // Slab tests: a bit for each of a node's boxes that a ray enters before what it has met; where, in ``entry``.
    SHARED int boxes_entered(const float* node, const Rays& rays, int ray, Eight& entry) {
        FUSED
        Eight in[3], out[3];
        for (int k = 0; k < 3; ++k) {
            const Eight inverse = eight(rays.inverse[k][ray]), scaled = eight(rays.scaled[k][ray]);
            in[k] = load(node + rays.near_side[k][ray]) * inverse - scaled;
            out[k] = load(node + far_side(rays.near_side[k][ray])) * inverse - scaled;
        }
        entry = greater(greater(in[0], in[1]), greater(in[2], eight(0.0f)));
        const Eight exit = lesser(lesser(out[0], out[1]), lesser(out[2], eight(rays.nearest[ray])));
        return bits(entry <= exit);
    }

    SHARED int far_side(int near_side) { return near_side ^ LANES; }

    // Keep a record at t, if it is nearer than what was met; of two at one t the one that stands first.
    SHARED bool is_nearer(const Rays& rays, int ray, float t, int place) {
        return t < rays.nearest[ray] || (t == rays.nearest[ray] && place < rays.met[ray]);
    }
    SHARED void keep(Rays& rays, int ray, float t, int place, bool is_patch) {
        rays.nearest[ray] = t;
        rays.met[ray] = place;
        rays.met_patch[ray] = is_patch;
    }

    // Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection": in coordinates in which the ray is the third
    // axis, the signs of three areas. Two triangles compute the same for an edge that they share, but for the sign; a
    // ray through the edge, or so near that the area is 0, meets both.
    SHARED bool meet_triangles(const float* rows, int row, Rays& rays, int ray, bool any) {
        const float* a = rows + (size_t)row * LANES;
        const float* b = a + 3 * LANES;
        const float* c = b + 3 * LANES;
        const int x = rays.along[0][ray], y = rays.along[1][ray], z = rays.along[2][ray];
        const Eight ox = eight(rays.turned[0][ray]), oy = eight(rays.turned[1][ray]), oz = eight(rays.turned[2][ray]);
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
        // How far along the ray the corners lie, which t does between them.
        const Eight scale = eight(rays.shear[2][ray]), slack = eight(DEPTH_SLACK);
        const Eight a_t = az * scale, b_t = bz * scale, c_t = cz * scale;
        const Eight first = lesser(lesser(a_t, b_t), c_t) - slack, last = greater(greater(a_t, b_t), c_t) + slack;
        const EightFlags is_some = inside & (u + v + w != none);
        if (any && bits(is_some & (first >= slack) & (last < eight(rays.nearest[ray]) - slack))) {
            rays.met[ray] = 0;
            return true;
        }
        bool is_met = false;
        int lanes = bits(is_some & (first <= eight(rays.nearest[ray])) & (last >= none));
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
    SHARED void cross(const double* a, const double* b, double* made) {
        for (int k = 0; k < 3; ++k) {
            const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
            made[k] = a[i] * b[j] - a[j] * b[i];
        }
    }
    SHARED double within(double x, double most) { return x > 0.0 ? (x < most ? x : most) : 0.0; }

    // Where a triangle is met that a ray is known to pass through, in float64, by the triple products of Moeller and
    // Trumbore 1997: of a slim triangle float32 leaves that to chance.
    SHARED bool meet_triangle(const float* rows, int place, Rays& rays, int ray) {
        const float* r = rows + place;
        const Query& query = rays.asked[ray];
        double from[3], way[3], edge_u[3], edge_v[3], across[3], normal[3];
        for (int k = 0; k < 3; ++k) {
            const double corner = r[k * LANES];
            edge_u[k] = r[(3 + k) * LANES] - corner;
            edge_v[k] = r[(6 + k) * LANES] - corner;
            from[k] = query.origin[k] - corner;
            way[k] = query.direction[k];
        }
        cross(edge_u, edge_v, normal);
        cross(from, way, across);
        const double inverse = -1.0 / dot(normal, way);
        double t = dot(normal, from) * inverse, u = dot(across, edge_v) * inverse, v = -dot(across, edge_u) * inverse;
        if (!(u >= 0.0 && v >= 0.0 && u + v <= 1.0)) t = put_on_edge(from, way, edge_u, edge_v, u, v);
        const float moved = greater((float)(t - rays.skipped[ray]), 0.0f);
        if (!(t >= -START_ROUNDING && is_nearer(rays, ray, moved, place))) return false;
        keep(rays, ray, moved, place, false);
        rays.u[ray] = (float)u;
        rays.v[ray] = (float)v;
        return true;
    }

    // A ray that passes a triangle by less than rounding meets it where it comes nearest to the edge that it passes:
    // where it crosses the plane may be far away if it grazes that. The new t.
    OUT_OF_LINE double put_on_edge(
        const double* from, const double* way, const double* edge_u, const double* edge_v, double& u, double& v
    ) {
        double begin[3], edge[3];  // from the first corner
        const double w = 1.0 - u - v;
        const bool is_along_v = u <= v && u <= w, is_along_u = !is_along_v && v <= w;
        for (int k = 0; k < 3; ++k) {
            begin[k] = (is_along_u || is_along_v ? 0.0 : edge_u[k]) - from[k];
            edge[k] = is_along_v ? edge_v[k] : is_along_u ? edge_u[k] : edge_v[k] - edge_u[k];
        }
        const double way_way = dot(way, way), way_edge = dot(way, edge);
        const double square = dot(edge, edge) * way_way - way_edge * way_edge;
        double s = 0.0;
        if (square > 0.0) s = within((dot(begin, way) * way_edge - dot(begin, edge) * way_way) / square, 1.0);
        u = is_along_v ? 0.0 : is_along_u ? s : 1.0 - s;
        v = is_along_u ? 0.0 : s;
        return (dot(begin, way) + s * way_edge) / way_way;
    }

    // A patch is met where the ray crosses its plane over its texel.
    SHARED bool meet_patches(const float* rows, int row, Rays& rays, int ray, float half_patch) {
        FUSED
        const float* r = rows + (size_t)row * LANES;
        const Eight ox = eight(rays.origin[0][ray]), oy = eight(rays.origin[1][ray]), oz = eight(rays.origin[2][ray]);
        const float* way[3] = {rays.direction[0] + ray, rays.direction[1] + ray, rays.direction[2] + ray};
        const Eight dx = eight(*way[0]), dy = eight(*way[1]), dz = eight(*way[2]);
        const Eight nx = load(r), ny = load(r + LANES), nz = load(r + 2 * LANES);
        const Eight slope = nx * dx + ny * dy + nz * dz;
        const Eight height = load(r + 3 * LANES) - (nx * ox + ny * oy + nz * oz);
        const Eight t = height / slope;
        const Eight x = ox + t * dx, y = oy + t * dy, z = oz + t * dz;
        // Of an axis' map u is the next coordinate and v the one after.
        const Eight axis = load(r + PATCH_KIND * LANES);
        const EightFlags is_x = axis < eight(1.0f), is_y = axis < eight(2.0f);
        const Eight u = chosen(is_x, y, chosen(is_y, z, x)) - load(r + 4 * LANES);
        const Eight v = chosen(is_x, z, chosen(is_y, x, y)) - load(r + 5 * LANES);
        const Eight beside = greater(greater(u, -u), greater(v, -v));
        // Edge on, to float32's rounding, nothing is known of where it is met.
        const EightFlags is_met = (beside <= eight(half_patch)) & (t >= eight(0.0f)) & (t <= eight(rays.nearest[ray]))
            & (slope * slope > eight(EDGE_ON * EDGE_ON));
        ++rays.steps[ray];
        int lanes = bits(is_met);
        if (!lanes) return false;
        float of_lane[LANES];
        store(of_lane, t);
        for (; lanes; lanes &= lanes - 1) {
            const int lane = lowest_bit(lanes), place = LANES * row + lane;
            if (is_nearer(rays, ray, of_lane[lane], place)) keep(rays, ray, of_lane[lane], place, true);
        }
        return true;
    }

    SHARED bool meet(const Tree& tree, int child, Rays& rays, int ray, bool any) {
        const int row = ~child >> 1;
        if (~child & 1) return meet_patches(tree.rows, row, rays, ray, tree.half_patch);
        return meet_triangles(tree.rows, row, rays, ray, any);
    }

    // Have memory bring what a ray will come to.
    SHARED void fetch(const Tree& tree, int child) {
#if !defined(PLAIN_VECTORS)
        const float* p = child >= 0 ? tree.nodes + (size_t)child * NODE : tree.rows + (size_t)(~child >> 1) * LANES;
        for (int line = 0; line < 4; ++line) __builtin_prefetch(p + 16 * line);
        if (child < 0) __builtin_prefetch(p + 16 * 4);
#endif
    }

    // A child to come back to: its entry above its number. Entries are not negative: they compare as their bits do.
    typedef unsigned long long Later;
    SHARED Later later(const float* entry, const int* children, int lane) {
        return (Later)(unsigned)as_int(entry[lane]) << 32 | (unsigned)children[lane];
    }
    SHARED void put_in_order(Later& far, Later& near) {
        const Later a = far, b = near;
        far = a < b ? b : a;
        near = a < b ? a : b;
    }

    // The nearest of the children whose bits are set; the others go on the stack, the farthest first.
    SHARED int nearest_child(const Tree& tree, const float* node, const Eight& entry, int set, Later* stack, int& top) {
        const int* children = (const int*)(node + CHILDREN);
        float t[LANES];
        int lane = lowest_bit(set);
        set &= set - 1;
        if (!set) return children[lane];
        store(t, entry);
        fetch(tree, children[lane]);
        Later a = later(t, children, lane);
        lane = lowest_bit(set), set &= set - 1;
        fetch(tree, children[lane]);
        Later b = later(t, children, lane);
        put_in_order(a, b);
        stack[top++] = a;
        if (!set) return (int)b;
        lane = lowest_bit(set), set &= set - 1;
        Later c = later(t, children, lane);
        put_in_order(b, c);
        put_in_order(a, b);
        stack[top - 1] = a;
        stack[top++] = b;
        if (!set) return (int)c;
        // Four and more are rare.
        const int bottom = top - 2;
        stack[top++] = c;
        for (; set; set &= set - 1) {
            const Later one = later(t, children, lowest_bit(set));
            int at = top++;
            for (; at > bottom && stack[at - 1] < one; --at) stack[at] = stack[at - 1];
            stack[at] = one;
        }
        return (int)stack[--top];
    }

    // Whatever order suits, where any hit will do.
    SHARED int any_child(const float* node, const Eight& entry, int set, Later* stack, int& top) {
        const int* children = (const int*)(node + CHILDREN);
        int child = children[lowest_bit(set)];
        for (set &= set - 1; set; set &= set - 1) {
            stack[top++] = (unsigned)child;
            child = children[lowest_bit(set)];
        }
        return child;
    }

    SHARED int next_child(
        const Tree& tree, const float* node, const Eight& entry, int set, Later* stack, int& top, bool any
    ) {
        return any ? any_child(node, entry, set, stack, top) : nearest_child(tree, node, entry, set, stack, top);
    }

    // Back to a child that is entered before what was met; false if there is none.
    SHARED bool comes_back(float nearest, const Later* stack, int& top, int& child) {
        while (top) {
            const Later one = stack[--top];
            if ((unsigned)(one >> 32) <= (unsigned)as_int(nearest)) {
                child = (int)one;
                return true;
            }
        }
        return false;
    }

    SHARED void go_alone(const Tree& tree, Rays& rays, int ray, int child, bool any) {
        Later stack[STACK];
        int top = 0;
        do {
            while (child >= 0) {
                const float* node = tree.nodes + (size_t)child * NODE;
                Eight entry;
                const int set = boxes_entered(node, rays, ray, entry);
                ++rays.steps[ray];
                if (!set) break;
                child = next_child(tree, node, entry, set, stack, top, any);
            }
            if (child < 0 && meet(tree, child, rays, ray, any) && any) return;
        } while (comes_back(rays.nearest[ray], stack, top, child));
    }
    OUT_OF_LINE void find_nearest(const Tree& tree, Rays& rays, int ray, int child) {
        go_alone(tree, rays, ray, child, false);
    }
    OUT_OF_LINE void find_any(const Tree& tree, Rays& rays, int ray, int child) {
        go_alone(tree, rays, ray, child, true);
    }
    SHARED void find(const Tree& tree, Rays& rays, int ray, int child, bool any) {
        if (any) find_any(tree, rays, ray, child);
        else find_nearest(tree, rays, ray, child);
    }

    // Intervals of all rays of a packet, signed as their octant is: the bounds of 1 / direction, and of the products by
    // which near and far sides become t. And up to where each ray looks; -1 if it does not.
    struct Packet {
        Eight least_inverse[3], most_inverse[3], least_near[3], most_near[3], least_far[3], most_far[3];
        Eight inverse[3], scaled[3];
        int near_side[3];
        float nearest[LANES];
    };

    // Fill in a packet of those rays whose bits are set; false if they do not go into one octant, or are far apart.
    SHARED bool stay_together(Packet& packet, const Rays& rays, int live) {
        const int lead = lowest_bit(live);
        float flags[LANES];
        for (int lane = 0; lane < LANES; ++lane) flags[lane] = (float)(live >> lane & 1);
        const EightFlags takes_part = load(flags) > eight(0.0f);
        for (int k = 0; k < 3; ++k) {
            // Those that do not take part are as the first that does.
            const Eight inverse = chosen(takes_part, load(rays.inverse[k]), eight(rays.inverse[k][lead]));
            const Eight origin = chosen(takes_part, load(rays.origin[k]), eight(rays.origin[k][lead]));
            const Eight way = chosen(takes_part, load(rays.direction[k]), eight(rays.direction[k][lead]));
            const float sign = rays.inverse[k][lead] < 0.0f ? -1.0f : 1.0f;
            const Eight signed_inverse = eight(sign) * inverse, signed_origin = eight(sign) * origin;
            const float low = -most(-signed_inverse), high = most(signed_inverse);
            const float left = -most(-signed_origin), right = most(signed_origin);
            if (low < 0.0f || right - left > PACKET_SPREAD || most(way) + most(-way) > PACKET_SPREAD) return false;
            packet.least_inverse[k] = eight(sign * low), packet.most_inverse[k] = eight(sign * high);
            packet.least_near[k] = eight(right * low), packet.most_near[k] = eight(right * high);
            packet.least_far[k] = eight(left * low), packet.most_far[k] = eight(left * high);
            packet.inverse[k] = inverse;
            packet.scaled[k] = origin * inverse;
            packet.near_side[k] = rays.near_side[k][lead];
        }
        store(packet.nearest, chosen(takes_part, load(rays.nearest), eight(-1.0f)));
        return true;
    }

    // A bit for each of a node's boxes that any ray of a packet may enter.
    SHARED int boxes_entered_by_any(const float* node, const Packet& p, float farthest, Eight& entry) {
        FUSED
        Eight in = eight(0.0f), out = eight(farthest);
        for (int k = 0; k < 3; ++k) {
            const Eight near = load(node + p.near_side[k]), far = load(node + far_side(p.near_side[k]));
            const Eight least = p.least_inverse[k], most = p.most_inverse[k];
            in = greater(lesser(near * least - p.least_near[k], near * most - p.most_near[k]), in);
            out = lesser(greater(far * least - p.least_far[k], far * most - p.most_far[k]), out);
        }
        entry = in;
        return bits(in <= out);
    }

    // A bit for each ray of a packet that enters one box.
    SHARED int rays_that_enter(const float* node, int box, const Packet& p) {
        FUSED
        Eight in = eight(0.0f), out = load(p.nearest);
        for (int k = 0; k < 3; ++k) {
            in = greater(eight(node[p.near_side[k] + box]) * p.inverse[k] - p.scaled[k], in);
            out = lesser(eight(node[far_side(p.near_side[k]) + box]) * p.inverse[k] - p.scaled[k], out);
        }
        return bits(in <= out);
    }

    struct LaterTogether {
        float entry;
        int child, rays;
    };

    SHARED void go_together(const Tree& tree, Packet& packet, Rays& rays, int live, bool any) {
        LaterTogether stack[STACK];
        int top = 0, child = 0;
        float farthest = most(load(packet.nearest));
        for (;;) {
            if (child >= 0 && !has_few(live)) {
                const float* node = tree.nodes + (size_t)child * NODE;
                const int* children = (const int*)(node + CHILDREN);
                Eight entry;
                int set = boxes_entered_by_any(node, packet, farthest, entry);
                ++rays.steps[lowest_bit(live)];
                float t[LANES];
                store(t, entry);
                const int bottom = top;
                for (; set; set &= set - 1) {
                    const int box = lowest_bit(set);
                    const int entering = rays_that_enter(node, box, packet) & live;
                    if (!entering) continue;
                    fetch(tree, children[box]);
                    const LaterTogether one = {t[box], children[box], entering};
                    int at = top++;
                    for (; at > bottom && stack[at - 1].entry < one.entry; --at) stack[at] = stack[at - 1];
                    stack[at] = one;
                }
            } else {
                for (; live; live &= live - 1) {
                    const int ray = lowest_bit(live);
                    if (child < 0) meet(tree, child, rays, ray, any);
                    else find(tree, rays, ray, child, any);
                    packet.nearest[ray] = any && rays.met[ray] >= 0 ? -1.0f : rays.nearest[ray];
                }
                farthest = most(load(packet.nearest));
            }
            do {
                if (!top) return;
                const LaterTogether& one = stack[--top];
                live = one.entry > farthest ? 0 : one.rays & bits(eight(one.entry) <= load(packet.nearest));
            } while (!live);
            child = stack[top].child;
        }
    }

    struct Walker {
        Later stack[STACK];
        int top, child;
        Rays* rays;
        int ray;
    };

    // Rays in turn, one step each. They are listed by LANES * (number of their eight) + lane.
    SHARED void go_in_turn(const Tree& tree, Rays* rays, const int* listed, int count, bool any) {
        Walker walkers[TURN];
        int next = 0, going = 0;
        for (; going < TURN && next < count; ++going) set_out(walkers[going], rays, listed[next++]);
        while (going) {
            for (int k = 0; k < going; ++k) {
                Walker& walker = walkers[k];
                Rays& own = *walker.rays;
                const int ray = walker.ray;
                bool is_done = false, comes_farther = false;
                if (walker.child >= 0) {
                    const float* node = tree.nodes + (size_t)walker.child * NODE;
                    Eight entry;
                    const int set = boxes_entered(node, own, ray, entry);
                    ++own.steps[ray];
                    comes_farther = set != 0;
                    if (set) walker.child = next_child(tree, node, entry, set, walker.stack, walker.top, any);
                } else {
                    is_done = meet(tree, walker.child, own, ray, any) && any;
                }
                if (!is_done && !comes_farther)
                    is_done = !comes_back(own.nearest[ray], walker.stack, walker.top, walker.child);
                if (is_done && next < count) {
                    set_out(walker, rays, listed[next++]);
                } else if (is_done) {
                    // The last walker takes this one's place.
                    if (k < --going) walker = walkers[going];
                    --k;
                    continue;
                }
                fetch(tree, walker.child);
            }
        }
    }
    SHARED void set_out(Walker& walker, Rays* rays, int number) {
        walker.rays = rays + number / LANES;
        walker.ray = number % LANES;
        walker.top = walker.child = 0;
    }

    // Search for up to BLOCK rays.
    SHARED void search(const Tree& tree, Rays* rays, const Query* queries, int count, bool in_turn, bool any) {
        int alone[BLOCK];
        int left = 0;
        Packet packet;
        for (int first = 0; first < count; first += LANES) {
            Rays& own = rays[first / LANES];
            const int live = start(own, tree, queries + first, count - first < LANES ? count - first : LANES);
            if (!has_few(live) && stay_together(packet, own, live)) {
                go_together(tree, packet, own, live, any);
            } else {
                for (int rest = live; rest; rest &= rest - 1) alone[left++] = first + lowest_bit(rest);
            }
        }
        if (in_turn && left > 1) {
            go_in_turn(tree, rays, alone, left, any);
        } else {
            for (int k = 0; k < left; ++k) find(tree, rays[alone[k] / LANES], alone[k] % LANES, 0, any);
        }
    }
};
