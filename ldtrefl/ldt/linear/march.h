// The paper's search of a ray in sorted maps (march_linear.py), from sample to sample that can matter.
//
// A map's test at a sample depends on the texel and on which fragments lie before it. Both follow from coordinates that
// only grow, or only fall, along the ray, whatever the rounding. So between two samples of one texel with no fragment
// between them nothing changes, and in a cell that the maps agree about (occupancy.py) nothing changes either: the
// samples there need no look. How far such a stretch reaches is reckoned in numbers of samples, on the safe side by
// ``slack``; what a sample says is computed for that sample alone, by the same roundings as if none were left out.

#if defined(__CUDA_ARCH__)
#define SHARED CUDA_CALLABLE static inline
#define UNFUSED
#define FUSED
#else
#define SHARED static inline
#define UNFUSED _Pragma("clang fp contract(off)")  // a * b + c is rounded twice, as in other kernels
#define FUSED _Pragma("clang fp contract(fast)")
#endif

struct LinearSearch {
    typedef unsigned long long Word;

    // Three sorted maps (fragments.py), and the cells that they imply (occupancy.py).
    struct Maps {
        const int* start;
        const float* depth;
        const unsigned char* inside;
        int size[3], first_texel[3];
        const Word* cells;  // of the octant that the ray goes to
        int cell_shift, column_shift, levels;
        int first_column[3];  // of each level
    };

    // A ray in texel space, and where its samples lie: number ``i`` at t_enter + i * step, from 1 to ``last``.
    struct Ray {
        float origin[3], direction[3];
        float t_enter, step, last;
        float per_texel[3], offset[3];  // coordinate c is passed by sample c * per_texel + offset, less the slack
        float per_cell, cell_offset;  // and cell n of a column, counted along the ray, is entered by n * per_cell + cell_offset
        int ahead[3];  // 1 where the ray goes up the axis
        int end[3];  // the last texel that the ray can come to
    };

    // A change between outside and inside, as one map sees it.
    struct Crossing {
        float t, residual;  // texels between the ray and the depth of the fragment
        int fragment;
    };

    struct Texel {
        int number, first, end;
    };

    SHARED float lesser(float a, float b) { return a < b ? a : b; }
    SHARED float greater(float a, float b) { return a > b ? a : b; }
    SHARED float size_of(float a) { return a < 0.0f ? -a : a; }
    // The number of the texel or cell that holds a coordinate, which is above -1; beyond the last it counts to that.
    SHARED int floored(float c, int last) { return (unsigned)(int)c < (unsigned)last ? (int)c : last; }

    // Words that hold a set bit alone.
    SHARED int low_zeros(Word word) {
#if defined(__CUDA_ARCH__)
        return __ffsll((long long)word) - 1;
#else
        return __builtin_ctzll(word);
#endif
    }
    SHARED int high_zeros(Word word) {
#if defined(__CUDA_ARCH__)
        return __clzll((long long)word);
#else
        return __builtin_clzll(word);
#endif
    }

    SHARED float coordinate(const Ray& ray, int axis, float t) {
        UNFUSED
        return ray.origin[axis] + t * ray.direction[axis];
    }

    SHARED float time_of(const Ray& ray, float number) {
        UNFUSED
        return ray.t_enter + number * ray.step;
    }

    // The texel that holds a point in the map of an axis; points outside count to the nearest.
    SHARED Texel texel_at(const Maps& maps, int axis, float u, float v) {
        const int columns = maps.size[axis == 2 ? 0 : axis + 1], rows = maps.size[axis == 0 ? 2 : axis - 1];
        const int texel = maps.first_texel[axis] + floored(v, rows - 1) * columns + floored(u, columns - 1);
        return {texel, maps.start[texel], maps.start[texel + 1]};
    }

    SHARED Texel texel_of(const Maps& maps, const Ray& ray, int axis, float t) {
        const int u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
        return texel_at(maps, axis, coordinate(ray, u, t), coordinate(ray, v, t));
    }

