// The body of ``search_cells`` (march_exact.py): C++ so that eight lanes become one vector, which a Warp loop does not.
//
// views, index, origin, direction and t_max are its parameters, and the names in capitals are constants of the Python
// modules. Eight records, or eight boxes, are the lanes of a loop over i: clang makes vector code of it, CUDA runs it.

#if defined(__CUDA_ARCH__)
#define FUSED  // as it is by default
#define IN_LINE
#define OUT_OF_LINE
#define AT_ONCE
#else
#define FUSED _Pragma("clang fp contract(fast)")
#define IN_LINE __attribute__((always_inline))
#define OUT_OF_LINE __attribute__((noinline))
#define AT_ONCE _Pragma("clang loop vectorize(enable) unroll(disable)")
#endif

using vec3 = wp::vec_t<3, float>;
struct Met { float t; int triangle, steps, kind; float u, v; vec3 normal; };
const int lanes = LANES;
const auto* view = views.data + index;
auto lesser = [](float a, float b) { return a < b ? a : b; };
auto greater = [](float a, float b) { return a > b ? a : b; };
auto floored = [=](float x, float first, float last) { return greater(lesser((float)(int)x, last), first); };

auto as_int = [](float x) { union { float x; int i; } bits = {x}; return bits.i; };
auto as_float = [](int i) { union { int i; float x; } bits = {i}; return bits.x; };

// Eight flags, 0 or 1, as a word, and the number of the first that is set.
auto packed = [](const unsigned char* flags) {
    unsigned long long word;
    memcpy(&word, flags, 8);
    return word;
};
auto lowest_byte = [](unsigned long long word) {
#if defined(__CUDA_ARCH__)
    return (__ffsll((long long)word) - 1) / 8;
#else
    return __builtin_ctzll(word) / 8;
#endif
};

