// A ray down the tree of a ``wp.Bvh`` over triangles, the nearest child first (bvh_walk.py).

struct BvhWalk : TriangleTest {
    struct Mesh {
        WarpBvh tree;
        const float* vertices;
        const int* faces;
    };

    // A ray as boxes are tested against it.
    struct Slabs {
        float inverse[3], scaled[3];  // 1 / direction, and origin / direction
    };

    // The nearest triangle so far; -1 before there is one, and t is then the end of the ray.
    struct Nearest {
        Meeting met;
        int triangle;
    };

    // A node to come back to, and where its box is entered.
    struct Waiting {
        float entry;
        int node;
    };

    // The first triangle of a mesh that a ray meets at 0 <= t < end; with ``any_hit`` any of them. Of two at one t the
    // one with the lower number is first, whatever the tree.
    SHARED Nearest walk(const Mesh& mesh, const double* origin, const float* direction, double end, bool any_hit) {
        const Line line = line_of(origin, direction);
        const Slabs slabs = slabs_of(origin, direction);
        Nearest nearest = {{end, 0.0, 0.0}, -1};
        float farthest = (float)end;  // t of the nearest
        Waiting stack[WarpBvh::DEPTH];
        int top = 0;
        WarpBvh::Node node = mesh.tree.node(mesh.tree.root);
        for (;;) {
            if (node.is_leaf()) {
                meet_leaf(mesh, node.first(), node.second(), line, nearest);
                if (any_hit && nearest.triangle >= 0) return nearest;
                farthest = (float)nearest.met.t;
            } else {
                const WarpBvh::Node one = mesh.tree.node(node.first()), other = mesh.tree.node(node.second());
                float to_one, to_other;
                const bool enters_one = enters(one, slabs, farthest, to_one);
                const bool enters_other = enters(other, slabs, farthest, to_other);
                if (enters_one && enters_other) {
                    const bool one_is_near = to_one <= to_other;
                    stack[top].entry = one_is_near ? to_other : to_one;
                    stack[top++].node = one_is_near ? node.second() : node.first();
                    node = one_is_near ? one : other;
                    continue;
                }
                if (enters_one || enters_other) {
                    node = enters_one ? one : other;
                    continue;
                }
            }
            do {
                if (!top) return nearest;
                --top;
            } while (stack[top].entry > farthest);
            node = mesh.tree.node(stack[top].node);
        }
    }

    // Test the items of a leaf from number ``begin`` to before ``end``.
    SHARED void meet_leaf(const Mesh& mesh, int begin, int end, const Line& line, Nearest& nearest) {
        for (int i = begin; i < end; ++i) {
            const int triangle = mesh.tree.items[i];
            Meeting met;
            if (meet_numbered(line, mesh.vertices, mesh.faces, triangle, met)) keep_nearer(met, triangle, nearest);
        }
    }

    SHARED void keep_nearer(const Meeting& met, int triangle, Nearest& nearest) {
        const double t = nearest.met.t;
        if (!(met.t >= 0.0 && (met.t < t || (met.t == t && triangle < nearest.triangle)))) return;
        nearest.met = met;
        nearest.triangle = triangle;
    }

    // A ray that runs along planes is taken to cross them slowly: it would reach them in 1e18 boxes.
    SHARED Slabs slabs_of(const double* origin, const float* direction) {
        Slabs slabs;
        for (int k = 0; k < 3; ++k) {
            const float along = direction[k], least = along < 0.0f ? -NEGLIGIBLE : NEGLIGIBLE;
            slabs.inverse[k] = 1.0f / (size(along) < NEGLIGIBLE ? least : along);
            slabs.scaled[k] = (float)origin[k] * slabs.inverse[k];
        }
        return slabs;
    }

    // Slab test (Kay and Kajiya 1986): whether a ray enters a node's box before ``farthest``, and where. Boxes are wide
    // enough for all that is rounded here (``BOX_MARGIN``).
    SHARED bool enters(const WarpBvh::Node& node, const Slabs& slabs, float farthest, float& entry) {
        FUSED
        const float x = slabs.inverse[0], y = slabs.inverse[1], z = slabs.inverse[2];
        const float ax = node.low.x * x - slabs.scaled[0], bx = node.high.x * x - slabs.scaled[0];
        const float ay = node.low.y * y - slabs.scaled[1], by = node.high.y * y - slabs.scaled[1];
        const float az = node.low.z * z - slabs.scaled[2], bz = node.high.z * z - slabs.scaled[2];
        entry = greater(greater(lesser(ax, bx), lesser(ay, by)), greater(lesser(az, bz), 0.0f));
        const float exit = lesser(lesser(greater(ax, bx), greater(ay, by)), greater(az, bz));
        return entry <= lesser(exit, farthest);
    }
};
