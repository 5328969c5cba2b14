// Surfaces where rays meet one object: as many at once as a vector has lanes (surfaces.py).
//
// Everything is as ``surface.py`` says: normals face the viewer, directions are of unit length.

struct Surfaces : Vectors {
    // What is read of an object.
    struct Object {
        const float* vertices;
        const double* exact_vertices;  // null but for meshes with outliers
        const float* normals;          // null where the facets' are taken
        const int* faces;
        const double* device_from_unit;  // 4 rows of 4
        const double* unit_from_device;
        const float* normal_from_unit;  // 3 rows of 3
    };

    struct Three { Wide x, y, z; };
    struct ThreeDouble { WideDouble x, y, z; };

    // Triangles, and points of them.
    struct Points {
        Three corner[3], corner_normal[3], weight;
        ThreeDouble position;
    };

    // A surface for each lane.
    struct Found {
        Three normal, facet;
        WideFlags is_back;
    };

    SHARED Wide dot(const Three& a, const Three& b) { FUSED return a.x * b.x + a.y * b.y + a.z * b.z; }
    SHARED Three cross(const Three& a, const Three& b) {
        FUSED
        return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    }
    SHARED Three minus(const Three& a, const Three& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    SHARED Three times(Wide s, const Three& a) { return {s * a.x, s * a.y, s * a.z}; }
    SHARED Three chosen_of(const WideFlags& is, const Three& a, const Three& b) {
        return {chosen(is, a.x, b.x), chosen(is, a.y, b.y), chosen(is, a.z, b.z)};
    }
    // Of unit length; 0 stays 0.
    SHARED Three unit(const Three& a) {
        const Wide square = dot(a, a);
        return times(chosen(square > wide(0.0f), wide(1.0f) / root(square), wide(0.0f)), a);
    }
    SHARED Three transformed(const float* matrix, const Three& a) {
        const float* m = matrix;
        return {
            dot({wide(m[0]), wide(m[1]), wide(m[2])}, a),
            dot({wide(m[3]), wide(m[4]), wide(m[5])}, a),
            dot({wide(m[6]), wide(m[7]), wide(m[8])}, a)
        };
    }
    // The mean of three corners by their weights.
    SHARED Three blended(const Three& weight, const Three* of) {
        return {
            dot(weight, {of[0].x, of[1].x, of[2].x}),
            dot(weight, {of[0].y, of[1].y, of[2].y}),
            dot(weight, {of[0].z, of[1].z, of[2].z})
        };
    }

    SHARED WideDouble dot(const ThreeDouble& a, const ThreeDouble& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
    SHARED ThreeDouble cross(const ThreeDouble& a, const ThreeDouble& b) {
        return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    }
    SHARED ThreeDouble minus(const ThreeDouble& a, const ThreeDouble& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    SHARED ThreeDouble doubled_of(const Three& a) { return {doubled(a.x), doubled(a.y), doubled(a.z)}; }
    SHARED Three single_of(const ThreeDouble& a) { return {single(a.x), single(a.y), single(a.z)}; }
    // The linear part of a matrix of 3 rows of 4, times a vector.
    SHARED ThreeDouble turned(const double* m, const ThreeDouble& a) {
        return {
            wide_double(m[0]) * a.x + wide_double(m[1]) * a.y + wide_double(m[2]) * a.z,
            wide_double(m[4]) * a.x + wide_double(m[5]) * a.y + wide_double(m[6]) * a.z,
            wide_double(m[8]) * a.x + wide_double(m[9]) * a.y + wide_double(m[10]) * a.z
        };
    }
    SHARED ThreeDouble moved(const double* m, const ThreeDouble& a) {
        const ThreeDouble b = turned(m, a);
        return {b.x + wide_double(m[3]), b.y + wide_double(m[7]), b.z + wide_double(m[11])};
    }

    // Look up the corners of triangles.
    SHARED void find_corners(const Object& object, const int* triangle, Points& made) {
        for (int i = 0; i < WIDE; ++i)
            for (int c = 0; c < 3; ++c) {
                const long long place = 3LL * object.faces[3LL * triangle[i] + c];
                const float* p = object.vertices + place;
                made.corner[c].x[i] = p[0];
                made.corner[c].y[i] = p[1];
                made.corner[c].z[i] = p[2];
                if (object.normals) {
                    const float* n = object.normals + place;
                    made.corner_normal[c].x[i] = n[0];
                    made.corner_normal[c].y[i] = n[1];
                    made.corner_normal[c].z[i] = n[2];
                }
            }
    }

    // A corner of each triangle in float64.
    SHARED ThreeDouble exact_corner(const Object& object, const int* triangle, const Points& of, int c) {
        ThreeDouble made = doubled_of(of.corner[c]);
        if (object.exact_vertices)
            for (int i = 0; i < WIDE; ++i) {
                const double* p = object.exact_vertices + 3LL * object.faces[3LL * triangle[i] + c];
                made.x[i] = p[0];
                made.y[i] = p[1];
                made.z[i] = p[2];
            }
        return made;
    }

    // The points at barycentrics ``u`` and ``v``.
    SHARED void place_at(const Object& object, Wide u, Wide v, Points& made) {
        made.weight = {wide(1.0f) - u - v, u, v};
        made.position = moved(object.device_from_unit, doubled_of(blended(made.weight, made.corner)));
    }

    // The points where rays from an eye in device space meet their triangles (Moeller and Trumbore 1997). What a ray
    // misses by rounding is put on the triangle's edge.
    SHARED void place_on_rays(
        const Object& object, const int* triangle, const double* eye, const ThreeDouble& ray, Points& made
    ) {
        const WideDouble zero = wide_double(0.0), one = wide_double(1.0);
        const ThreeDouble a = exact_corner(object, triangle, made, 0);
        const ThreeDouble ab = minus(exact_corner(object, triangle, made, 1), a);
        const ThreeDouble ac = minus(exact_corner(object, triangle, made, 2), a);
        const double* m = object.unit_from_device;
        double from[3];
        for (int row = 0; row < 3; ++row)
            from[row] = m[4 * row] * eye[0] + m[4 * row + 1] * eye[1] + m[4 * row + 2] * eye[2] + m[4 * row + 3];
        const ThreeDouble way = turned(m, ray);
        const ThreeDouble offset = minus({wide_double(from[0]), wide_double(from[1]), wide_double(from[2])}, a);
        const ThreeDouble p = cross(way, ac), q = cross(offset, ab);
        const WideDouble scale = one / dot(ab, p);
        WideDouble u = dot(offset, p) * scale, v = dot(way, q) * scale;
        u = chosen(u > zero, chosen(u < one, u, one), zero);  // 0 is no number's answer, too
        v = chosen(v > zero, chosen(v < one, v, one), zero);
        const WideDouble sum = u + v, within = chosen(sum > one, one / sum, one);
        u = u * within;
        v = v * within;
        made.weight = {single(one - u - v), single(u), single(v)};
        made.position = moved(
            object.device_from_unit,
            {a.x + u * ab.x + v * ac.x, a.y + u * ab.y + v * ac.y, a.z + u * ab.z + v * ac.z}
        );
    }

    // The normals of points that are seen along unit directions.
    SHARED Found normals_at(const Object& object, const Points& at, const Three& view) {
        const Wide zero = wide(0.0f);
        const Three across = cross(minus(at.corner[1], at.corner[0]), minus(at.corner[2], at.corner[0]));
        Three facet = transformed(object.normal_from_unit, unit(across));
        Found found;
        found.is_back = dot(facet, view) > zero;
        facet = chosen_of(found.is_back, {-facet.x, -facet.y, -facet.z}, facet);
        found.facet = found.normal = unit(facet);
        if (object.normals) {
            const Three mean = blended(at.weight, at.corner_normal);
            const Wide square = dot(mean, mean);
            Three normal = transformed(object.normal_from_unit, times(wide(1.0f) / root(square), mean));
            normal = chosen_of(dot(normal, facet) < zero, {-normal.x, -normal.y, -normal.z}, normal);
            const WideFlags is_known = (dot(normal, normal) > zero) & (square > wide(SMALLEST_NORMAL));
            found.normal = chosen_of(is_known, unit(normal), found.facet);
        }
        return found;
    }
};
