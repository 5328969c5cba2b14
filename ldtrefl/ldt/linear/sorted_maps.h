// Sorted maps (maps.py) as the paper's search reads them, a ray in them, and what a map says at a sample.
//
// A map's answer at a sample depends on the texel, and on which fragments lie before the sample. Both follow from
// coordinates that only grow, or only fall, along the ray, whatever the rounding.

#if defined(__CUDA_ARCH__)
#define SHARED CUDA_CALLABLE static inline
#define UNFUSED
#define FUSED
#else
#define SHARED static inline
#define UNFUSED _Pragma("clang fp contract(off)")  // a * b + c is rounded twice, as in other kernels
#define FUSED _Pragma("clang fp contract(fast)")
#endif

struct SortedMaps {
    typedef unsigned long long Word;

    // Three sorted maps (maps.py), and the cells that they agree about (occupancy.py).
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
        // Coordinate c is passed by sample c * per_texel + offset, less the slack. Cell n of a column, counted along the
        // ray, is entered by sample n * per_cell + cell_offset.
        float per_texel[3], offset[3];
        float per_cell, cell_offset;
        int goes_up[3];  // 1 where the ray goes up the axis, else 0
        int end[3];      // the last texel that the ray can come to
    };

    // A change between outside and inside, as one map sees it.
    struct Crossing {
        float t, residual;  // texels between the ray and the depth of the fragment
        int fragment;       // -1 for none
    };

    struct Texel {
        int number, first, end;  // its fragments are ``first`` to ``end``
    };

    SHARED float lesser(float a, float b) { return a < b ? a : b; }
    SHARED float greater(float a, float b) { return a > b ? a : b; }
    SHARED float magnitude(float a) { return a < 0.0f ? -a : a; }
    // The number of the texel or cell that holds a coordinate, which is above -1; beyond the last it counts to that.
    SHARED int floored(float c, int last) { return (unsigned)(int)c < (unsigned)last ? (int)c : last; }

    // How many zeros lie below, or above, the set bits of a word that is not 0.
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

    SHARED float t_of_sample(const Ray& ray, float number) {
        UNFUSED
        return ray.t_enter + number * ray.step;
    }

    // The texel that holds a point in the map of an axis; points outside count to the nearest.
    SHARED Texel texel_at(const Maps& maps, int axis, float u, float v) {
        const int columns = maps.size[axis == 2 ? 0 : axis + 1], rows = maps.size[axis == 0 ? 2 : axis - 1];
        const int texel = maps.first_texel[axis] + floored(v, rows - 1) * columns + floored(u, columns - 1);
        return {texel, maps.start[texel], maps.start[texel + 1]};
    }

    // The texel of a ray at t in the map of an axis.
    SHARED Texel texel_of(const Maps& maps, const Ray& ray, int axis, float t) {
        const int u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
        return texel_at(maps, axis, coordinate(ray, u, t), coordinate(ray, v, t));
    }

    // The first of sorted fragments that lies beyond a depth; ``end`` if none does.
    SHARED int first_beyond(const Maps& maps, int first, int end, float depth) {
        while (end - first > FEW) {
            const int middle = first + (end - first) / 2;
            if (maps.depth[middle] <= depth) first = middle + 1;
            else end = middle;
        }
        while (first < end && maps.depth[first] <= depth) ++first;
        return first;
    }

    // Whether a ray is inside before fragment ``k`` of a texel.
    SHARED bool is_inside(const Maps& maps, const Texel& texel, int k, int goes_up) {
        if (k > texel.first) return (maps.inside[k - 1] >> (1 - goes_up)) & 1;
        return (texel.end - texel.first) & (1 - goes_up) & 1;
    }

    // Whether the map of an axis says that a ray is inside at t.
    SHARED bool inside_at(const Maps& maps, const Ray& ray, int axis, float t) {
        const Texel texel = texel_of(maps, ray, axis, t);
        const int k = first_beyond(maps, texel.first, texel.end, coordinate(ray, axis, t));
        return is_inside(maps, texel, k, ray.goes_up[axis]);
    }

    // ``best``, or the fragment of the texel at t that is nearer in depth; of equals the first.
    SHARED Crossing nearest_fragment(const Maps& maps, const Ray& ray, int axis, float t, Crossing best) {
        const Texel texel = texel_of(maps, ray, axis, t);
        const float depth = coordinate(ray, axis, t);
        const int k = first_beyond(maps, texel.first, texel.end, depth);
        if (k > texel.first) {
            const float below = magnitude(maps.depth[k - 1] - depth);
            if (below < best.residual) {
                int first = k - 1;
                while (first > texel.first && magnitude(maps.depth[first - 1] - depth) == below) --first;
                best.residual = below;
                best.fragment = first;
            }
        }
        if (k < texel.end) {
            const float above = magnitude(maps.depth[k] - depth);
            if (above < best.residual) {
                best.residual = above;
                best.fragment = k;
            }
        }
        return best;
    }
};
