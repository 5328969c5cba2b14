// A ray against the eight boxes of a node (rays.h shows where this file stands in the search).

struct TreeBoxes : TreeRays {
    // Slab tests: a bit for each box that a ray enters before the nearest record so far; ``entry`` is where.
    SHARED int boxes_entered(const float* node, const Rays& rays, int ray, Eight& entry) {
        FUSED
        Eight in[3], out[3];
        for (int k = 0; k < 3; ++k) {
            const Eight inverse = eight(rays.inverse[k][ray]), scaled = eight(rays.scaled[k][ray]);
            in[k] = load(node + rays.near_side[k][ray]) * inverse - scaled;
            out[k] = load(node + far_side(rays.near_side[k][ray])) * inverse - scaled;
        }
        entry = greater(greater(in[0], in[1]), greater(in[2], eight(0.0f)));
        const Eight exit = lesser(lesser(out[0], out[1]), lesser(out[2], eight(rays.nearest[ray])));
        return bits(entry <= exit);
    }

    // Lows and highs of an axis stand one after the other: the far side is the other of the pair.
    SHARED int far_side(int near_side) { return near_side ^ LANES; }
};
