// What a look makes of a surface: pictures that are read, normals that are mapped, and how much layers reflect
// (finish.py, which says where the formulas are from).

struct Finishes : Vectors {
    struct Three { float x, y, z; };
    struct Texel { float x, y, z, w; };

    // A picture, and where its texels are.
    struct Picture {
        int width, height, stored, wrap_u, wrap_v, is_nearest;
        float across[3], down[3];
        const float* floats;
        const unsigned char* bytes;
        const unsigned char* alpha;  // null if it is opaque
        const float* decoded;        // the linear value of every byte of sRGB
    };

    // How much a layer reflects at normal incidence and along the surface, multiple scattering included.
    struct Layer { Three low, high; };

    // How much a smooth or rough surface reflects of light from everywhere: ``low`` times its reflectance at normal
    // incidence and ``high`` times that along the surface; and the mean cosine between rays and the mirrored ray.
    struct Shares { float low, high, cosine; };

    SHARED Three sum(const Three& a, const Three& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    SHARED Three minus(const Three& a, const Three& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    SHARED Three scaled(float s, const Three& a) { return {s * a.x, s * a.y, s * a.z}; }
    SHARED Three product(const Three& a, const Three& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
    SHARED float dot(const Three& a, const Three& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
    SHARED Three cross(const Three& a, const Three& b) {
        return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    }
    SHARED Three unit(const Three& a) {
        const float square = dot(a, a);
        return square > 0.0f ? scaled(1.0f / sqrtf(square), a) : a;
    }
    SHARED Three mixed(float share, const Three& a, const Three& b) {
        return sum(scaled(1.0f - share, a), scaled(share, b));
    }
    SHARED float larger(float a, float b) { return a > b ? a : b; }
    SHARED float smaller(float a, float b) { return a < b ? a : b; }
    SHARED float largest(const Three& a) { return larger(larger(a.x, a.y), a.z); }
    SHARED float clamped(float a, float low, float high) { return smaller(larger(a, low), high); }

    // The texel that stands at ``i`` in a row of ``count`` that goes on for ever; ``i`` is from -2 to 2 count + 2.
    SHARED int wrapped(int i, int count, int wrap) {
        if (wrap == CLAMP) return i < 0 ? 0 : i < count ? i : count - 1;
        const int period = wrap == MIRROR ? 2 * count : count;
        i %= period;
        if (i < 0) i += period;
        return i < count ? i : period - 1 - i;
    }

    SHARED Texel texel(const Picture& of, int column, int row) {
        const long long at = (long long)wrapped(row, of.height, of.wrap_v) * of.width + wrapped(column, of.width, of.wrap_u);
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

    // A coordinate in texels, brought to where ``wrapped`` can number them.
    SHARED float in_texels(float s, int count, int wrap) {
        s = clamped(s, -FARTHEST, FARTHEST);
        if (wrap != CLAMP) s -= 2.0f * floorf(0.5f * s);
        return clamped(s, -1.0f, 2.0f) * (float)count;
    }

    // A picture's colour and alpha at (u, v): of the nearest texel, or of four, blended.
    OUT_OF_LINE Texel sample(const Picture& of, float u, float v) {
        const float s = of.across[0] * u + of.across[1] * v + of.across[2];
        const float t = of.down[0] * u + of.down[1] * v + of.down[2];
        float x = in_texels(s, of.width, of.wrap_u), y = in_texels(t, of.height, of.wrap_v);
        if (of.is_nearest) return texel(of, (int)floorf(x), (int)floorf(y));
        x -= 0.5f;
        y -= 0.5f;
        const float left = floorf(x), top = floorf(y);
        Texel total = {0.0f, 0.0f, 0.0f, 0.0f};
        for (int corner = 0; corner < 4; ++corner) {
            const int column = corner & 1, row = corner >> 1;
            const float weight =
                (column ? x - left : 1.0f - (x - left)) * (row ? y - top : 1.0f - (y - top));
            const Texel one = texel(of, (int)left + column, (int)top + row);
            total.x += weight * one.x;
            total.y += weight * one.y;
            total.z += weight * one.z;
            total.w += weight * one.w;
        }
        return total;
    }

    // The way in which a picture runs to the right on a triangle with these corners and these texture coordinates, (u,
    // v) each; ``sign`` is -1 where the picture is mirrored there. (MikkTSpace, of one triangle.)
    SHARED Three picture_right(const Picture& of, const Three* corner, const float* uv, float& sign) {
        float s[3], t[3];
        for (int c = 0; c < 3; ++c) {
            s[c] = of.across[0] * uv[2 * c] + of.across[1] * uv[2 * c + 1] + of.across[2];
            t[c] = of.down[0] * uv[2 * c] + of.down[1] * uv[2 * c + 1] + of.down[2];
        }
        const Three ab = minus(corner[1], corner[0]), ac = minus(corner[2], corner[0]);
        // t is 0 at the top row: the area is above 0 where the picture is not mirrored.
        const float area = (t[1] - t[0]) * (s[2] - s[0]) - (s[1] - s[0]) * (t[2] - t[0]);
        sign = area < 0.0f ? -1.0f : 1.0f;
        return scaled(sign, minus(scaled(t[1] - t[0], ac), scaled(t[2] - t[0], ab)));
    }

    // A unit normal, bent so that it faces the viewer and stays on the facet's side. Both ways are unit vectors, less
    // than a right angle apart.
    SHARED Three on_facets_side(const Three& normal, const Three& facet, const Three& to_viewer) {
        const Three bent = sum(normal, scaled(larger(LEAST_TILT - dot(normal, to_viewer), 0.0f), to_viewer));
        return unit(sum(bent, scaled(larger(LEAST_TILT - dot(bent, facet), 0.0f), facet)));
    }

    // The normal that a texel of a normal map gives. ``side`` is -1 where the surface is seen from its back: the map's
    // frame is turned around as a whole.
    SHARED Three mapped_normal(
        const Three& normal, const Three& right, float sign, float side, const Texel& map, float scale
    ) {
        const Three front = scaled(side, normal);
        const Three tangent = unit(minus(right, scaled(dot(right, front), front)));
        if (!(dot(tangent, tangent) > 0.5f)) return normal;
        const Three up = scaled(sign, cross(front, tangent));
        Three tilted = scaled(scale * (2.0f * map.x - 1.0f), tangent);
        tilted = sum(tilted, scaled(scale * (2.0f * map.y - 1.0f), up));
        tilted = sum(tilted, scaled(2.0f * map.z - 1.0f, front));
        return dot(tilted, tilted) > 0.0f ? scaled(side, unit(tilted)) : normal;
    }
};
