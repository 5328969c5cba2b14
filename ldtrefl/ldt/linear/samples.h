// From sample to sample that can matter.
//
// Between two samples of one texel with no fragment between them nothing changes, and in a cell that the maps agree
// about (occupancy.py) nothing changes either: the samples there need no look. How far such a stretch reaches is reckoned
// in numbers of samples, on the safe side by a slack. What a sample says is computed for that sample alone, by the same
// roundings as if none were left out.

struct Samples : SortedMaps {
    // The last sample for certain before a coordinate is reached.
    SHARED float sample_before(const Ray& ray, int axis, float c) {
        FUSED
        return c * ray.per_texel[axis] + ray.offset[axis];
    }

    // The last sample for certain in the cell of 2^shift texels that a texel lies in, as far as one axis goes. What lies
    // beyond the box counts to its last texels.
    SHARED float sample_in(const Ray& ray, int axis, int texel, int shift) {
        const int cell = texel >> shift;
        const float out = sample_before(ray, axis, (float)((cell + ray.goes_up[axis]) << shift));
        return cell == ray.end[axis] >> shift ? NEVER : out;
    }

    // Share out the ray's way from t_enter to t_exit among so many samples; or one for each texel passed, and no fewer
    // than texels lie along the longest side: a flat object is passed within a few.
    SHARED void place_samples(Ray& ray, const Maps& maps, float t_exit, int steps) {
        UNFUSED
        const float* d = ray.direction;
        float last = (float)steps;
        if (steps == ONE_A_TEXEL) {
            const float texels = (t_exit - ray.t_enter) * (magnitude(d[0]) + magnitude(d[1]) + magnitude(d[2]));
            last = (float)(int)texels;
            last = last < texels ? last + 1.0f : last;
            for (int axis = 0; axis < 3; ++axis) last = greater((float)maps.size[axis], last);
        }
        ray.last = last;
        ray.step = (t_exit - ray.t_enter) / last;
        float extent = 0.0f;
        for (int axis = 0; axis < 3; ++axis) extent += magnitude(ray.origin[axis]) + (float)maps.size[axis];
        const float slack = SLACK * extent;
        for (int axis = 0; axis < 3; ++axis) {
            const float per_sample = ray.step * d[axis];
            ray.goes_up[axis] = d[axis] > 0.0f ? 1 : 0;
            ray.end[axis] = d[axis] > 0.0f ? maps.size[axis] - 1 : 0;
            if (per_sample == 0.0f) {
                ray.per_texel[axis] = 0.0f;
                ray.offset[axis] = NEVER;
            } else {
                // A shorter way to the next texel than the true one is on the safe side.
                const float speed = greater(magnitude(per_sample), SLOWEST);
                ray.per_texel[axis] = (d[axis] > 0.0f ? 1.0f : -1.0f) / speed;
                ray.offset[axis] = -coordinate(ray, axis, ray.t_enter) * ray.per_texel[axis] - slack / speed;
            }
        }
        const float texels = (float)(1 << maps.cell_shift);
        ray.per_cell = texels * magnitude(ray.per_texel[2]);
        ray.cell_offset = sample_before(ray, 2, d[2] > 0.0f ? 0.0f : 64.0f * texels);
    }

    // The first sample from number ``i`` on at which a map of ``axes``, a bit each, does not say ``inside``. ``steps``
    // counts the samples that are looked at.
    SHARED float next_change(const Maps& maps, const Ray& ray, int axes, bool inside, float i, int& steps) {
        const int last_x = maps.size[0] - 1, last_y = maps.size[1] - 1, last_z = maps.size[2] - 1;
        const Word* cells = maps.cells + (inside ? 1 : 0);
        int level = i > 1.0f ? 0 : maps.levels - 1;
        while (i <= ray.last) {
            const float t = t_of_sample(ray, i);
            const float p[3] = {coordinate(ray, 0, t), coordinate(ray, 1, t), coordinate(ray, 2, t)};
            const int x = floored(p[0], last_x), y = floored(p[1], last_y), z = floored(p[2], last_z);
            const int cell = ray.goes_up[2] ? z >> maps.cell_shift : 63 - (z >> maps.cell_shift);
            float skip = ray.last;  // the last sample that need no look
            ++steps;

            // Find the largest cell about the sample that the maps agree about, and the cells above or below it.
            for (; level >= 0; --level) {
                const int shift = maps.cell_shift + LEVEL_SHIFT * level;
                const int columns = maps.column_shift - LEVEL_SHIFT * level;
                const int column = maps.first_column[level] + ((y >> shift) << columns) + (x >> shift);
                const Word word = cells[2 * column];
                const Word beyond = ray.goes_up[2] ? word >> cell : word << cell;
                const int run = beyond == 0 ? 64 : ray.goes_up[2] ? low_zeros(beyond) : high_zeros(beyond);
                if (run > 0) {
                    skip = lesser(skip, lesser(sample_in(ray, 0, x, shift), sample_in(ray, 1, y, shift)));
                    skip = lesser(skip, (float)(cell + run) * ray.per_cell + ray.cell_offset);
                    break;
                }
            }
            if (level < 0) {
                // Ask the maps; what they say holds to the next texel, or to the next fragment.
                const int at[3] = {x, y, z};
                if (maps_differ(maps, ray, axes, inside, at, p, skip)) return i;
            }
            level = level + 1 < maps.levels ? level + 1 : level;
            i = greater(i, floorf(skip)) + 1.0f;
        }
        return i;
    }

    // Whether a map of ``axes`` does not say ``inside`` at a point in a texel. If all do, ``skip`` is brought down to the
    // last sample for which that is certain.
    SHARED bool maps_differ(
        const Maps& maps, const Ray& ray, int axes, bool inside, const int* texel_number, const float* point, float& skip
    ) {
        float out[3];
        #pragma unroll
        for (int axis = 0; axis < 3; ++axis) out[axis] = sample_in(ray, axis, texel_number[axis], 0);
        #pragma unroll
        for (int axis = 0; axis < 3; ++axis) {
            if (!(axes >> axis & 1)) continue;
            const int u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
            const int number = maps.first_texel[axis] + texel_number[v] * maps.size[u] + texel_number[u];
            const Texel texel = {number, maps.start[number], maps.start[number + 1]};
            const int k = first_beyond(maps, texel.first, texel.end, point[axis]);
            if (is_inside(maps, texel, k, ray.goes_up[axis]) != inside) return true;
            skip = lesser(skip, lesser(out[u], out[v]));
            const int next = ray.goes_up[axis] ? k : k - 1;
            if (next >= texel.first && next < texel.end)
                skip = lesser(skip, sample_before(ray, axis, maps.depth[next]));
        }
        return false;
    }
};
