// What a ray's record says of its hit, and second thoughts about patches (tree_walk.py).

struct TreeAnswer : TreeWalk {
    struct Answer {
        float t;
        int triangle;
        float u, v;  // -1, or LARGE_PATCH, of a patch
        float normal[3];  // unit
    };

    // Have memory bring the record that a ray has met, all its rows.
    SHARED void fetch_record(const Tree& tree, const Rays& rays, int lane) {
#if !defined(PLAIN_VECTORS)
        if (rays.met[lane] < 0) return;
        const float* r = tree.rows + rays.met[lane] / LANES * LANES;
        for (int line = 0; line < 5; ++line) __builtin_prefetch(r + 16 * line);
#endif
    }

    // What ray ``lane`` of eight has met.
    SHARED Answer to(const Tree& tree, const Rays& rays, int lane) {
        const float* r = tree.rows + rays.met[lane];
        Answer answer;
        answer.t = (float)(rays.skipped[lane] + rays.nearest[lane]);
        if (rays.met_patch[lane]) {
            answer.triangle = as_int(r[PATCH_NUMBER * LANES]);
            const float axis = r[PATCH_KIND * LANES];
            answer.u = answer.v = axis > (float)(int)axis ? LARGE_PATCH : -1.0f;
            for (int k = 0; k < 3; ++k) answer.normal[k] = r[k * LANES];
        } else {
            answer.triangle = as_int(r[TRIANGLE_NUMBER * LANES]);
            answer.u = rays.u[lane];
            answer.v = rays.v[lane];
            find_normal(r, answer.normal);
        }
        return answer;
    }

    // In float64: of a slim triangle's cross product float32 leaves little.
    SHARED void find_normal(const float* r, float* unit) {
        double edge_u[3], edge_v[3], normal[3];
        for (int k = 0; k < 3; ++k) {
            edge_u[k] = (double)r[(3 + k) * LANES] - r[k * LANES];
            edge_v[k] = (double)r[(6 + k) * LANES] - r[k * LANES];
        }
        cross(edge_u, edge_v, normal);
        const double square = dot(normal, normal), per_length = square > 0.0 ? 1.0 / sqrt(square) : 0.0;
        for (int k = 0; k < 3; ++k) unit[k] = (float)(normal[k] * per_length);
    }

    // How far along the back of a surface a ray goes: above 0 it comes from within. ``front`` is the side of the
    // normals that can be seen from outside, 1 or -1.
    SHARED float facing(const Answer& answer, const float* direction, float front) {
        return front * dot(answer.normal, direction) / sqrtf(dot(direction, direction));
    }
    SHARED bool is_doubted(const Tree& tree, const Answer& answer, const float* direction, float front) {
        const float back = facing(answer, direction, front);
        return back > 0.0f && (back < GRAZING || is_own(tree, answer, direction, back));
    }

    // Whether a ray that meets a patch's back has only left the surface that the patch stands for: it starts beneath it
    // by less than a patch may rise over its surface.
    SHARED bool is_own(const Tree& tree, const Answer& answer, const float* direction, float back) {
        const float rise = answer.t * back * sqrtf(dot(direction, direction));
        return answer.u < 0.0f && rise < OWN_RISE * tree.half_patch;
    }

    // A ray that is in doubt. If it started inside, any other ray from there meets a back too: one is sent to see. If
    // not, it goes on, past the horizon. The answer's triangle is -1 if nothing is met there.
    OUT_OF_LINE int go_beyond(const Tree& tree, const Query& query, float front, float horizon, Answer& answer) {
        Query onwards = query, probe = query;
        double behind = 0.0;  // t of where ``onwards`` begins
        Rays rays;
        int steps = 0;
        for (int doubts = 0; doubts < MOST_DOUBTS && is_doubted(tree, answer, query.direction, front); ++doubts) {
            for (int k = 0; k < 3; ++k) {
                const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
                probe.origin[k] = onwards.origin[k];
                probe.direction[k] = query.direction[i] * answer.normal[j] - query.direction[j] * answer.normal[i];
            }
            probe.t_max = FAR;
            const bool is_leaving = is_own(tree, answer, query.direction, facing(answer, query.direction, front));
            if (!is_leaving && finds(rays, tree, probe, steps)
                && facing(to(tree, rays, 0), probe.direction, front) > 0.0f)
                break;
            // By more than t's rounding, so that it does go on.
            const float past = (float)(answer.t - behind);
            const double passed = past + greater(is_leaving ? OWN_STEP * tree.half_patch : horizon, T_ROUNDING * past);
            behind += passed;
            for (int k = 0; k < 3; ++k) onwards.origin[k] += passed * (double)query.direction[k];
            onwards.t_max = (float)(query.t_max - behind);
            answer.triangle = -1;
            if (!finds(rays, tree, onwards, steps)) break;
            answer = to(tree, rays, 0);
            answer.t = (float)(behind + answer.t);
        }
        return steps;
    }
    SHARED bool finds(Rays& rays, const Tree& tree, const Query& query, int& steps) {
        if (!start(rays, tree, &query, 1)) return false;
        find_nearest(tree, rays, 0, 0);
        steps += rays.steps[0];
        return rays.met[0] >= 0;
    }
};
