// Building a binary tree over boxes (binary_tree.py): they are split in two, over and over, where the surface area
// heuristic says.

struct BinaryTree : Vectors {
    enum {
        LANES = 8,
        BINS = 16,     // along each axis, between which splits are looked for
        FEW_BINS = 8,  // and as many where there are few references
        FEW = 32,      // references up to which those do
        DEEPEST = 48,  // splits from which halves are taken, whatever the heuristic says
        TASKS = 64,    // that may wait: of each split the larger part waits, so what is split halves each time
    };

    struct Box {
        Four low, high;
    };

    // The box about one record, or about several. low[3]: the bits of their number; high[3]: how many records there are.
    struct Reference {
        Four low, high;
    };

    // The box about a part of the tree. The bits of low[3] and high[3] are the numbers of its two parts; of a leaf the
    // number of its first reference, and ~count.
    struct Node {
        Four low, high;
    };

    SHARED bool is_leaf(const Node& node) { return as_int(node.high[3]) < 0; }

    SHARED Box nothing() { return {four(EMPTY), four(-EMPTY)}; }
    SHARED void add(Box& box, const Four& low, const Four& high) {
        box.low = lesser(box.low, low);
        box.high = greater(box.high, high);
    }
    SHARED Box box_of(const Reference* references, int count) {
        Box box = nothing();
        for (int i = 0; i < count; ++i) add(box, references[i].low, references[i].high);
        return box;
    }
    // The box about twice the middles of references: a sum saves the product.
    SHARED Box middles_of(const Reference* references, int count) {
        Box box = nothing();
        for (int i = 0; i < count; ++i) {
            const Four middle = references[i].low + references[i].high;
            add(box, middle, middle);
        }
        return box;
    }

    SHARED float half_area(const Four& low, const Four& high) {
        const Four side = high - low;
        return side[0] * (side[1] + side[2]) + side[1] * side[2];
    }

    // Half the areas of three boxes.
    SHARED Four half_areas(const Box* boxes) {
#if defined(PLAIN_VECTORS)
        Four areas = four(0.0f);
        for (int k = 0; k < 3; ++k) areas[k] = half_area(boxes[k].low, boxes[k].high);
        return areas;
#else
        const Four a = boxes[0].high - boxes[0].low, b = boxes[1].high - boxes[1].low, c = boxes[2].high - boxes[2].low;
        const Four ab = __builtin_shufflevector(a, b, 0, 4, 1, 5), ab_z = __builtin_shufflevector(a, b, 2, 6, 2, 6);
        const Four x = __builtin_shufflevector(ab, c, 0, 1, 4, 4), y = __builtin_shufflevector(ab, c, 2, 3, 5, 5);
        const Four z = __builtin_shufflevector(ab_z, c, 0, 1, 6, 6);
        return x * (y + z) + y * z;
#endif
    }

    // Blocks that so many records fill.
    SHARED Four blocks(const Four& records) { return truncated((records + four(LANES - 1.0f)) * four(1.0f / LANES)); }

    // Where to split, and the boxes about what lies on either side. A reference lies in a bin along each axis, by
    // scale * (twice its middle - origin).
    struct Split {
        Four origin, scale;
        int axis, bin;
        Box left, right;
    };

    SHARED void find_bins(const Reference& one, const Split& split, int* bins) {
        const Four place = (one.low + one.high - split.origin) * split.scale;
        for (int k = 0; k < 3; ++k) bins[k] = (int)place[k];
    }

    typedef float Counts[4];  // of records along x, y and z; Warp's macro ``float(x)`` allows no pointer to it in place

    // The boxes about the references in each bin along each axis, and how many records they hold.
    SHARED void fill_bins(
        const Reference* references, int count, const Split& split, int bins, Box (*boxes)[3], Counts* records
    ) {
        for (int b = 0; b < bins; ++b)
            for (int k = 0; k < 3; ++k) {
                boxes[b][k] = nothing();
                records[b][k] = 0.0f;
            }
        for (int i = 0; i < count; ++i) {
            const Reference& one = references[i];
            int own[4];
            find_bins(one, split, own);
            for (int k = 0; k < 3; ++k) {
                add(boxes[own[k]][k], one.low, one.high);
                records[own[k]][k] += one.high[3];
            }
        }
    }

