// One ray down the tree, the nearest child first; in whatever order if any hit will do.

struct SingleRays : TreePatches {
    // A child to come back to: where its box is entered, above its number. Entries are not negative, so they compare as
    // their bits do.
    typedef unsigned long long Waiting;
    SHARED Waiting waiting(const float* entry, const int* children, int lane) {
        return (Waiting)(unsigned)as_int(entry[lane]) << 32 | (unsigned)children[lane];
    }
    SHARED void put_in_order(Waiting& far, Waiting& near) {
        const Waiting a = far, b = near;
        far = a < b ? b : a;
        near = a < b ? a : b;
    }

    // The nearest of the children whose bits are set. The others go on the stack, the farthest first.
    SHARED int nearest_child(const Tree& tree, const float* node, const Eight& entry, int set, Waiting* stack, int& top) {
        const int* children = (const int*)(node + CHILDREN);
        float t[LANES];
        int lane = lowest_bit(set);
        set &= set - 1;
        if (!set) return children[lane];
        store(t, entry);
        fetch(tree, children[lane]);
        Waiting a = waiting(t, children, lane);
        lane = lowest_bit(set), set &= set - 1;
        fetch(tree, children[lane]);
        Waiting b = waiting(t, children, lane);
        put_in_order(a, b);
        stack[top++] = a;
        if (!set) return (int)b;
        lane = lowest_bit(set), set &= set - 1;
        Waiting c = waiting(t, children, lane);
        put_in_order(b, c);
        put_in_order(a, b);
        stack[top - 1] = a;
        stack[top++] = b;
        if (!set) return (int)c;
        // Four and more are rare: they are sorted by insertion.
        const int bottom = top - 2;
        stack[top++] = c;
        for (; set; set &= set - 1) {
            const Waiting one = waiting(t, children, lowest_bit(set));
            int at = top++;
            for (; at > bottom && stack[at - 1] < one; --at) stack[at] = stack[at - 1];
            stack[at] = one;
        }
        return (int)stack[--top];
    }

    // The first of the children whose bits are set. The others go on the stack, as if they were entered at 0.
    SHARED int any_child(const float* node, int set, Waiting* stack, int& top) {
        const int* children = (const int*)(node + CHILDREN);
        int child = children[lowest_bit(set)];
        for (set &= set - 1; set; set &= set - 1) {
            stack[top++] = (unsigned)child;
            child = children[lowest_bit(set)];
        }
        return child;
    }

    SHARED int next_child(
        const Tree& tree, const float* node, const Eight& entry, int set, Waiting* stack, int& top, bool any_hit
    ) {
        return any_hit ? any_child(node, set, stack, top) : nearest_child(tree, node, entry, set, stack, top);
    }

    // Take a child from the stack that is entered before the nearest record so far; false if there is none.
    SHARED bool come_back(float nearest, const Waiting* stack, int& top, int& child) {
        while (top) {
            const Waiting one = stack[--top];
            if ((unsigned)(one >> 32) <= (unsigned)as_int(nearest)) {
                child = (int)one;
                return true;
            }
        }
        return false;
    }

    SHARED void go_alone(const Tree& tree, Rays& rays, int ray, int child, bool any_hit) {
        Waiting stack[STACK];
        int top = 0;
        do {
            while (child >= 0) {
                const float* node = tree.nodes + (size_t)child * NODE;
                Eight entry;
                const int set = boxes_entered(node, rays, ray, entry);
                ++rays.steps[ray];
                if (!set) break;
                child = next_child(tree, node, entry, set, stack, top, any_hit);
            }
            if (child < 0 && meet_block(tree, child, rays, ray, any_hit) && any_hit) return;
        } while (come_back(rays.nearest[ray], stack, top, child));
    }

    // From a child on. The two kinds of search are compiled once each, so that neither asks at every step which it is.
    OUT_OF_LINE void find_nearest(const Tree& tree, Rays& rays, int ray, int child) {
        go_alone(tree, rays, ray, child, false);
    }
    OUT_OF_LINE void find_any(const Tree& tree, Rays& rays, int ray, int child) {
        go_alone(tree, rays, ray, child, true);
    }
    SHARED void find(const Tree& tree, Rays& rays, int ray, int child, bool any_hit) {
        if (any_hit) find_any(tree, rays, ray, child);
        else find_nearest(tree, rays, ray, child);
    }
};
