// Rays that do not stay together, in a tree that the cache does not hold: several go down it at once, a step each in
// turn, so that memory works for the others while one waits.

struct RaysInTurn : RayPackets {
    enum {
        AT_ONCE = BLOCK < 8 ? BLOCK : 8,  // rays that are on their way together
    };

    // A ray on its way.
    struct Walker {
        Waiting stack[STACK];
        int top, child;
        Rays* rays;
        int ray;
    };

    // Search for ``count`` rays, which are listed by LANES * (number of their eight) + lane.
    SHARED void go_in_turn(const Tree& tree, Rays* rays, const int* listed, int count, bool any_hit) {
        Walker walkers[AT_ONCE];
        int next = 0, walking = 0;
        for (; walking < AT_ONCE && next < count; ++walking) set_out(walkers[walking], rays, listed[next++]);
        while (walking) {
            for (int k = 0; k < walking; ++k) {
                Walker& walker = walkers[k];
                const bool is_done = take_step(tree, walker, any_hit);
                if (is_done && next < count) {
                    set_out(walker, rays, listed[next++]);
                } else if (is_done) {
                    // The last walker takes this one's place.
                    if (k < --walking) walker = walkers[walking];
                    --k;
                    continue;
                }
                fetch(tree, walker.child);
            }
        }
    }

    // Look at a node or a block; whether the ray's search is over.
    SHARED bool take_step(const Tree& tree, Walker& walker, bool any_hit) {
        Rays& own = *walker.rays;
        const int ray = walker.ray;
        bool is_done = false, goes_down = false;
        if (walker.child >= 0) {
            const float* node = tree.nodes + (size_t)walker.child * NODE;
            Eight entry;
            const int set = boxes_entered(node, own, ray, entry);
            ++own.steps[ray];
            goes_down = set != 0;
            if (set) walker.child = next_child(tree, node, entry, set, walker.stack, walker.top, any_hit);
        } else {
            is_done = meet_block(tree, walker.child, own, ray, any_hit) && any_hit;
        }
        if (!is_done && !goes_down) is_done = !come_back(own.nearest[ray], walker.stack, walker.top, walker.child);
        return is_done;
    }

    SHARED void set_out(Walker& walker, Rays* rays, int number) {
        walker.rays = rays + number / LANES;
        walker.ray = number % LANES;
        walker.top = walker.child = 0;
    }
};
