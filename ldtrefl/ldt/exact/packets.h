// Rays that stay together, such as reflections of neighbouring pixels: a node's boxes are tested against a packet of up
// to eight of them at once. Where few are left in a part of the tree, each of them goes on alone.

struct RayPackets : SingleRays {
    // Intervals that hold all rays of a packet: the bounds of 1 / direction, signed as their octant is, and of the
    // products by which near and far sides become t. Beside them the rays themselves, and up to where each looks: -1 if
    // it takes no part.
    struct Packet {
        Eight least_inverse[3], most_inverse[3], least_near[3], most_near[3], least_far[3], most_far[3];
        Eight inverse[3], scaled[3];
        int near_side[3];
        float nearest[LANES];
    };

    // The lanes whose bits are set.
    SHARED EightFlags lanes_of(int word) {
        float flags[LANES];
        for (int lane = 0; lane < LANES; ++lane) flags[lane] = (float)(word >> lane & 1);
        return load(flags) > eight(0.0f);
    }

    // Fill in a packet of the rays whose bits are set; false if they do not go into one octant, or are far apart.
    SHARED bool make_packet(Packet& packet, const Rays& rays, int live) {
        const int lead = lowest_bit(live);
        const EightFlags takes_part = lanes_of(live);
        for (int k = 0; k < 3; ++k) {
            // Those that take no part are given the numbers of the first that does.
            const Eight inverse = chosen(takes_part, load(rays.inverse[k]), eight(rays.inverse[k][lead]));
            const Eight origin = chosen(takes_part, load(rays.origin[k]), eight(rays.origin[k][lead]));
            const Eight direction = chosen(takes_part, load(rays.direction[k]), eight(rays.direction[k][lead]));
            const float sign = rays.inverse[k][lead] < 0.0f ? -1.0f : 1.0f;
            const Eight signed_inverse = eight(sign) * inverse, signed_origin = eight(sign) * origin;
            const float low = -most(-signed_inverse), high = most(signed_inverse);
            const float left = -most(-signed_origin), right = most(signed_origin);
            const float apart = most(direction) + most(-direction);
            if (low < 0.0f || right - left > PACKET_SPREAD || apart > PACKET_SPREAD) return false;
            packet.least_inverse[k] = eight(sign * low), packet.most_inverse[k] = eight(sign * high);
            packet.least_near[k] = eight(right * low), packet.most_near[k] = eight(right * high);
            packet.least_far[k] = eight(left * low), packet.most_far[k] = eight(left * high);
            packet.inverse[k] = inverse;
            packet.scaled[k] = origin * inverse;
            packet.near_side[k] = rays.near_side[k][lead];
        }
        store(packet.nearest, chosen(takes_part, load(rays.nearest), eight(-1.0f)));
        return true;
    }

    // Slab tests of intervals: a bit for each of a node's boxes that any ray of a packet may enter.
    SHARED int boxes_entered_by_any(const float* node, const Packet& p, float farthest, Eight& entry) {
        FUSED
        Eight in = eight(0.0f), out = eight(farthest);
        for (int k = 0; k < 3; ++k) {
            const Eight near = load(node + p.near_side[k]), far = load(node + far_side(p.near_side[k]));
            const Eight least = p.least_inverse[k], most = p.most_inverse[k];
            in = greater(lesser(near * least - p.least_near[k], near * most - p.most_near[k]), in);
            out = lesser(greater(far * least - p.least_far[k], far * most - p.most_far[k]), out);
        }
        entry = in;
        return bits(in <= out);
    }

    // Slab tests of the rays themselves: a bit for each ray of a packet that enters one box.
    SHARED int rays_that_enter(const float* node, int box, const Packet& p) {
        FUSED
        Eight in = eight(0.0f), out = load(p.nearest);
        for (int k = 0; k < 3; ++k) {
            in = greater(eight(node[p.near_side[k] + box]) * p.inverse[k] - p.scaled[k], in);
            out = lesser(eight(node[far_side(p.near_side[k]) + box]) * p.inverse[k] - p.scaled[k], out);
        }
        return bits(in <= out);
    }

    // A child that rays of a packet will come back to.
    struct WaitingTogether {
        float entry;     // where the first of them may enter it
        int child, rays; // a bit for each that does
    };

    SHARED void go_together(const Tree& tree, Packet& packet, Rays& rays, int live, bool any_hit) {
        WaitingTogether stack[STACK];
        int top = 0, child = 0;
        float farthest = most(load(packet.nearest));
        for (;;) {
            if (child >= 0 && !has_few(live)) {
                push_children(tree, packet, rays, child, live, farthest, stack, top);
            } else {
                for (; live; live &= live - 1) {
                    const int ray = lowest_bit(live);
                    if (child < 0) meet_block(tree, child, rays, ray, any_hit);
                    else find(tree, rays, ray, child, any_hit);
                    packet.nearest[ray] = any_hit && rays.record[ray] >= 0 ? -1.0f : rays.nearest[ray];
                }
                farthest = most(load(packet.nearest));
            }
            do {
                if (!top) return;
                const WaitingTogether& one = stack[--top];
                live = one.entry > farthest ? 0 : one.rays & bits(eight(one.entry) <= load(packet.nearest));
            } while (!live);
            child = stack[top].child;
        }
    }

    // Put the children of a node on the stack that any of the live rays enters, the farthest first.
    SHARED void push_children(
        const Tree& tree, const Packet& packet, Rays& rays, int number, int live, float farthest, WaitingTogether* stack,
        int& top
    ) {
        const float* node = tree.nodes + (size_t)number * NODE;
        const int* children = (const int*)(node + CHILDREN);
        Eight entry;
        int set = boxes_entered_by_any(node, packet, farthest, entry);
        ++rays.steps[lowest_bit(live)];
        float t[LANES];
        store(t, entry);
        const int bottom = top;
        for (; set; set &= set - 1) {
            const int box = lowest_bit(set);
            const int entering = rays_that_enter(node, box, packet) & live;
            if (!entering) continue;
            fetch(tree, children[box]);
            const WaitingTogether one = {t[box], children[box], entering};
            int at = top++;
            for (; at > bottom && stack[at - 1].entry < one.entry; --at) stack[at] = stack[at - 1];
            stack[at] = one;
        }
    }
};
