// Rays as the tree (tree.py) is searched for them: eight at a time, with all that the tests of boxes and records need.
//
// The search is a chain of classes, one a file, each derived from the one before, so that every file compiles alone:
//
//     rays.h          what travels: the tree, and eight rays made ready of those that are asked for (ray_query.h)
//     boxes.h         a ray against the eight boxes of a node
//     triangles.h     a ray against a block of eight triangles
//     patches.h       a ray against a block of eight patches; against a block of either kind
//     single_rays.h   one ray down the tree, the nearest child first
//     packets.h       rays that stay together: a node's boxes are tested against all of them at once
//     rays_in_turn.h  rays that do not, a step each, so that memory works for the others while one waits
//     packets_in_turn.h   packets, in the same way
//     walk.h          which of these a ray takes
//     answer.h        what a ray's record says of its hit
//
// Which way a ray takes changes no bit of its answer: the record alone decides where it is met, and of two records at
// one t the one that stands first in memory is taken.

struct TreeRays : RayQuery {
    enum {
        LANES = 8,
        NODE = TREE_NODE,          // floats of a node: per axis eight lows, then eight highs; then eight children
        CHILDREN = 6 * LANES,      // where the children begin
#if defined(__CUDA_ARCH__)
        BLOCK = 1,
#else
        BLOCK = RAY_BLOCK,         // rays that are searched for together
#endif
        EIGHTS = (BLOCK + LANES - 1) / LANES,
        STACK = TREE_STACK,        // children that may wait; no tree needs more (wide_tree.py)
    };

    // Where to look. A child is a node's number, or ~(2 * row + 1) of a block of patches, or ~(2 * row) of triangles.
    struct Tree {
        const float *nodes, *rows;
        const float *low, *high;  // the box about all records
        float half_patch;         // half the side of a patch
    };

    // Eight rays, a lane each.
    struct Rays {
        float origin[3][LANES], direction[3][LANES];
        float inverse[3][LANES], scaled[3][LANES];          // 1 / direction, and origin / direction
        float permuted_origin[3][LANES], shear[3][LANES];   // Woop's coordinates: the origin in the order of ``axis_row``
        float nearest[LANES];       // t of the nearest record so far; before there is one, the end of the ray
        const Query* queries;       // one for each lane
        double t_of_origin[LANES];  // how far ``origin`` lies from the origin that was asked for
        float u[LANES], v[LANES];   // barycentrics of the hit in its triangle
        int near_side[3][LANES];    // place of the sides that a ray enters boxes by, in a node; see ``far_side``
        int axis_row[3][LANES];     // place of a corner's coordinates in a block; last that of the direction's longest
        int record[LANES];          // the nearest record so far: LANES * row + lane, -1 for none
        int steps[LANES];           // nodes and blocks that were looked at
        bool record_is_patch[LANES];
    };

    // Make up to eight rays ready. Returns a bit for each that enters the box about all records. They may begin anywhere.
    SHARED int start(Rays& rays, const Tree& tree, const Query* queries, int count) {
        double origin64[LANES][3];
        float t_max[LANES];
        take_queries(rays, queries, count, origin64, t_max);
        Eight direction[3], inverse[3], enter;
        const int live = enter_the_box(rays, tree, t_max, direction, inverse, enter);
        if (!live) return 0;
        move_to_the_box(rays, live, origin64, t_max, enter);
        derive(rays, direction, inverse);
        return live;
    }

    // Eight rays from up to eight queries; lanes beyond those repeat the first, with an end that lets them meet nothing.
    SHARED void take_queries(Rays& rays, const Query* queries, int count, double (*origin64)[3], float* t_max) {
        for (int lane = 0; lane < LANES; ++lane) {
            const Query& query = queries[lane < count ? lane : 0];
            for (int k = 0; k < 3; ++k) {
                origin64[lane][k] = query.origin[k];
                rays.direction[k][lane] = query.direction[k];
            }
            rays.t_of_origin[lane] = is_near(origin64[lane]) ? 0.0 : come_near(origin64[lane], query.direction);
            t_max[lane] = lane < count ? (float)(query.t_max - rays.t_of_origin[lane]) : -1.0f;
            for (int k = 0; k < 3; ++k) rays.origin[k][lane] = (float)origin64[lane][k];
            rays.record[lane] = -1;
            rays.steps[lane] = 0;
        }
        rays.queries = queries;
    }

