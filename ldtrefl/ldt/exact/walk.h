// The search for up to a block of rays: those of each eight that stay together go as a packet, the others alone, or in
// turn if the tree is larger than the cache.

struct TreeWalk : PacketsInTurn {
    SHARED void search(const Tree& tree, Rays* rays, const Query* queries, int count, bool in_turn, bool any_hit) {
        int alone[BLOCK];
        int left = 0;
        Packet packet;
        PacketWalker walkers[EIGHTS];
        int walking = 0;
        for (int first = 0; first < count; first += LANES) {
            Rays& own = rays[first / LANES];
            const int live = start(own, tree, queries + first, count - first < LANES ? count - first : LANES);
            if (in_turn && !has_few(live) && make_packet(walkers[walking].packet, own, live)) {
                set_out(walkers[walking++], own, live);
            } else if (!in_turn && !has_few(live) && make_packet(packet, own, live)) {
                go_together(tree, packet, own, live, any_hit);
            } else {
                for (int rest = live; rest; rest &= rest - 1) alone[left++] = first + lowest_bit(rest);
            }
        }
        go_together_in_turn(tree, walkers, walking, any_hit);
        if (in_turn && left > 1) {
            go_in_turn(tree, rays, alone, left, any_hit);
        } else {
            for (int k = 0; k < left; ++k) find(tree, rays[alone[k] / LANES], alone[k] % LANES, 0, any_hit);
        }
    }
};
