// The rays of a run, side by side, against spheres: eight at once (run_rays.py).

struct RunRays : Vectors {
    enum { LANES = 8 };

    // Of the rays that are asked for, a bit each, those that may meet a sphere. ``rows`` are six rows of RUN floats: where
    // the rays start, and their directions, along x, y and z. What is rounded to no number counts as met.
    SHARED unsigned long long near_sphere(
        const float* rows, const float* centre, float radius, unsigned long long asked
    ) {
        FUSED
        unsigned long long met = 0;
        const Eight square = eight(radius * radius), none = eight(0.0f);
        for (int first = 0; first < RUN; first += LANES) {
            if (!(asked >> first & 255)) continue;
            Eight v[3], d[3];
            for (int k = 0; k < 3; ++k) {
                v[k] = eight(centre[k]) - load(rows + k * RUN + first);
                d[k] = load(rows + (3 + k) * RUN + first);
            }
            const Eight x = v[1] * d[2] - v[2] * d[1], y = v[2] * d[0] - v[0] * d[2], z = v[0] * d[1] - v[1] * d[0];
            const Eight along = v[0] * d[0] + v[1] * d[1] + v[2] * d[2];
            const Eight apart = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
            // |v x d| is how far the centre is from the ray. A sphere that lies behind must hold the ray's start.
            const EightFlags misses = (x * x + y * y + z * z > square) | ((along < none) & (apart > square));
            met |= (unsigned long long)(~bits(misses) & 255) << first;
        }
        return met & asked;
    }
};
