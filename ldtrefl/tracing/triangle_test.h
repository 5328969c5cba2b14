// A ray against a triangle in float64, watertight (bvh_walk.py).
//
// Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection": in coordinates in which the ray is the third axis
// the ray passes through a triangle if three areas, one at each edge, have one sign. A corner's coordinates depend on
// the ray and the corner alone, and every product is rounded by itself. So two triangles compute the same area at an edge
// that they share, but for the sign. A ray through the edge, or so near that the area is 0, meets both.

struct TriangleTest : Vectors {
    struct Line {
        double origin[3];
        double shear[3];  // direction / its longest component, for the two axes after that; 1 / that component
        int axes[3];      // the two axes after the longest component's, and that
    };

    // Where a line meets a triangle; u and v weigh its second and third corner.
    struct Meeting {
        double t, u, v;
    };

    SHARED Line line_of(const double* origin, const float* direction) {
        Line line;
        int longest = 0;
        for (int k = 0; k < 3; ++k) {
            line.origin[k] = origin[k];
            if (size(direction[k]) > size(direction[longest])) longest = k;
        }
        line.axes[2] = longest;
        line.axes[0] = longest == 2 ? 0 : longest + 1;
        line.axes[1] = longest == 0 ? 2 : longest - 1;
        line.shear[2] = 1.0 / (double)direction[longest];
        for (int k = 0; k < 2; ++k) line.shear[k] = (double)direction[line.axes[k]] * line.shear[2];
        return line;
    }

    SHARED float size(float x) { return x < 0.0f ? -x : x; }

    // Whether a line meets a triangle; where t is below 0, too.
    SHARED bool meet(const Line& line, const float* a, const float* b, const float* c, Meeting& met) {
        UNFUSED
        double ax, ay, az, bx, by, bz, cx, cy, cz;
        see(line, a, ax, ay, az);
        see(line, b, bx, by, bz);
        see(line, c, cx, cy, cz);
        const double u = product(cx, by) - product(cy, bx);
        const double v = product(ax, cy) - product(ay, cx);
        const double w = product(bx, ay) - product(by, ax);
        if (least(u, v, w) < 0.0 && most(u, v, w) > 0.0) return false;
        const double area = u + v + w;
        if (area == 0.0 || !has_area(a, b, c)) return false;
        // All three have one sign, so that what is met lies between the corners however they are rounded.
        const double per_area = 1.0 / area;
        met.t = (u * az + v * bz + w * cz) * per_area * line.shear[2];
        met.u = v * per_area;
        met.v = w * per_area;
        return true;
    }

    // The same for a triangle of a mesh, by its number.
    SHARED bool meet_numbered(const Line& line, const float* vertices, const int* faces, int triangle, Meeting& met) {
        const int* corners = faces + 3 * (size_t)triangle;
        return meet(
            line, vertices + 3 * (size_t)corners[0], vertices + 3 * (size_t)corners[1], vertices + 3 * (size_t)corners[2],
            met
        );
    }

    // A corner in the coordinates of a line: x and y across it, z along.
    SHARED void see(const Line& line, const float* corner, double& x, double& y, double& z) {
        UNFUSED
        const int i = line.axes[0], j = line.axes[1], k = line.axes[2];
        z = (double)corner[k] - line.origin[k];
        x = ((double)corner[i] - line.origin[i]) - product(line.shear[0], z);
        y = ((double)corner[j] - line.origin[j]) - product(line.shear[1], z);
    }

    SHARED double least(double a, double b, double c) { return a < b ? (a < c ? a : c) : (b < c ? b : c); }
    SHARED double most(double a, double b, double c) { return a > b ? (a > c ? a : c) : (b > c ? b : c); }

    // A product that is rounded before anything is added to it.
    SHARED double product(double a, double b) {
        UNFUSED
#if defined(__CUDA_ARCH__)
        return __dmul_rn(a, b);
#else
        return a * b;
#endif
    }

    // A triangle without area has no normal. Its neighbours are met in its place.
    SHARED bool has_area(const float* a, const float* b, const float* c) {
        UNFUSED
        bool has = false;
        for (int k = 0; k < 3; ++k) {
            const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
            const double one = product((double)b[i] - a[i], (double)c[j] - a[j]);
            has |= one != product((double)b[j] - a[j], (double)c[i] - a[i]);
        }
        return has;
    }
};
