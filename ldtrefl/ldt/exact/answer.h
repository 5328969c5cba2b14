// What a ray's record says of its hit, and the search past doubtful hits on patches.
//
// A ray that meets the back of a closed object's patch is in doubt: from outside only the front of a closed surface is
// seen. Either it has passed just over the horizon, where the next patch sticks out by its margin, or it has just left
// the surface that the patch stands for, or it did start inside.

struct TreeAnswer : TreeWalk {
    struct Answer {
        float t;
        int triangle;
        float u, v;       // of a patch -1, or LARGE_PATCH
        float normal[3];  // unit
    };

    // Have memory bring all rows of the record that a ray has met.
    SHARED void fetch_record(const Tree& tree, const Rays& rays, int lane) {
#if !defined(PLAIN_VECTORS)
        if (rays.record[lane] < 0) return;
        const float* r = tree.rows + rays.record[lane] / LANES * LANES;
        for (int line = 0; line < 5; ++line) __builtin_prefetch(r + 16 * line);
#endif
    }

    // The hit of one of eight rays, which has met something.
    SHARED Answer answer_of(const Tree& tree, const Rays& rays, int lane) {
        const float* r = tree.rows + rays.record[lane];
        Answer answer;
        answer.t = (float)(rays.t_of_origin[lane] + rays.nearest[lane]);
        if (rays.record_is_patch[lane]) {
            answer.triangle = as_int(r[PATCH_TRIANGLE_ROW * LANES]);
            const float axis = r[PATCH_AXIS_ROW * LANES];
            answer.u = answer.v = axis > (float)(int)axis ? LARGE_PATCH : -1.0f;
            for (int k = 0; k < 3; ++k) answer.normal[k] = r[k * LANES];
        } else {
            answer.triangle = as_int(r[TRIANGLE_NUMBER_ROW * LANES]);
            answer.u = rays.u[lane];
            answer.v = rays.v[lane];
            find_normal(r, answer.normal);
        }
        return answer;
    }

    // A triangle's unit normal, in float64: of a slim triangle's cross product float32 leaves little.
    SHARED void find_normal(const float* corners, float* unit) {
        double edge_u[3], edge_v[3], normal[3];
        for (int k = 0; k < 3; ++k) {
            edge_u[k] = (double)corners[(3 + k) * LANES] - corners[k * LANES];
            edge_v[k] = (double)corners[(6 + k) * LANES] - corners[k * LANES];
        }
        cross(edge_u, edge_v, normal);
        const double square = dot(normal, normal), per_length = square > 0.0 ? 1.0 / sqrt(square) : 0.0;
        for (int k = 0; k < 3; ++k) unit[k] = (float)(normal[k] * per_length);
    }

    // The cosine between a ray and the outward normal: above 0 it meets the back of the surface, from within. ``front``
    // is the side of the normals that can be seen from outside, 1 or -1.
    SHARED float outward_cosine(const Answer& answer, const float* direction, float front) {
        return front * dot(answer.normal, direction) / sqrtf(dot(direction, direction));
    }

    SHARED bool is_doubtful(const Tree& tree, const Answer& answer, const float* direction, float front) {
        const float cosine = outward_cosine(answer, direction, front);
        return cosine > 0.0f && (cosine < GRAZING || is_leaving(tree, answer, direction, cosine));
    }

    // Whether a ray that meets a patch's back has only left the surface that the patch stands for: it starts beneath the
    // patch by less than a patch may rise over its surface.
    SHARED bool is_leaving(const Tree& tree, const Answer& answer, const float* direction, float cosine) {
        const float depth = answer.t * cosine * sqrtf(dot(direction, direction));
        return answer.u < 0.0f && depth < OWN_RISE * tree.half_patch;
    }

    // Go on with a ray whose hit is doubtful, until a hit is not. If the ray started inside, any other ray from there
    // meets a back, too: a probe is sent across to see, and if it does the hit counts. If not, the search goes on beyond
    // the hit. The answer's triangle is -1 if nothing is met there. Returns how many nodes and blocks were looked at.
    OUT_OF_LINE int search_beyond(const Tree& tree, const Query& query, float front, float horizon, Answer& answer) {
        Query onwards = query, probe = query;
        double behind = 0.0;  // t of where ``onwards`` begins
        Rays rays;
        int steps = 0;
        for (int hits = 0; hits < MOST_DOUBTFUL && is_doubtful(tree, answer, query.direction, front); ++hits) {
            for (int k = 0; k < 3; ++k) {
                const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
                probe.origin[k] = onwards.origin[k];
                probe.direction[k] = query.direction[i] * answer.normal[j] - query.direction[j] * answer.normal[i];
            }
            probe.t_max = FAR;
            const float cosine = outward_cosine(answer, query.direction, front);
            const bool leaves_surface = is_leaving(tree, answer, query.direction, cosine);
            if (!leaves_surface && finds(rays, tree, probe, steps)
                && outward_cosine(answer_of(tree, rays, 0), probe.direction, front) > 0.0f)
                break;
            // By more than t's rounding, so that it does go on.
            const float past = (float)(answer.t - behind);
            const float step = leaves_surface ? OWN_STEP * tree.half_patch : horizon;
            const double passed = past + greater(step, T_ROUNDING * past);
            behind += passed;
            for (int k = 0; k < 3; ++k) onwards.origin[k] += passed * (double)query.direction[k];
            onwards.t_max = (float)(query.t_max - behind);
            answer.triangle = -1;
            if (!finds(rays, tree, onwards, steps)) break;
            answer = answer_of(tree, rays, 0);
            answer.t = (float)(behind + answer.t);
        }
        return steps;
    }

    // Search for one ray, the first of eight; whether it meets anything.
    SHARED bool finds(Rays& rays, const Tree& tree, const Query& query, int& steps) {
        if (!start(rays, tree, &query, 1)) return false;
        find_nearest(tree, rays, 0, 0);
        steps += rays.steps[0];
        return rays.record[0] >= 0;
    }
};
