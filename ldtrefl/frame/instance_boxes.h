// What may be seen of an object, by the boxes over its clusters, from front to back (instances.py draws it).
//
// Bounds are found in floats. Pixels are counted from the one at the object's centre, which lies in front of the camera,
// and all bounds are widened by more than floats are off by. So nothing that may be seen is left out.

struct InstanceBoxes : Vectors {
    enum { BOX_FLOATS = 6 * CHILDREN };

    // An object as the camera sees it: a point p of unit space has the depth ``depth + z . p``, and lies
    // ``across + x . p / depth`` and ``down + y . p / depth`` pixels from the pixel that is counted from.
    struct View {
        float x[3], y[3], z[3];
        float across, down, depth;
        float error;  // pixels that floats are off by, at most
        float slack;  // pixels by which bounds are widened
    };

    // The z-buffer of a band, with the pixels that it has.
    struct Band {
        const long long* keys;  // of the pixel that is counted from, which may lie outside
        long long width;
        int first_x, last_x, first_y, last_y;
    };

    // The tree over the clusters of a mesh.
    struct Tree {
        const float* boxes;     // for each node of level 1 and above eight: low x, y, z and high x, y, z, eight each
        const int* first_node;  // of level 1, of level 2, ...
        int clusters;
    };

    // A box that may be seen, in pixels.
    struct Box {
        int level, number;  // level 0 are clusters
        float depth;
        int first_x, last_x, first_y, last_y;
        int nearest;  // bits of its largest 1 / depth; NO_BOUND if that has none
    };

    // The next cluster that may be seen, -1 if there is none. ``boxes`` are those left to look at, the next one last.
    SHARED int next_cluster(const Tree& tree, const View& view, const Band& band, Box* boxes, int& count) {
        while (count > 0) {
            const Box box = boxes[--count];
            if (is_hidden(band, box)) continue;
            if (box.level == 0) return box.number;
            push_children(tree, view, band, box, boxes, count);
        }
        return -1;
    }

    // Whether all pixels of a small box see something nearer already.
    SHARED bool is_hidden(const Band& band, const Box& box) {
        if ((box.last_x - box.first_x + 1) * (box.last_y - box.first_y + 1) > MOST_PIXELS) return false;
        for (int y = box.first_y; y <= box.last_y; ++y)
            for (int x = box.first_x; x <= box.last_x; ++x)
                if (nearness_at(band, x, y) <= box.nearest) return false;
        return true;
    }

    // Bits of 1 / depth of what a pixel sees.
    SHARED int nearness_at(const Band& band, int x, int y) { return (int)(band.keys[y * band.width + x] >> 32); }

    // Add the boxes inside a box that may be seen, the nearest last.
    SHARED void push_children(
        const Tree& tree, const View& view, const Band& band, const Box& parent, Box* boxes, int& count
    ) {
        FUSED
        const float* low = tree.boxes + (tree.first_node[parent.level - 1] + parent.number) * (long long)BOX_FLOATS;
        const Eight half = eight(0.5f), zero = eight(0.0f);
        Eight u = zero, v = zero, depth = eight(view.depth), centre[3], size[3];
        for (int k = 0; k < 3; ++k) {
            const Eight a = load(low + 8 * k), b = load(low + 24 + 8 * k);
            centre[k] = half * (a + b);
            size[k] = half * (b - a);
            u = u + eight(view.x[k]) * centre[k];
            v = v + eight(view.y[k]) * centre[k];
            depth = depth + eight(view.z[k]) * centre[k];
        }
        u = u / depth;
        v = v / depth;
        Eight reach_u = zero, reach_v = zero, deep = zero;
        for (int k = 0; k < 3; ++k) {
            reach_u = reach_u + magnitude(eight(view.x[k]) - u * eight(view.z[k])) * size[k];
            reach_v = reach_v + magnitude(eight(view.y[k]) - v * eight(view.z[k])) * size[k];
            deep = deep + magnitude(eight(view.z[k])) * size[k];
        }
        const Eight nearest = depth - deep;
        reach_u = reach_u / nearest + eight(view.slack);
        reach_v = reach_v / nearest + eight(view.slack);
        // What is not wholly in front of the camera may be anywhere.
        const EightFlags is_bounded = nearest > zero;
        const Eight middle_u = eight(view.across) + u, middle_v = eight(view.down) + v;
        const Eight first_x = first_pixel(is_bounded, middle_u - reach_u, band.first_x);
        const Eight last_x = last_pixel(is_bounded, middle_u + reach_u, band.last_x);
        const Eight first_y = first_pixel(is_bounded, middle_v - reach_v, band.first_y);
        const Eight last_y = last_pixel(is_bounded, middle_v + reach_v, band.last_y);
        const Eight nearness = eight(ROUNDED_UP) / nearest;

        const int base = count, first = CHILDREN * parent.number;
        int end = tree.clusters;
        if (parent.level > 1) end = tree.first_node[parent.level - 1] - tree.first_node[parent.level - 2];
        int seen = bits((first_x <= last_x) & (first_y <= last_y));
        if (end < first + CHILDREN) seen &= (1 << (end - first)) - 1;
        for (; seen; seen &= seen - 1) {
            const int k = lowest_bit(seen);
            const Box box = {
                parent.level - 1, first + k, depth[k], (int)first_x[k], (int)last_x[k], (int)first_y[k], (int)last_y[k],
                nearest[k] > 0.0f ? as_int(nearness[k]) : NO_BOUND
            };
            if (is_hidden(band, box)) continue;
            int place = count++;
            for (; place > base && boxes[place - 1].depth < box.depth; --place) boxes[place] = boxes[place - 1];
            boxes[place] = box;
        }
    }

    SHARED Eight magnitude(Eight a) { return greater(a, -a); }

    // The first pixel of a band whose centre does not lie before a bound, and the last one that does not lie after it.
    SHARED Eight first_pixel(EightFlags is_bounded, Eight bound, int first) {
        const Eight near_enough = greater(lesser(bound, eight(FARTHEST)), eight(-FARTHEST));
        return greater(chosen(is_bounded, -floor_of(eight(0.5f) - near_enough), eight((float)first)), eight((float)first));
    }
    SHARED Eight last_pixel(EightFlags is_bounded, Eight bound, int last) {
        const Eight near_enough = greater(lesser(bound, eight(FARTHEST)), eight(-FARTHEST));
        return lesser(chosen(is_bounded, floor_of(near_enough - eight(0.5f)), eight((float)last)), eight((float)last));
    }

    SHARED Eight floor_of(Eight a) {
        const Eight cut = truncated(a);
        return chosen(cut > a, cut - eight(1.0f), cut);
    }
};
