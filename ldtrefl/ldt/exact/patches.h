// A ray against a block of eight patches (tree.py), and against a block of either kind.

struct TreePatches : TreeTriangles {
    // A patch is met where the ray crosses its plane over its texel.
    SHARED bool meet_patches(const float* rows, int row, Rays& rays, int ray, float half_patch) {
        FUSED
        const float* r = rows + (size_t)row * LANES;
        const Eight ox = eight(rays.origin[0][ray]), oy = eight(rays.origin[1][ray]), oz = eight(rays.origin[2][ray]);
        const float* direction[3] = {rays.direction[0] + ray, rays.direction[1] + ray, rays.direction[2] + ray};
        const Eight dx = eight(*direction[0]), dy = eight(*direction[1]), dz = eight(*direction[2]);
        const Eight nx = load(r), ny = load(r + LANES), nz = load(r + 2 * LANES);
        const Eight slope = nx * dx + ny * dy + nz * dz;
        const Eight height = load(r + 3 * LANES) - (nx * ox + ny * oy + nz * oz);
        const Eight t = height / slope;
        const Eight x = ox + t * dx, y = oy + t * dy, z = oz + t * dz;
        // In the map of an axis u is the next coordinate, and v the one after.
        const Eight axis = load(r + PATCH_AXIS_ROW * LANES);
        const EightFlags is_x = axis < eight(1.0f), is_y = axis < eight(2.0f);
        const Eight u = chosen(is_x, y, chosen(is_y, z, x)) - load(r + 4 * LANES);
        const Eight v = chosen(is_x, z, chosen(is_y, x, y)) - load(r + 5 * LANES);
        const Eight from_middle = greater(greater(u, -u), greater(v, -v));
        // Where a patch is seen edge on, to float32's rounding, t says nothing.
        const EightFlags is_met = (from_middle <= eight(half_patch)) & (t >= eight(0.0f))
            & (t <= eight(rays.nearest[ray])) & (slope * slope > eight(EDGE_ON * EDGE_ON));
        ++rays.steps[ray];
        int lanes = bits(is_met);
        if (!lanes) return false;
        float t_of_lane[LANES];
        store(t_of_lane, t);
        for (; lanes; lanes &= lanes - 1) {
            const int lane = lowest_bit(lanes), record = LANES * row + lane;
            if (is_nearer(rays, ray, t_of_lane[lane], record)) set_nearest(rays, ray, t_of_lane[lane], record, true);
        }
        return true;
    }

    // Test a ray against the block that a child names. With ``any_hit`` whichever record it meets will do.
    SHARED bool meet_block(const Tree& tree, int child, Rays& rays, int ray, bool any_hit) {
        const int row = ~child >> 1;
        if (~child & 1) return meet_patches(tree.rows, row, rays, ray, tree.half_patch);
        return meet_triangles(tree.rows, row, rays, ray, any_hit);
    }
};