    // The binned surface area heuristic (Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies"):
    // the cost of a part is its area times the blocks that its records fill, which fills blocks. False if no split parts
    // the references.
    SHARED bool find_split(const Reference* references, int count, const Box& middles, Split& split) {
        const int bins = count > FEW ? BINS : FEW_BINS;
        const Four extent = middles.high - middles.low;
        split.origin = middles.low;
        split.scale = four(0.999f * bins) / greater(extent, four(SHORTEST));
        Box boxes[BINS][3];
        Counts records[BINS];
        fill_bins(references, count, split, bins, boxes, records);

        // The parts after each bin, then those before it, for the three axes at once.
        Four cost_after[BINS], records_after[BINS];
        Box part[3] = {nothing(), nothing(), nothing()};
        Four sum = four(0.0f);
        for (int b = bins - 1; b > 0; --b) {
            for (int k = 0; k < 3; ++k) add(part[k], boxes[b][k].low, boxes[b][k].high);
            sum = sum + Four{records[b][0], records[b][1], records[b][2], 0.0f};
            records_after[b] = sum;
            cost_after[b] = half_areas(part) * blocks(sum);
        }
        Four least = four(EMPTY), best = four(0.0f);
        for (int k = 0; k < 3; ++k) part[k] = nothing();
        sum = four(0.0f);
        for (int b = 1; b < bins; ++b) {
            for (int k = 0; k < 3; ++k) add(part[k], boxes[b - 1][k].low, boxes[b - 1][k].high);
            sum = sum + Four{records[b - 1][0], records[b - 1][1], records[b - 1][2], 0.0f};
            const Four cost = half_areas(part) * blocks(sum) + cost_after[b];
            const FourFlags is_better = (sum > four(0.0f)) & (records_after[b] > four(0.0f)) & (cost < least);
            least = chosen(is_better, cost, least);
            best = chosen(is_better, four((float)b), best);
        }
        split.axis = least[0] <= least[1] && least[0] <= least[2] ? 0 : least[1] <= least[2] ? 1 : 2;
        split.bin = (int)best[split.axis];
        split.left = split.right = nothing();
        for (int b = 0; b < bins; ++b) {
            const Box& one = boxes[b][split.axis];
            add(b < split.bin ? split.left : split.right, one.low, one.high);
        }
        return split.bin > 0;
    }

    // References that are yet to be split: where they stand, their boxes, and the node that they become.
    struct Task {
        Box box, middles;
        int first, count, node, depth;
    };

    // Part references where the heuristic says: what lies before the split comes first.
    SHARED void part_at(Reference* references, const Split& split, Task& left, Task& right, int count) {
        left.middles = right.middles = nothing();
        left.box = split.left;
        right.box = split.right;
        int begin = 0, end = count;
        while (begin < end) {
            const Reference one = references[begin];
            const Four middle = one.low + one.high;
            int bins[4];
            find_bins(one, split, bins);
            if (bins[split.axis] < split.bin) {
                add(left.middles, middle, middle);
                ++begin;
            } else {
                add(right.middles, middle, middle);
                references[begin] = references[--end];
                references[end] = one;
            }
        }
        left.count = begin;
    }

    // Part references after the first ``begin``, as they stand.
    SHARED void part_after(const Reference* references, Task& left, Task& right, int begin, int count) {
        const Reference* others = references + begin;
        left.count = begin;
        left.box = box_of(references, begin), left.middles = middles_of(references, begin);
        right.box = box_of(others, count - begin), right.middles = middles_of(others, count - begin);
    }

    // Part references by kind: patches, whose numbers lie below 0, come first. False if all are of one kind.
    SHARED bool part_kinds(Reference* references, Task& left, Task& right, int count) {
        int begin = 0;
        for (int i = 0; i < count; ++i) {
            const Reference one = references[i];
            if (as_int(one.low[3]) >= 0) continue;
            references[i] = references[begin];
            references[begin++] = one;
        }
        if (begin == 0 || begin == count) return false;
        part_after(references, left, right, begin, count);
        return true;
    }

    // Split references until no more than ``most`` records are left together, or one reference. If each reference is one
    // record (``are_records``), what is left together is a block, and is split until all are of one kind, too. Nodes are
    // written from ``nodes[0]`` on, the root; the others are numbered from ``rest`` and references from ``first``. Returns
    // the number of nodes.
    SHARED int split_all(
        Reference* references, int count, int most, bool are_records, bool by_halves, Node* nodes, int rest, int first
    ) {
        Task waiting[TASKS];
        int top = 0, made = 1;
        Task task = {box_of(references, count), middles_of(references, count), 0, count, 0, 0};
        for (;;) {
            Reference* own = references + task.first;
            int records = task.count;
            for (int i = 0; !are_records && i < task.count; ++i) records += (int)own[i].high[3] - 1;
            Task left, right;
            Split split;
            bool is_split = task.count > 1;
            if (!is_split) {
            } else if (records <= most) {
                is_split = are_records && part_kinds(own, left, right, task.count);
            } else if (!by_halves && task.depth < DEEPEST && find_split(own, task.count, task.middles, split)) {
                part_at(own, split, left, right, task.count);
            } else {
                part_after(own, left, right, task.count / 2, task.count);
            }
            Node& node = nodes[task.node];
            node.low = task.box.low;
            node.high = task.box.high;
            if (is_split) {
                left.node = made, right.node = made + 1;
                left.first = task.first, right.first = task.first + left.count;
                right.count = task.count - left.count;
                left.depth = right.depth = task.depth + 1;
                node.low[3] = as_float(rest + made - 1);
                node.high[3] = as_float(rest + made);
                made += 2;
                const bool left_is_less = left.count < right.count;
                waiting[top++] = left_is_less ? right : left;
                task = left_is_less ? left : right;
            } else {
                node.low[3] = as_float(first + task.first);
                node.high[3] = as_float(~task.count);
                if (!top) return made;
                task = waiting[--top];
            }
        }
    }
};