    // Of sorted fragments the first that lies beyond a depth.
    SHARED int passed(const Maps& maps, int first, int end, float depth) {
        while (end - first > FEW) {
            const int middle = first + (end - first) / 2;
            if (maps.depth[middle] <= depth) first = middle + 1;
            else end = middle;
        }
        while (first < end && maps.depth[first] <= depth) ++first;
        return first;
    }

    // Whether a ray is inside before fragment ``k`` of a texel.
    SHARED bool is_inside(const Maps& maps, const Texel& texel, int k, int ahead) {
        if (k > texel.first) return (maps.inside[k - 1] >> (1 - ahead)) & 1;
        return (texel.end - texel.first) & (1 - ahead) & 1;
    }

    SHARED bool inside_at(const Maps& maps, const Ray& ray, int axis, float t) {
        const Texel texel = texel_of(maps, ray, axis, t);
        const int k = passed(maps, texel.first, texel.end, coordinate(ray, axis, t));
        return is_inside(maps, texel, k, ray.ahead[axis]);
    }

    // ``best``, or the fragment of the texel at t that is nearer in depth; of equals the first.
    SHARED Crossing nearest_fragment(const Maps& maps, const Ray& ray, int axis, float t, Crossing best) {
        const Texel texel = texel_of(maps, ray, axis, t);
        const float depth = coordinate(ray, axis, t);
        const int k = passed(maps, texel.first, texel.end, depth);
        if (k > texel.first) {
            const float below = size_of(maps.depth[k - 1] - depth);
            if (below < best.residual) {
                int first = k - 1;
                while (first > texel.first && size_of(maps.depth[first - 1] - depth) == below) --first;
                best.residual = below;
                best.fragment = first;
            }
        }
        if (k < texel.end) {
            const float above = size_of(maps.depth[k] - depth);
            if (above < best.residual) {
                best.residual = above;
                best.fragment = k;
            }
        }
        return best;
    }

    // The last sample for certain before a coordinate is reached.
    SHARED float sample_before(const Ray& ray, int axis, float c) {
        FUSED
        return c * ray.per_texel[axis] + ray.offset[axis];
    }

    // The last sample for certain in the cell of 2^shift texels that a texel lies in, as far as one axis goes. What lies
    // beyond the box counts to its last texels.
    SHARED float sample_in(const Ray& ray, int axis, int texel, int shift) {
        const int cell = texel >> shift;
        const float out = sample_before(ray, axis, (float)((cell + ray.ahead[axis]) << shift));
        return cell == ray.end[axis] >> shift ? NEVER : out;
    }

    // Share out the ray's way from t_enter to t_exit among so many samples; or one for each texel passed, and no fewer than
    // texels lie along the longest side: a flat object is passed within a few.
    SHARED void sample_until(Ray& ray, const Maps& maps, float t_exit, int steps) {
        UNFUSED
        const float* d = ray.direction;
        float last = (float)steps;
        if (steps == ONE_A_TEXEL) {
            const float texels = (t_exit - ray.t_enter) * (size_of(d[0]) + size_of(d[1]) + size_of(d[2]));
            last = (float)(int)texels;
            last = last < texels ? last + 1.0f : last;
            for (int axis = 0; axis < 3; ++axis) last = greater((float)maps.size[axis], last);
        }
        ray.last = last;
        ray.step = (t_exit - ray.t_enter) / last;
        float extent = 0.0f;
        for (int axis = 0; axis < 3; ++axis) extent += size_of(ray.origin[axis]) + (float)maps.size[axis];
        const float slack = SLACK * extent;
        for (int axis = 0; axis < 3; ++axis) {
            const float per_sample = ray.step * d[axis];
            ray.ahead[axis] = d[axis] > 0.0f ? 1 : 0;
            ray.end[axis] = d[axis] > 0.0f ? maps.size[axis] - 1 : 0;
            if (per_sample == 0.0f) {
                ray.per_texel[axis] = 0.0f;
                ray.offset[axis] = NEVER;
            } else {
                // A shorter way to the next texel than the true one is on the safe side.
                const float speed = greater(size_of(per_sample), SLOWEST);
                ray.per_texel[axis] = (d[axis] > 0.0f ? 1.0f : -1.0f) / speed;
                ray.offset[axis] = -coordinate(ray, axis, ray.t_enter) * ray.per_texel[axis] - slack / speed;
            }
        }
        const float texels = (float)(1 << maps.cell_shift);
        ray.per_cell = texels * size_of(ray.per_texel[2]);
        ray.cell_offset = sample_before(ray, 2, d[2] > 0.0f ? 0.0f : 64.0f * texels);
    }

