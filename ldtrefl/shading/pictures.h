// Pictures that are read at a point, or over what a pixel covers of them (textures.py, which says how).

#if defined(__CUDA_ARCH__)
#define APART CUDA_CALLABLE static
#else
#define APART static __attribute__((noinline))  // compiled once, however often it is called
#endif
#define SHARED CUDA_CALLABLE static inline

struct Pictures {
    struct Texel { float x, y, z, w; };

    // A picture, and where its texels are. Of those that are filtered the smaller ones, each half as wide and high as
    // the one before, stand in ``mip_``, one after another.
    struct Picture {
        int width, height, stored, wrap_u, wrap_v, is_nearest;
        float across[3], down[3];
        const float* floats;
        const unsigned char* bytes;
        const unsigned char* alpha;  // null if it is opaque
        const float* decoded;        // the linear value of every byte of sRGB
        const float* mip_floats;
        const unsigned char* mip_bytes;
        const unsigned char* mip_alpha;
    };

    // What a filter covers of a picture: an ellipse, of which ``long_s`` and ``long_t`` are the way along its longer axis,
    // as parts of the picture, in so many probes, each read from the picture that is ``level`` times halved.
    struct Covered {
        float long_s, long_t, level;
        int probes;
    };

    SHARED float larger(float a, float b) { return a > b ? a : b; }
    SHARED float smaller(float a, float b) { return a < b ? a : b; }
    SHARED float clamped(float a, float low, float high) { return smaller(larger(a, low), high); }

    // The texel that stands at ``i`` in a row of ``count`` that goes on for ever; ``i`` is from -2 to 2 count + 2.
    SHARED int wrapped(int i, int count, int wrap) {
        if (wrap == CLAMP) return i < 0 ? 0 : i < count ? i : count - 1;
        const int period = wrap == MIRROR ? 2 * count : count;
        while (i < 0) i += period;
        while (i >= period) i -= period;  // a division would take longer
        return i < count ? i : period - 1 - i;
    }

    SHARED Texel texel(const Picture& of, int column, int row) {
        const long long at = (long long)row * of.width + column;
        Texel made;
        if (of.stored == LINEAR_FLOATS) {
            made.x = of.floats[3 * at];
            made.y = of.floats[3 * at + 1];
            made.z = of.floats[3 * at + 2];
        } else if (of.stored == SRGB_BYTES) {
            made.x = of.decoded[of.bytes[3 * at]];
            made.y = of.decoded[of.bytes[3 * at + 1]];
            made.z = of.decoded[of.bytes[3 * at + 2]];
        } else {
            made.x = BYTE * of.bytes[3 * at];
            made.y = BYTE * of.bytes[3 * at + 1];
            made.z = BYTE * of.bytes[3 * at + 2];
        }
        made.w = of.alpha ? BYTE * of.alpha[at] : 1.0f;
        return made;
    }

    SHARED void add(Texel& total, float weight, const Texel& one) {
        total.x += weight * one.x;
        total.y += weight * one.y;
        total.z += weight * one.z;
        total.w += weight * one.w;
    }

    // A coordinate in texels, brought to where ``wrapped`` can number them.
    SHARED float in_texels(float s, int count, int wrap) {
        s = clamped(s, -FARTHEST, FARTHEST);
        if (wrap != CLAMP) s -= 2.0f * floorf(0.5f * s);
        return clamped(s, -1.0f, 2.0f) * (float)count;
    }

    // Where a picture has (u, v): 0 to 1 to the right and down.
    SHARED void place_of(const Picture& of, float u, float v, float& s, float& t) {
        s = of.across[0] * u + of.across[1] * v + of.across[2];
        t = of.down[0] * u + of.down[1] * v + of.down[2];
    }

    // A picture's colour and alpha at a place: of four texels, blended.
    APART Texel blended_at(const Picture& of, float s, float t) {
        const float x = in_texels(s, of.width, of.wrap_u) - 0.5f, y = in_texels(t, of.height, of.wrap_v) - 0.5f;
        const float left = floorf(x), top = floorf(y);
        const int columns[2] = {
            wrapped((int)left, of.width, of.wrap_u), wrapped((int)left + 1, of.width, of.wrap_u)
        };
        const int rows[2] = {wrapped((int)top, of.height, of.wrap_v), wrapped((int)top + 1, of.height, of.wrap_v)};
        Texel total = {0.0f, 0.0f, 0.0f, 0.0f};
        for (int corner = 0; corner < 4; ++corner) {
            const int column = corner & 1, row = corner >> 1;
            const float weight =
                (column ? x - left : 1.0f - (x - left)) * (row ? y - top : 1.0f - (y - top));
            add(total, weight, texel(of, columns[column], rows[row]));
        }
        return total;
    }

    // A picture's colour and alpha at (u, v): of the nearest texel, or of four, blended.
    SHARED Texel sample(const Picture& of, float u, float v) {
        float s, t;
        place_of(of, u, v, s, t);
        if (!of.is_nearest) return blended_at(of, s, t);
        const int column = (int)floorf(in_texels(s, of.width, of.wrap_u));
        const int row = (int)floorf(in_texels(t, of.height, of.wrap_v));
        return texel(of, wrapped(column, of.width, of.wrap_u), wrapped(row, of.height, of.wrap_v));
    }

