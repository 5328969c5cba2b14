// What a look makes of a surface: normals that are mapped, and how much layers reflect (finish.py, which says where the
// formulas are from). Pictures are read as pictures.h says.

struct Finishes : Pictures {
    struct Three { float x, y, z; };

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
    SHARED float largest(const Three& a) { return larger(larger(a.x, a.y), a.z); }

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

    // The table's entry for a cosine with the way to the viewer and a roughness, blended from four.
    APART Shares shares_at(const float* table, float cosine, float roughness) {
        const float x = sqrtf(clamped(cosine, 0.0f, 1.0f)) * (float)(TABLE_COLUMNS - 1);
        const float y = clamped(roughness, 0.0f, 1.0f) * (float)(TABLE_ROWS - 1);
        const int column = (int)smaller(x, (float)(TABLE_COLUMNS - 2)), row = (int)smaller(y, (float)(TABLE_ROWS - 2));
        const float right = x - (float)column, down = y - (float)row;
        const float* upper = table + 3 * (TABLE_COLUMNS * row + column);
        const float* lower = upper + 3 * TABLE_COLUMNS;
        float made[3];
        for (int i = 0; i < 3; ++i) {
            const float above = (1.0f - right) * upper[i] + right * upper[3 + i];
            made[i] = (1.0f - down) * above + down * ((1.0f - right) * lower[i] + right * lower[3 + i]);
        }
        if (row == 0) {  // of the smooth surface the closed form is known
            const float far = 1.0f - clamped(cosine, 0.0f, 1.0f), grazing = far * far * far * far * far;
            made[0] = (1.0f - down) * (1.0f - grazing) + down * ((1.0f - right) * lower[0] + right * lower[3]);
            made[1] = (1.0f - down) * grazing + down * ((1.0f - right) * lower[1] + right * lower[4]);
        }
        return {made[0], made[1], made[2]};
    }

    // What microfacets reflect more than once, as a factor on what they reflect once (Turquin 2019, equation 16).
    SHARED Three again(const Three& low, const Shares& of) {
        const float lost = 1.0f / larger(of.low + of.high, LEAST_SHARE) - 1.0f;
        return {1.0f + low.x * lost, 1.0f + low.y * lost, 1.0f + low.z * lost};
    }

    APART Layer layer_of(const Three& low, const Three& high, const Shares& of) {
        const Three factor = again(low, of);
        return {product(low, factor), product(high, factor)};
    }

    // How much a layer reflects in all.
    SHARED Three reflected(const Layer& by, const Shares& of) {
        return sum(scaled(of.low, by.low), scaled(of.high, by.high));
    }

    // How much of the light that passes is stopped, by alpha.
    SHARED float covered(int mode, float cutoff, float alpha) {
        if (mode == MASK) return alpha >= cutoff ? 1.0f : 0.0f;
        return mode == BLEND ? clamped(alpha, 0.0f, 1.0f) : 1.0f;
    }

    // How a surface reflects and scatters, its textures counted in.
    struct Model {
        Three base, emission, specular_color, mirror;
        float metallic, roughness, dielectric, specular, clearcoat, coat_roughness;
        int has_mirror, has_fresnel, is_unlit;
        float threshold, rough_limit;  // from which reflectance, and up to which roughness, rays are sent
    };

    // What it makes of light.
    struct Layers {
        Three diffuse, emission, low, high, coat_low, coat_high;
        Three mirror;            // what rays are sent for
        Three haze, coat_haze;   // what is reflected of the environment in place of rays
        float cosine, coat_cosine;  // by which these blur
        int is_by_coat;          // 1 if rays are mirrored at the varnish
        int rays;                // which layers they are sent for: 1 the base, 2 the varnish, or both
        Three behind;            // what is seen of the environment behind it in place of rays
        int goes_through;        // 1 if rays go straight on
    };

    SHARED Three grey(float a) { return {a, a, a}; }

    // What the base reflects and scatters: a metal, a dielectric or both, or the mirror that the scene makes of it.
    APART void lay_base(const Model& model, const Shares& shares, Layers& made) {
        Layer layer;
        made.diffuse = model.base;
        made.emission = model.emission;
        if (model.is_unlit) {
            layer = {grey(0.0f), grey(0.0f)};
            made.emission = sum(model.emission, model.base);
            made.diffuse = grey(0.0f);
        } else if (model.has_mirror) {
            layer = layer_of(model.mirror, model.has_fresnel ? grey(1.0f) : model.mirror, shares);
        } else {
            const Three tinted = scaled(model.dielectric, model.specular_color);
            const Three low = {smaller(tinted.x, 1.0f), smaller(tinted.y, 1.0f), smaller(tinted.z, 1.0f)};
            const Layer dielectric = layer_of(scaled(model.specular, low), grey(model.specular), shares);
            const Layer metal = layer_of(model.base, grey(1.0f), shares);
            layer.low = mixed(model.metallic, dielectric.low, metal.low);
            layer.high = mixed(model.metallic, dielectric.high, metal.high);
            const float scattered = 1.0f - largest(reflected(dielectric, shares));
            made.diffuse = scaled((1.0f - model.metallic) * scattered, model.base);
        }
        made.low = layer.low;
        made.high = layer.high;
    }