    // The first sample from number ``i`` on at which a map of ``axes``, a bit each, does not say ``inside``.
    SHARED float next_change(const Maps& maps, const Ray& ray, int axes, bool inside, float i, int& steps) {
        const int last_x = maps.size[0] - 1, last_y = maps.size[1] - 1, last_z = maps.size[2] - 1;
        const Word* cells = maps.cells + (inside ? 1 : 0);
        int level = i > 1.0f ? 0 : maps.levels - 1;
        while (i <= ray.last) {
            const float t = time_of(ray, i);
            const float p[3] = {coordinate(ray, 0, t), coordinate(ray, 1, t), coordinate(ray, 2, t)};
            const int x = floored(p[0], last_x), y = floored(p[1], last_y), z = floored(p[2], last_z);
            const int cell = ray.ahead[2] ? z >> maps.cell_shift : 63 - (z >> maps.cell_shift);
            float skip = ray.last;
            ++steps;

            // Find the largest cell about the sample that the maps agree about, and the cells above or below it.
            int shift, run = 0;
            for (; level >= 0; --level) {
                shift = maps.cell_shift + LEVEL_SHIFT * level;
                const int columns = maps.column_shift - LEVEL_SHIFT * level;
                const int column = maps.first_column[level] + ((y >> shift) << columns) + (x >> shift);
                const Word word = cells[2 * column];
                const Word beyond = ray.ahead[2] ? word >> cell : word << cell;
                run = beyond == 0 ? 64 : ray.ahead[2] ? low_zeros(beyond) : high_zeros(beyond);
                if (run > 0) {
                    skip = lesser(skip, lesser(sample_in(ray, 0, x, shift), sample_in(ray, 1, y, shift)));
                    skip = lesser(skip, (float)(cell + run) * ray.per_cell + ray.cell_offset);
                    break;
                }
            }
            if (level < 0) {
                // Ask the maps; what they say holds to the next texel, or to the next fragment.
                const int at[3] = {x, y, z};
                float out[3];
                #pragma unroll
                for (int axis = 0; axis < 3; ++axis) out[axis] = sample_in(ray, axis, at[axis], 0);
                #pragma unroll
                for (int axis = 0; axis < 3; ++axis) {
                    if (!(axes >> axis & 1)) continue;
                    const int u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
                    const int number = maps.first_texel[axis] + at[v] * maps.size[u] + at[u];
                    const Texel texel = {number, maps.start[number], maps.start[number + 1]};
                    const int k = passed(maps, texel.first, texel.end, p[axis]);
                    if (is_inside(maps, texel, k, ray.ahead[axis]) != inside) return i;
                    skip = lesser(skip, lesser(out[u], out[v]));
                    const int next = ray.ahead[axis] ? k : k - 1;
                    if (next >= texel.first && next < texel.end) skip = lesser(skip, sample_before(ray, axis, maps.depth[next]));
                }
            }
            level = level + 1 < maps.levels ? level + 1 : level;
            i = greater(i, floorf(skip)) + 1.0f;
        }
        return i;
    }