    // A picture that is so many times halved. Of an odd number of texels half is rounded down.
    SHARED Picture halved(const Picture& of, int times) {
        if (times == 0 || (of.width == 1 && of.height == 1)) return of;
        Picture made = of;
        long long first = 0;
        for (int level = 1;; ++level) {
            made.width = made.width > 1 ? made.width / 2 : 1;
            made.height = made.height > 1 ? made.height / 2 : 1;
            if (level == times || (made.width == 1 && made.height == 1)) break;
            first += (long long)made.width * made.height;
        }
        made.floats = of.mip_floats + 3 * first;
        made.bytes = of.mip_bytes + 3 * first;
        made.alpha = of.alpha ? of.mip_alpha + first : nullptr;
        return made;
    }

    // What a filter covers, if texture coordinates change by ``change`` to the next pixel: u and v to the right, then
    // below.
    APART Covered covered_by(const Picture& of, const float* change) {
        float axis[2][2];  // in texels
        for (int i = 0; i < 2; ++i) {
            const float u = change[2 * i], v = change[2 * i + 1];
            axis[i][0] = clamped((of.across[0] * u + of.across[1] * v) * (float)of.width, -FARTHEST, FARTHEST);
            axis[i][1] = clamped((of.down[0] * u + of.down[1] * v) * (float)of.height, -FARTHEST, FARTHEST);
        }
        // The ellipse's half-axes are singular values: the square roots of the matrix' eigenvalues.
        const float xx = axis[0][0] * axis[0][0] + axis[1][0] * axis[1][0];
        const float yy = axis[0][1] * axis[0][1] + axis[1][1] * axis[1][1];
        const float xy = axis[0][0] * axis[0][1] + axis[1][0] * axis[1][1];
        const float half = 0.5f * (xx - yy), root = sqrtf(half * half + xy * xy);
        const float major = sqrtf(0.5f * (xx + yy) + root);
        if (!(PROBE_WIDTH * major > 1.0f)) return {0.0f, 0.0f, 0.0f, 1};
        const float area = axis[0][0] * axis[1][1] - axis[0][1] * axis[1][0];
        // Probes are as wide as the shorter axis, or as so many may be; and none is narrower than a texel.
        const float minor = larger(larger(area, -area) / major, 1.0f / PROBE_WIDTH);
        const float whole = FILTER_WIDTH * sqrtf(larger(major * major - minor * minor, 0.0f));
        const float probe = larger(PROBE_WIDTH * minor, MOST_PROBES == 1 ? PROBE_WIDTH * major : whole / (PROBE_STEP * MOST_PROBES));
        const float x = half > 0.0f ? half + root : xy, y = half > 0.0f ? xy : root - half;
        const float length = sqrtf(x * x + y * y), scale = length > 0.0f ? whole / length : 0.0f;
        Covered made;
        made.long_s = scale * x / (float)of.width;
        made.long_t = scale * y / (float)of.height;
        made.level = log2f(probe);
        made.probes = MOST_PROBES == 1 ? 1 : (int)larger(ceilf(whole / (PROBE_STEP * probe) - ROUNDING), 1.0f);
        return made;
    }

    // The texels on both sides of a coordinate in parts of a picture, and how near to the later one it is.
    SHARED void neighbours(float s, int count, int wrap, int& before, int& after, float& share) {
        if (wrap == REPEAT) {  // most are read so, and it takes less
            const float x = (s - floorf(s)) * (float)count + 0.5f;
            after = (int)x;
            share = x - (float)after;
            before = after > 0 ? after - 1 : count - 1;
            if (after >= count) after = 0;
            return;
        }
        const float x = in_texels(s, count, wrap) - 0.5f, left = floorf(x);
        share = x - left;
        before = wrapped((int)left, count, wrap);
        after = wrapped((int)left + 1, count, wrap);
    }

    // Add the probes in a row, each of four texels, blended, and counting as a tent says. The row's middle is at (s, t).
    APART void add_probes(const Picture& of, const Covered& by, float s, float t, float counts, Texel& total) {
        const float step = 1.0f / (float)by.probes;
        for (int i = 0; i < by.probes; ++i) {
            const float along = ((float)i + 0.5f) * step - 0.5f;
            int left, right, above, below;
            float x, y;
            neighbours(s + along * by.long_s, of.width, of.wrap_u, left, right, x);
            neighbours(t + along * by.long_t, of.height, of.wrap_v, above, below, y);
            const float part = counts * (1.0f - fabsf(2.0f * along));
            const float upper = part * (1.0f - y), lower = part * y;
            add(total, upper * (1.0f - x), texel(of, left, above));
            add(total, upper * x, texel(of, right, above));
            add(total, lower * (1.0f - x), texel(of, left, below));
            add(total, lower * x, texel(of, right, below));
        }
    }

    // The mean of a picture's colour and alpha about (u, v), over what a filter covers.
    APART Texel mean_over(const Picture& of, float u, float v, const float* change) {
        const Covered by = covered_by(of, change);
        if (!(by.level > 0.0f) && by.probes == 1) return sample(of, u, v);
        const float level = floorf(larger(by.level, 0.0f)), share = larger(by.level, 0.0f) - level;
        float s, t;
        place_of(of, u, v, s, t);
        s = clamped(s, -FARTHEST, FARTHEST);
        t = clamped(t, -FARTHEST, FARTHEST);
        Texel total = {0.0f, 0.0f, 0.0f, 0.0f};
        add_probes(halved(of, (int)level), by, s, t, 1.0f - share, total);
        if (share > 0.0f) add_probes(halved(of, (int)level + 1), by, s, t, share, total);
        // What a tent is at so many places in a row sums up to half of their number, and a little more if that is odd.
        const float count = (float)by.probes, part = 2.0f * count / (count * count + (float)(by.probes & 1));
        return {part * total.x, part * total.y, part * total.z, part * total.w};
    }
};