// Walk the occupied cells along a ray, nearest first; the nearest record of the first in which one is met is met.
auto march = [=](vec3 origin, vec3 direction, float t_max) IN_LINE -> Met {
    FUSED
    const auto& grid = *view;

    // Slab test against the object's box. Along planes that the ray never crosses inverse is 0, and never is far.
    float inverse[3], never[3];
    float t_enter = 0.0f, t_exit = t_max;
    #pragma unroll
    for (int k = 0; k < 3; ++k) {
        const float low = grid.low[k] - CELL_SLACK, high = grid.high[k] + CELL_SLACK;
        if (direction[k] < NEGLIGIBLE && direction[k] > -NEGLIGIBLE) {
            inverse[k] = 0.0f;
            never[k] = FAR;
            if (origin[k] < low || origin[k] > high) t_exit = -1.0f;
        } else {
            inverse[k] = 1.0f / direction[k];
            never[k] = 0.0f;
            const float t_low = (low - origin[k]) * inverse[k], t_high = (high - origin[k]) * inverse[k];
            t_enter = greater(lesser(t_low, t_high), t_enter);
            t_exit = lesser(greater(t_low, t_high), t_exit);
        }
    }
    if (!(t_enter <= t_exit)) return {INFINITY, -1, 0, TRIANGLE, 0.0f, 0.0f, vec3(0.0f)};

    // From here on t counts from the entry, which keeps far rays precise. Places of cells are counted along the turned
    // ray, every axis reversed that the ray goes down: the cell's number is ``first`` plus ``step`` times its place.
    const float t_end = t_exit - t_enter;
    float entry[3], turned_entry[3], turned_direction[3], turned_inverse[3], offset[3], side[3], place[3];
    int step[3], near_side[3], far_side[3];
    int first = 0, octant = 0, stride = 1;
    #pragma unroll
    for (int k = 0; k < 3; ++k) {
        const bool up = direction[k] > 0.0f;
        side[k] = (float)grid.cells[k];
        entry[k] = origin[k] + t_enter * direction[k];
        turned_entry[k] = up ? entry[k] : side[k] - entry[k];
        turned_direction[k] = up ? direction[k] : -direction[k];
        turned_inverse[k] = up ? inverse[k] : -inverse[k];
        offset[k] = never[k] - turned_entry[k] * turned_inverse[k];
        place[k] = floored(turned_entry[k], 0.0f, side[k] - 1.0f);
        step[k] = up ? stride : -stride;
        first += up ? 0 : (grid.cells[k] - 1) * stride;
        octant += up ? 1 << k : 0;
        stride *= grid.cells[k];
        near_side[k] = lanes * (2 * k + (up ? 0 : 1));
        far_side[k] = lanes * (2 * k + (up ? 1 : 0));
    }
    const unsigned char* leaps = grid.leaps.data + (size_t)octant * stride;
    const float dx = direction[0], dy = direction[1], dz = direction[2];
    int cell = first + (int)place[0] * step[0] + (int)place[1] * step[1] + (int)place[2] * step[2];
    float t = 0.0f;
    int steps = 0;
    while (t <= t_end) {
        const int empty = leaps[cell];
        const int cells = empty > 0 ? empty : 1;
        const float leap = (float)cells;
        ++steps;

        // The cube of ``leap`` cells ahead is left through the nearest of its far sides.
        const float tx = (place[0] + leap) * turned_inverse[0] + offset[0];
        const float ty = (place[1] + leap) * turned_inverse[1] + offset[1];
        const float tz = (place[2] + leap) * turned_inverse[2] + offset[2];
        const float t_out = greater(lesser(lesser(tx, ty), tz), t);

        if (empty == 0) {
            // In coordinates from the cell's corner, t from where the ray enters it.
            float local[3];
            #pragma unroll
            for (int k = 0; k < 3; ++k) {
                const float corner = direction[k] > 0.0f ? place[k] : side[k] - 1.0f - place[k];
                local[k] = entry[k] + t * direction[k] - corner;
            }
            const float ox = local[0], oy = local[1], oz = local[2];
            const float from = greater(-CELL_SLACK, -t), to = lesser(t_out - t + CELL_SLACK, t_end - t);

            // Slab test against the boxes of a node's eight blocks: a flag for each.
            auto entered = [=](int node) {
                const float* box = grid.boxes.data + (size_t)node * (SIDES * lanes);
                unsigned char flags[lanes];
                for (int i = 0; i < lanes; ++i) {
                    const float in_x = (box[near_side[0] + i] - ox) * inverse[0] - never[0];
                    const float in_y = (box[near_side[1] + i] - oy) * inverse[1] - never[1];
                    const float in_z = (box[near_side[2] + i] - oz) * inverse[2] - never[2];
                    const float out_x = (box[far_side[0] + i] - ox) * inverse[0] + never[0];
                    const float out_y = (box[far_side[1] + i] - oy) * inverse[1] + never[1];
                    const float out_z = (box[far_side[2] + i] - oz) * inverse[2] + never[2];
                    const float in = greater(greater(in_x, in_y), greater(in_z, from));
                    const float out = lesser(lesser(out_x, out_y), lesser(out_z, to));
                    flags[i] = in <= out ? 1 : 0;
                }
                return packed(flags);
            };

            // The t of the eight planes of a block; none is that of one seen edge on.
            auto plane = [=](const float* r, int i) {
                const float slope = r[i] * dx + r[lanes + i] * dy + r[2 * lanes + i] * dz;
                const float height = r[3 * lanes + i] - (r[i] * ox + r[lanes + i] * oy + r[2 * lanes + i] * oz);
                return height / (slope * slope > EDGE_ON * EDGE_ON ? slope : 0.0f);
            };

            // Of each lane what is nearest: its t, and the row of its block. First the patches, then the triangles.
            const float* rows = grid.rows.data;
            float nearest[lanes];
            int where[lanes];
            for (int i = 0; i < lanes; ++i) nearest[i] = to;
            const int* node = grid.node.data + 2 * cell;
            const int* row = grid.row.data + 2 * cell;
            for (int n = node[0]; n < node[1]; ++n) {
                for (unsigned long long left = entered(n); left; left &= left - 1) {
                    const int at = row[0] + PATCH_ROWS * (lanes * (n - node[0]) + lowest_byte(left));
                    const float* r = rows + (size_t)at * lanes;
                    ++steps;
                    for (int i = 0; i < lanes; ++i) {
                        const float s = plane(r, i);
                        const float x = ox + s * dx, y = oy + s * dy, z = oz + s * dz;
                        const int axis = as_int(r[7 * lanes + i]) & 3;
                        const float u = (axis == 0 ? y : axis == 1 ? z : x) - r[4 * lanes + i];
                        const float v = (axis == 0 ? z : axis == 1 ? x : y) - r[5 * lanes + i];
                        const bool is_met = (greater(wp::abs(u), wp::abs(v)) <= grid.half_patch) & (s >= from)
                            & (s < nearest[i]);
                        nearest[i] = is_met ? s : nearest[i];
                        where[i] = is_met ? at : where[i];
                    }
                }
            }
            for (int n = node[1]; n < node[2]; ++n) {
                for (unsigned long long left = entered(n); left; left &= left - 1) {
                    const int at = row[1] + TRIANGLE_ROWS * (lanes * (n - node[1]) + lowest_byte(left));
                    const float* r = rows + (size_t)at * lanes;
                    ++steps;
                    for (int i = 0; i < lanes; ++i) {
                        const float s = plane(r, i);
                        const float x = ox + s * dx, y = oy + s * dy, z = oz + s * dz;
                        const float u = r[4 * lanes + i] * x + r[5 * lanes + i] * y + r[6 * lanes + i] * z
                            + r[7 * lanes + i];
                        const float v = r[8 * lanes + i] * x + r[9 * lanes + i] * y + r[10 * lanes + i] * z
                            + r[11 * lanes + i];
                        const float within = lesser(lesser(u, v), 1.0f - (u + v));
                        const bool is_met = (within >= -EDGE_SLACK) & (s >= from) & (s < nearest[i]);
                        nearest[i] = is_met ? s : nearest[i];
                        where[i] = is_met ? at : where[i];
                    }
                }
            }

            // The nearest of the lanes is the answer.
            unsigned char is_met[lanes];
            AT_ONCE for (int i = 0; i < lanes; ++i) is_met[i] = nearest[i] < to ? 1 : 0;
            unsigned long long left = packed(is_met);
            if (left) {
                int lane = lowest_byte(left);
                for (left &= left - 1; left; left &= left - 1) {
                    const int other = lowest_byte(left);
                    lane = nearest[other] < nearest[lane] ? other : lane;
                }
                const float s = nearest[lane];
                const float* r = rows + (size_t)where[lane] * lanes + lane;
                const vec3 normal(r[0], r[lanes], r[2 * lanes]);
                const float t_met = greater(t_enter + (t + s), 0.0f);
                if (where[lane] < row[1]) {
                    const int triangle = as_int(r[6 * lanes]), kind = as_int(r[7 * lanes]);
                    return {t_met, triangle, steps, kind, 0.0f, 0.0f, normal};
                }
                const float x = ox + s * dx, y = oy + s * dy, z = oz + s * dz;
                const float u = r[4 * lanes] * x + r[5 * lanes] * y + r[6 * lanes] * z + r[7 * lanes];
                const float v = r[8 * lanes] * x + r[9 * lanes] * y + r[10 * lanes] * z + r[11 * lanes];
                return {t_met, as_int(r[12 * lanes]), steps, TRIANGLE, u, v, normal};
            }
        }

        // Go on where the ray leaves the cube.
        t = t_out;
        if (cells == 1) {
            if (tx <= ty && tx <= tz) {
                place[0] += 1.0f;
                cell += step[0];
                if (place[0] >= side[0]) break;
            } else if (ty <= tz) {
                place[1] += 1.0f;
                cell += step[1];
                if (place[1] >= side[1]) break;
            } else {
                place[2] += 1.0f;
                cell += step[2];
                if (place[2] >= side[2]) break;
            }
        } else {
            // Beside the axis of that side, in the cell that the ray is in then.
            const int axis = tx <= ty && tx <= tz ? 0 : ty <= tz ? 1 : 2;
            cell = first;
            #pragma unroll
            for (int k = 0; k < 3; ++k) {
                const float last = lesser(place[k] + leap, side[k]) - 1.0f;
                const float beside = floored(turned_entry[k] + t * turned_direction[k], place[k], last);
                place[k] = k == axis ? place[k] + leap : beside;
                cell += (int)place[k] * step[k];
            }
            if (place[0] >= side[0] || place[1] >= side[1] || place[2] >= side[2]) break;
        }
    }
    return {INFINITY, -1, steps, TRIANGLE, 0.0f, 0.0f, vec3(0.0f)};
};

