// Packets in a tree that the cache does not hold: several go down it at once, a step each in turn, so that memory works
// for the others while one waits. Where few rays of a packet are left they stay with it: alone they would wait.

struct PacketsInTurn : RaysInTurn {
    // A packet on its way.
    struct PacketWalker {
        Packet packet;
        WaitingTogether stack[STACK];
        Rays* rays;
        int top, child, live;
        float farthest;
    };

    // Let a packet, which is made, begin at the root.
    SHARED void set_out(PacketWalker& walker, Rays& rays, int live) {
        walker.rays = &rays;
        walker.top = walker.child = 0;
        walker.live = live;
        walker.farthest = most(load(walker.packet.nearest));
    }

    SHARED void go_together_in_turn(const Tree& tree, PacketWalker* walkers, int count, bool any_hit) {
        int walking[EIGHTS];
        for (int k = 0; k < count; ++k) walking[k] = k;
        while (count) {
            for (int k = 0; k < count;) {
                PacketWalker& walker = walkers[walking[k]];
                if (take_step(tree, walker, any_hit)) {
                    fetch(tree, walker.child);
                    ++k;
                } else {
                    walking[k] = walking[--count];
                }
            }
        }
    }

    // Look at a node or a block; whether there is another.
    SHARED bool take_step(const Tree& tree, PacketWalker& walker, bool any_hit) {
        Rays& rays = *walker.rays;
        Packet& packet = walker.packet;
        if (walker.child < 0) {
            for (int rest = walker.live; rest; rest &= rest - 1) {
                const int ray = lowest_bit(rest);
                meet_block(tree, walker.child, rays, ray, any_hit);
                packet.nearest[ray] = any_hit && rays.record[ray] >= 0 ? -1.0f : rays.nearest[ray];
            }
            walker.farthest = most(load(packet.nearest));
        } else if (has_few(walker.live)) {
            push_children_of_few(tree, walker);
        } else {
            push_children(tree, packet, rays, walker.child, walker.live, walker.farthest, walker.stack, walker.top);
        }
        do {
            if (!walker.top) return false;
            const WaitingTogether& one = walker.stack[--walker.top];
            walker.live = one.entry > walker.farthest ? 0 : one.rays & bits(eight(one.entry) <= load(packet.nearest));
        } while (!walker.live);
        walker.child = walker.stack[walker.top].child;
        return true;
    }

    // Put the children of a node on the stack that any of one or two rays enters, the farthest first.
    SHARED void push_children_of_few(const Tree& tree, PacketWalker& walker) {
        const float* node = tree.nodes + (size_t)walker.child * NODE;
        const int* children = (const int*)(node + CHILDREN);
        const int first = lowest_bit(walker.live), rest = walker.live & (walker.live - 1);
        const int second = rest ? lowest_bit(rest) : first;
        Eight entry, other_entry;
        const int set = boxes_entered(node, *walker.rays, first, entry);
        ++walker.rays->steps[first];
        int other_set = 0;
        if (rest) {
            other_set = boxes_entered(node, *walker.rays, second, other_entry);
            ++walker.rays->steps[second];
            entry = chosen(lanes_of(other_set), chosen(lanes_of(set), lesser(entry, other_entry), other_entry), entry);
        }
        float t[LANES];
        store(t, entry);
        const int bottom = walker.top;
        for (int both = set | other_set; both; both &= both - 1) {
            const int box = lowest_bit(both);
            const int entering = (set >> box & 1) << first | (other_set >> box & 1) << second;
            const WaitingTogether one = {t[box], children[box], entering};
            int at = walker.top++;
            for (; at > bottom && walker.stack[at - 1].entry < one.entry; --at) walker.stack[at] = walker.stack[at - 1];
            walker.stack[at] = one;
        }
    }
};