    // Slab tests: where rays enter the box about all records, and a bit for each that does. A ray that runs along planes
    // is taken to cross them slowly: it would reach them in 1e18 boxes.
    SHARED int enter_the_box(
        const Rays& rays, const Tree& tree, const float* t_max, Eight* direction, Eight* inverse, Eight& enter
    ) {
        const Eight none = eight(0.0f);
        Eight exit = load(t_max);
        enter = none;
        for (int k = 0; k < 3; ++k) {
            direction[k] = load(rays.direction[k]);
            const Eight least = chosen(direction[k] < none, eight(-NEGLIGIBLE), eight(NEGLIGIBLE));
            const EightFlags is_along = greater(direction[k], -direction[k]) < eight(NEGLIGIBLE);
            inverse[k] = eight(1.0f) / chosen(is_along, least, direction[k]);
            const Eight origin = load(rays.origin[k]);
            const Eight a = (eight(tree.low[k]) - origin) * inverse[k], b = (eight(tree.high[k]) - origin) * inverse[k];
            enter = greater(lesser(a, b), enter);
            exit = lesser(greater(a, b), exit);
        }
        return bits(enter <= exit + eight(BOX_SLACK) * enter);
    }

    // Move the origins of rays that begin outside the box to it, in float64. They stop before it by the rounding of
    // ``enter``.
    SHARED void move_to_the_box(
        Rays& rays, int live, const double (*origin64)[3], const float* t_max, const Eight& enter
    ) {
        float passed[LANES];
        store(passed, enter - eight(BOX_SLACK) * enter);
        store(rays.nearest, load(t_max) - load(passed));
        for (int rest = live & bits(enter > eight(0.0f)); rest; rest &= rest - 1) {
            const int lane = lowest_bit(rest);
            const double t = passed[lane];
            rays.t_of_origin[lane] += t;
            for (int k = 0; k < 3; ++k)
                rays.origin[k][lane] = (float)(origin64[lane][k] + t * (double)rays.direction[k][lane]);
        }
    }

    // What the tests of boxes and triangles need of a ray. Woop's third axis is the one along which it goes farthest.
    SHARED void derive(Rays& rays, const Eight* direction, const Eight* inverse) {
        const Eight x = greater(direction[0], -direction[0]), y = greater(direction[1], -direction[1]);
        const Eight z = greater(direction[2], -direction[2]);
        const EightFlags is_x = (x >= y) & (x >= z), is_y = y >= z;
        const Eight longest = chosen(is_x, direction[0], chosen(is_y, direction[1], direction[2]));
        const int longest_x = bits(is_x), longest_y = bits(is_y);
        for (int k = 0; k < 3; ++k) {
            const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;  // the axes after it
            const Eight across = chosen(is_x, direction[i], chosen(is_y, direction[j], direction[k]));
            store(rays.shear[k], (k == 2 ? eight(1.0f) : across) / longest);
            const Eight origin = load(rays.origin[k]);
            const Eight permuted = chosen(is_x, load(rays.origin[i]), chosen(is_y, load(rays.origin[j]), origin));
            store(rays.permuted_origin[k], permuted);
            store(rays.inverse[k], inverse[k]);
            store(rays.scaled[k], origin * inverse[k]);
            const int up = bits(inverse[k] > eight(0.0f));
            for (int lane = 0; lane < LANES; ++lane) {
                rays.near_side[k][lane] = LANES * (2 * k + 1 - (up >> lane & 1));
                rays.axis_row[k][lane] = LANES * (longest_x >> lane & 1 ? i : longest_y >> lane & 1 ? j : k);
            }
        }
    }

    // Whether float32 does for where a ray begins.
    SHARED bool is_near(const double* origin) {
        bool is = true;
        for (int k = 0; k < 3; ++k) is &= origin[k] <= NEAR && origin[k] >= -NEAR;
        return is;
    }

    // Move the origin of a ray to where it may come near the object. Returns how far that is along the ray.
    OUT_OF_LINE double come_near(double* origin, const float* direction) {
        double along = 0.0, square = 0.0;
        for (int k = 0; k < 3; ++k) {
            along -= origin[k] * direction[k];
            square += (double)direction[k] * direction[k];
        }
        const double passed = (along - NEAR * sqrt(square)) / square;
        if (!(passed > 0.0)) return 0.0;
        for (int k = 0; k < 3; ++k) origin[k] += passed * direction[k];
        return passed;
    }

    // Whether a record at t is nearer than the nearest so far; of two at one t it is the one that stands first.
    SHARED bool is_nearer(const Rays& rays, int ray, float t, int record) {
        return t < rays.nearest[ray] || (t == rays.nearest[ray] && record < rays.record[ray]);
    }
    SHARED void set_nearest(Rays& rays, int ray, float t, int record, bool is_patch) {
        rays.nearest[ray] = t;
        rays.record[ray] = record;
        rays.record_is_patch[ray] = is_patch;
    }

    // Have memory bring the node or the block that a ray will come to.
    SHARED void fetch(const Tree& tree, int child) {
#if !defined(PLAIN_VECTORS)
        const float* p = child >= 0 ? tree.nodes + (size_t)child * NODE : tree.rows + (size_t)(~child >> 1) * LANES;
        for (int line = 0; line < 4; ++line) __builtin_prefetch(p + 16 * line);
        if (child < 0) __builtin_prefetch(p + 16 * 4);
#endif
    }
};