    // Where between two samples, ``inside`` at the first, the map changes; the interval is halved in place.
    SHARED void bisect(const Maps& maps, const Ray& ray, int axis, bool inside, int halvings, float& before, float& after) {
        const int ahead = ray.ahead[axis];
        const Texel at_before = texel_of(maps, ray, axis, before), at_after = texel_of(maps, ray, axis, after);
        const bool is_one = at_before.number == at_after.number;
        Texel texel = at_after;
        int from = 0, to = 0;
        if (is_one) {
            const int a = passed(maps, texel.first, texel.end, coordinate(ray, axis, before));
            const int b = passed(maps, texel.first, texel.end, coordinate(ray, axis, after));
            from = a < b ? a : b;
            to = a < b ? b : a;
        }
        for (int k = 0; k < halvings; ++k) {
            const float middle = 0.5f * (before + after);
            bool now;
            if (is_one) now = is_inside(maps, texel, passed(maps, from, to, coordinate(ray, axis, middle)), ahead);
            else now = inside_at(maps, ray, axis, middle);
            if (now != inside) after = middle;
            else before = middle;
        }
    }

    // Algorithm 1 of the paper in the map of one axis from sample ``i`` on: linear search, then bisection.
    SHARED Crossing search_map(const Maps& maps, const Ray& ray, int axis, bool inside, float i, int halvings, int& steps) {
        UNFUSED
        // A texel's error can put an origin on the surface inside the object: the way out is then no crossing. Deep
        // inside (a room seen from within) it is.
        bool counts = !inside || nearest_fragment(maps, ray, axis, 0.0f, {0.0f, INFINITY, -1}).residual > DEEP;
        for (; (i = next_change(maps, ray, 1 << axis, inside, i, steps)) <= ray.last; i += 1.0f) {
            float after = time_of(ray, i);
            float before = after - ray.step;
            bisect(maps, ray, axis, inside, halvings, before, after);
            if (counts) {
                Crossing found = nearest_fragment(maps, ray, axis, after, {after, INFINITY, -1});
                found = nearest_fragment(maps, ray, axis, before, found);
                if (found.residual <= CONSISTENT) return found;
            }
            inside = !inside;
            counts = true;
        }
        return {INFINITY, INFINITY, -1};
    }

    // The nearest crossing that a map confirms; with ``any`` the first that is found before t_max.
    SHARED Crossing search(const Maps& maps, Ray& ray, float t_exit, float t_max, bool any, int linear_steps, int halvings, int& steps) {
        sample_until(ray, maps, t_exit, linear_steps);
        int axes = 0, starts_inside = 0;
        for (int axis = 0; axis < 3; ++axis) {
            if (ray.direction[axis] == 0.0f) continue;
            axes |= 1 << axis;
            if (ray.t_enter == 0.0f && inside_at(maps, ray, axis, 0.0f)) starts_inside |= 1 << axis;
        }
        Crossing best = {INFINITY, INFINITY, -1};
        float first = 0.0f;  // sample up to which no map that is left has anything to say; 0 if that is not known
        for (int axis = 0; axis < 3; ++axis) {
            if (!(axes >> axis & 1)) continue;
            if (first == 0.0f) first = starts_inside ? 1.0f : next_change(maps, ray, axes, false, 1.0f, steps);
            const Crossing found = search_map(maps, ray, axis, starts_inside >> axis & 1, first, halvings, steps);
            axes &= ~(1 << axis);
            starts_inside &= axes;
            if (found.fragment >= 0) {
                best = found;
                // What another map finds is nearer, but for the rounding of its last sample.
                if (any && best.t * ROUNDED_UP < t_max) return best;
                // The other maps need look no farther, and share out a shorter way.
                sample_until(ray, maps, found.t, linear_steps);
                first = 0.0f;
            }
        }
        return best;
    }
};
