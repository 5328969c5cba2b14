// Rays as users give them, on their way into an object's unit space, and what they meet on its way out (batch.py).

struct RayBatch : RayQuery {
    SHARED bool is_finite(float x) { return x < INFINITY && x > -INFINITY; }
    SHARED bool is_finite(const float* p) { return is_finite(p[0]) && is_finite(p[1]) && is_finite(p[2]); }

    // The power of two, which rounds nothing, that brings a direction's length near 1; 0 if it has none.
    SHARED float scale_of(const float* direction) {
        const float x = direction[0], y = direction[1], z = direction[2];
        const float square = x * x + y * y + z * z;
        if (square > 0.5f && square < 2.0f) return 1.0f;
        const float largest = greater(greater(greater(x, -x), greater(y, -y)), greater(z, -z));
        if (!(largest > 0.0f && is_finite(direction))) return 0.0f;
        const int exponent = as_int(largest) >> 23;  // that of the scale is 254 less this
        return as_float((exponent < 254 ? 254 - exponent : 1) << 23);
    }

    // Shift and scale in float64: the object may be tiny and far from its origin. ``centre`` and ``per_half`` are those
    // of unit space, ``end`` is t up to where hits count. Returns the direction's scale; 0 if the ray is none, which
    // then searches for nothing.
    SHARED float start(
        Query& query, const float* origin, const float* direction, float end, const double* centre, double per_half
    ) {
        const float scale = is_finite(origin) ? scale_of(direction) : 0.0f;
        for (int k = 0; k < 3; ++k) {
            query.origin[k] = scale > 0.0f ? per_half * ((double)origin[k] - centre[k]) : 0.0;
            query.direction[k] = scale > 0.0f ? scale * direction[k] : 1.0f;
        }
        query.t_max = scale > 0.0f ? (float)(end * per_half / scale) : -1.0f;
        return scale;
    }
};