// From outside a closed object only the front of its surface is seen. A ray that grazes a back is in doubt: it has
// either passed just over the horizon, where the next patch sticks out by its margin, or it started inside.
auto facing = [=](const Met& met, const vec3& way) {
    return view->front * (met.normal[0] * way[0] + met.normal[1] * way[1] + met.normal[2] * way[2]);
};
auto is_doubted = [=](const Met& met) {
    const float back = facing(met, direction);
    return back > 0.0f && back < GRAZING;
};

Met met = march(origin, direction, t_max);
if (is_doubted(met)) {
    // If it started inside, any other ray from there meets a back too: one is sent to see. If not, it goes on. That
    // is rare, and stays out of the way of what is not.
    auto beyond = [=](Met met) OUT_OF_LINE -> Met {
        vec3 start = origin;
        int steps = met.steps;
        for (int doubts = 0; doubts < MOST_DOUBTS && is_doubted(met); ++doubts) {
            const vec3 aside = wp::normalize(wp::cross(direction, met.normal));
            const Met probe = march(start, aside, FAR);
            steps += probe.steps;
            if (facing(probe, aside) > 0.0f) break;
            // By more than t's rounding, so that it does go on.
            const float passed = met.t + greater(view->horizon, T_ROUNDING * met.t);
            start = origin + passed * direction;
            met = march(start, direction, t_max - passed);
            met.t += passed;
            steps += met.steps;
        }
        met.steps = steps;
        return met;
    };
    met = beyond(met);
}
return {met.t, as_float(met.triangle), as_float(met.steps), as_float(met.kind), met.u, met.v,
    met.normal[0], met.normal[1], met.normal[2]};