    // A varnish reflects first, and lets through what is left; how much it reflects.
    APART float lay_coat(const Model& model, const Shares& shares, Layers& made) {
        const Layer coat = layer_of(grey(COAT * model.clearcoat), grey(model.clearcoat), shares);
        const float reflects = reflected(coat, shares).x, left = 1.0f - reflects;
        made.diffuse = scaled(left, made.diffuse);
        made.emission = scaled(left, made.emission);
        made.low = scaled(left, made.low);
        made.high = scaled(left, made.high);
        made.coat_low = coat.low;
        made.coat_high = coat.high;
        return reflects;
    }

    // All of it, for cosines of the base's normal and of the varnish's with the way to the viewer. Rays are sent for what
    // reflects much and sharply; what is left shows the environment.
    APART void lay(const Model& model, const float* table, float cosine, float coat_cosine, Layers& made) {
        const Shares shares = shares_at(table, cosine, model.roughness);
        lay_base(model, shares, made);
        made.cosine = shares.cosine;
        float coat = 0.0f;
        made.coat_low = made.coat_high = grey(0.0f);
        made.coat_cosine = 1.0f;
        if (model.clearcoat > 0.0f && !model.is_unlit) {
            const Shares of_coat = shares_at(table, coat_cosine, model.coat_roughness);
            made.coat_cosine = of_coat.cosine;
            coat = lay_coat(model, of_coat, made);
        }
        const Three base = reflected({made.low, made.high}, shares);
        const float most = largest(base);
        const bool sends =
            most > 0.0f && model.roughness <= model.rough_limit && (model.has_mirror || most >= model.threshold);
        const bool coat_sends = coat > 0.0f && model.coat_roughness <= model.rough_limit && coat >= model.threshold;
        made.mirror = sum(sends ? base : grey(0.0f), grey(coat_sends ? coat : 0.0f));
        made.haze = sends ? grey(0.0f) : base;
        made.coat_haze = grey(coat_sends ? 0.0f : coat);
        made.is_by_coat = coat_sends && (!sends || coat > most);
        made.rays = (int)sends | (int)coat_sends << 1;
        made.behind = grey(0.0f);
        made.goes_through = 0;
    }

    // What a surface of this coverage, below 1, lets through. A ray goes on along the heavier of its two ways, and the
    // environment stands for the other.
    APART void let_through(float coverage, Layers& of) {
        Three* const parts[] = {
            &of.diffuse, &of.emission, &of.low, &of.high, &of.coat_low, &of.coat_high, &of.mirror, &of.haze, &of.coat_haze
        };
        for (Three* part : parts) *part = scaled(coverage, *part);
        const float through = 1.0f - coverage;
        of.goes_through = through >= largest(of.mirror);
        if (of.goes_through) {
            (of.is_by_coat ? of.coat_haze : of.haze) = sum(of.is_by_coat ? of.coat_haze : of.haze, of.mirror);
            of.mirror = grey(through);
            of.rays = 0;
        } else {
            of.behind = grey(through);
        }
    }

    // An environment of two colours, or of a picture in longitude and latitude and its rough ones.
    struct Environment {
        Three up, sky, ground;
        Picture sharp;  // of no width without one
        float turn, strength;  // of the picture, as LightingRecord has them
        const float* rough;
        int levels, rows, columns;
    };

    // Where such a picture has a unit direction, as environment.py has it.
    SHARED void place_in_picture(const Environment& of, const Three& direction, float height, float& u, float& v) {
        const float x_of_up = of.up.x < 0.0f ? -of.up.x : of.up.x;
        const Three reference = x_of_up > NEAR_X ? Three{0.0f, 1.0f, 0.0f} : Three{1.0f, 0.0f, 0.0f};
        const Three ahead = unit(minus(reference, scaled(dot(reference, of.up), of.up)));
        u = 0.5f - atan2f(dot(direction, cross(of.up, ahead)), dot(direction, ahead)) * (0.5f / PI) + of.turn;
        v = acosf(clamped(height, -1.0f, 1.0f)) * (1.0f / PI);
    }

    // What a rough surface shows about a mirrored unit direction, as a mean. Of two colours the mean cosine by which it
    // blurs says all; of pictures two are blended.
    APART Three hazy(const Environment& of, const Three& direction, float roughness, float cosine) {
        const float height = dot(direction, of.up);
        if (of.sharp.width == 0) return mixed(0.5f + 0.5f * cosine * height, of.ground, of.sky);
        float u, v;
        place_in_picture(of, direction, height, u, v);
        const float at = roughness * (float)of.levels;
        const int level = at < (float)of.levels ? (int)at : of.levels - 1;
        Three total = {0.0f, 0.0f, 0.0f};
        for (int side = 0; side < 2; ++side) {
            Picture one = of.sharp;
            if (level + side > 0) {
                one.width = of.columns;
                one.height = of.rows;
                one.stored = LINEAR_FLOATS;
                one.floats = of.rough + 3LL * of.rows * of.columns * (level + side - 1);
            }
            const Texel found = sample(one, u, v);
            total = sum(total, scaled(side ? at - (float)level : 1.0f - (at - (float)level), {found.x, found.y, found.z}));
        }
        return scaled(of.strength, total);
    }

    // The direction in which a normal mirrors a ray along ``view``, not below the facet.
    SHARED Three mirrored(const Three& view, const Three& normal, const Three& facet) {
        const Three leaving = minus(view, scaled(2.0f * dot(view, normal), normal));
        return unit(sum(leaving, scaled(larger(-dot(leaving, facet), 0.0f), facet)));
    }
};
