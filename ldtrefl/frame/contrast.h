// Pixels of a row that are not half way between their neighbours, as many channels at once as a vector has lanes
// (contrast.py).

struct Contrast : Vectors {
    enum { TOGETHER = 64 };  // pixels

    // The square of the gap that is seen at a radiance, on a scale whose slope at L is 1 / (2 sqrt(L) (1 + L)^(3/2)).
    SHARED float seen_gap(float radiance, float least) {
        const float wide = 1.0f + radiance;
        return 4.0f * least * least * radiance * wide * wide * wide;
    }

    SHARED bool are_apart(const float* one, const float* other, float least) {
        bool found = false;
        for (int k = 0; k < 3; ++k) {
            const float gap = one[k] - other[k];
            found |= gap * gap > seen_gap(0.5f * (one[k] + other[k]), least);
        }
        return found;
    }

    // For each channel whether its value is not half way between those before and after it.
    SHARED void bends(const float* before, const float* at, const float* after, int count, float least, int* out) {
        for (int i = 0; i < count; ++i) {
            const float around = 0.5f * (before[i] + after[i]), gap = around - at[i];
            out[i] |= gap * gap > seen_gap(0.5f * (around + at[i]), least);
        }
    }

    // Mark pixels of a row. ``above`` and ``below`` are 0 where the row is the image's first or last.
    SHARED void mark_row(
        const float* radiance, const int* seen, int width, bool has_above, bool has_below, float within, float at_edge,
        unsigned char* marked
    ) {
        const float* const above = has_above ? radiance - 3 * width : radiance;
        const float* const below = has_below ? radiance + 3 * width : radiance;
        const int* const seen_above = has_above ? seen - width : seen;
        const int* const seen_below = has_below ? seen + width : seen;
        for (int first = 0; first < width; first += TOGETHER) {
            const int end = first + TOGETHER < width ? first + TOGETHER : width;
            int bent_across[3 * TOGETHER] = {}, bent_along[3 * TOGETHER] = {};
            const int from = first > 0 ? first : 1, to = end < width ? end : width - 1;
            if (to > from) {
                const float* const at = radiance + 3 * from;
                bends(at - 3, at, at + 3, 3 * (to - from), within, bent_across + 3 * (from - first));
            }
            bends(above + 3 * first, radiance + 3 * first, below + 3 * first, 3 * (end - first), within, bent_along);
            for (int x = first; x < end; ++x) {
                const int left = x > 0 ? x - 1 : x, right = x + 1 < width ? x + 1 : x, i = 3 * (x - first);
                const float* const here = radiance + 3 * x;
                bool is_marked;
                if (seen[left] == seen[x] && seen[right] == seen[x])
                    is_marked = bent_across[i] | bent_across[i + 1] | bent_across[i + 2];
                else
                    is_marked = are_apart(here, radiance + 3 * left, at_edge) ||
                                are_apart(here, radiance + 3 * right, at_edge);
                if (seen_above[x] == seen[x] && seen_below[x] == seen[x])
                    is_marked |= bent_along[i] | bent_along[i + 1] | bent_along[i + 2];
                else
                    is_marked |= are_apart(here, above + 3 * x, at_edge) || are_apart(here, below + 3 * x, at_edge);
                marked[x] = is_marked;
            }
        }
    }
};
