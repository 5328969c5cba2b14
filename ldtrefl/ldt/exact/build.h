// Building an eight-wide tree (tree_build.py): boxes are split in two, over and over, where the surface area heuristic
// says, and eight of the parts at a time become the children of a node.

struct TreeBuild : Vectors {
    enum {
        BINS = 16,  // along each axis, in which splits are looked for
        FEW_BINS = 8,
        FEW = 32,  // references up to which those do
        LANES = 8,
        DEEPEST = 48,  // splits from which halves are taken, whatever the heuristic says
        TASKS = 64,    // that wait: of each split the larger part does, so they double
    };

    struct Box {
        Four low, high;
    };

    // A box to be put into the tree. low[3]: the bits of its number; high[3]: how many items lie in it.
    struct Reference {
        Four low, high;
    };

    // Of a binary tree. The bits of low[3] and high[3] are its parts' numbers; of a leaf its first reference's, and
    // ~count.
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
    // Of what lies at twice the middles of boxes.
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

    // Blocks that so many items fill.
    SHARED Four blocks(const Four& items) { return truncated((items + four(LANES - 1.0f)) * four(1.0f / LANES)); }

    // Where to split, and what lies on either side. In bins along an axis, by scale * (twice the middle - origin).
    struct Split {
        Four origin, scale;
        int axis, bin;
        Box left, right;
    };

    // The binned surface area heuristic (Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies"):
    // the cost of a part is its area times the blocks that its items fill, which fills blocks. False if no split parts
    // the references.
    SHARED bool find_split(const Reference* references, int count, const Box& middles, Split& split) {
        const int bins = count > FEW ? BINS : FEW_BINS;
        const Four extent = middles.high - middles.low;
        split.origin = middles.low;
        split.scale = four(0.999f * bins) / greater(extent, four(SHORTEST));
        Box bin[BINS][3];
        float items[BINS][4];
        for (int b = 0; b < bins; ++b)
            for (int k = 0; k < 3; ++k) {
                bin[b][k] = nothing();
                items[b][k] = 0.0f;
            }
        for (int i = 0; i < count; ++i) {
            const Reference& one = references[i];
            int at[4];
            find_bins(one, split, at);
            for (int k = 0; k < 3; ++k) {
                add(bin[at[k]][k], one.low, one.high);
                items[at[k]][k] += one.high[3];
            }
        }

        // The parts after each bin, then those before it, for the three axes at once.
        Four cost_after[BINS], items_after[BINS];
        Box part[3] = {nothing(), nothing(), nothing()};
        Four sum = four(0.0f);
        for (int b = bins - 1; b > 0; --b) {
            for (int k = 0; k < 3; ++k) add(part[k], bin[b][k].low, bin[b][k].high);
            sum = sum + Four{items[b][0], items[b][1], items[b][2], 0.0f};
            items_after[b] = sum;
            cost_after[b] = half_areas(part) * blocks(sum);
        }
        Four least = four(EMPTY), best = four(0.0f);
        for (int k = 0; k < 3; ++k) part[k] = nothing();
        sum = four(0.0f);
        for (int b = 1; b < bins; ++b) {
            for (int k = 0; k < 3; ++k) add(part[k], bin[b - 1][k].low, bin[b - 1][k].high);
            sum = sum + Four{items[b - 1][0], items[b - 1][1], items[b - 1][2], 0.0f};
            const Four cost = half_areas(part) * blocks(sum) + cost_after[b];
            const FourFlags is_better = (sum > four(0.0f)) & (items_after[b] > four(0.0f)) & (cost < least);
            least = chosen(is_better, cost, least);
            best = chosen(is_better, four((float)b), best);
        }
        split.axis = least[0] <= least[1] && least[0] <= least[2] ? 0 : least[1] <= least[2] ? 1 : 2;
        split.bin = (int)best[split.axis];
        split.left = split.right = nothing();
        for (int b = 0; b < bins; ++b) {
            const Box& one = bin[b][split.axis];
            add(b < split.bin ? split.left : split.right, one.low, one.high);
        }
        return split.bin > 0;
    }

    SHARED void find_bins(const Reference& one, const Split& split, int* at) {
        const Four place = (one.low + one.high - split.origin) * split.scale;
        for (int k = 0; k < 3; ++k) at[k] = (int)place[k];
    }

    // References to be split: what is known of them, and their node.
    struct Task {
        Box box, middles;
        int first, count, node, depth;
    };

    // Put what lies before the split first.
    SHARED void part(Reference* references, const Split& split, Task& left, Task& right, int count) {
        left.middles = right.middles = nothing();
        left.box = split.left;
        right.box = split.right;
        int begin = 0, end = count;
        while (begin < end) {
            const Reference one = references[begin];
            const Four middle = one.low + one.high;
            int at[4];
            find_bins(one, split, at);
            if (at[split.axis] < split.bin) {
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

    SHARED void halve(const Reference* references, Task& left, Task& right, int count) {
        left.count = count / 2;
        const Reference* others = references + left.count;
        left.box = box_of(references, left.count), left.middles = middles_of(references, left.count);
        right.box = box_of(others, count - left.count), right.middles = middles_of(others, count - left.count);
    }

    // Items below 0, patches, come first; false if all are of one kind.
    SHARED bool part_kinds(Reference* references, Task& left, Task& right, int count) {
        int begin = 0;
        for (int i = 0; i < count; ++i) {
            const Reference one = references[i];
            if (as_int(one.low[3]) >= 0) continue;
            references[i] = references[begin];
            references[begin++] = one;
        }
        if (begin == 0 || begin == count) return false;
        const Reference* others = references + begin;
        left.count = begin;
        left.box = box_of(references, begin), left.middles = middles_of(references, begin);
        right.box = box_of(others, count - begin), right.middles = middles_of(others, count - begin);
        return true;
    }

    // Split references until none, or no more than ``most`` items, are left together; where those are the items of a
    // block, until they are of one kind, too. Nodes are written from ``nodes[0]`` on, the root, and numbered from
    // ``root`` and ``rest``; references are numbered from ``first``. Returns the number of nodes.
    SHARED int split_all(
        Reference* references, int count, int most, bool are_items, bool by_halves, Node* nodes, int rest, int first
    ) {
        Task waiting[TASKS];
        int top = 0, made = 1;
        Task task = {box_of(references, count), middles_of(references, count), 0, count, 0, 0};
        for (;;) {
            Reference* own = references + task.first;
            int items = task.count;
            for (int i = 0; !are_items && i < task.count; ++i) items += (int)own[i].high[3] - 1;
            Task left, right;
            Split split;
            bool is_split = task.count > 1;
            if (!is_split) {
            } else if (items <= most) {
                is_split = are_items && part_kinds(own, left, right, task.count);
            } else if (!by_halves && task.depth < DEEPEST && find_split(own, task.count, task.middles, split)) {
                part(own, split, left, right, task.count);
            } else {
                halve(own, left, right, task.count);
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

    // Make the children of a node: open the largest of its parts until there are eight, or all are leaves.
    SHARED int gather(const Node* nodes, int root, int* children) {
        float area[LANES];
        int count = 1;
        children[0] = root;
        area[0] = is_leaf(nodes[root]) ? -1.0f : 0.0f;
        while (count < LANES) {
            int largest = 0;
            for (int k = 1; k < count; ++k) largest = area[k] > area[largest] ? k : largest;
            if (area[largest] < 0.0f) break;
            const Node& opened = nodes[children[largest]];
            const int parts[2] = {as_int(opened.low[3]), as_int(opened.high[3])};
            for (int k = 0; k < 2; ++k) {
                const Node& part = nodes[parts[k]];
                const int at = k == 0 ? largest : count++;
                children[at] = parts[k];
                area[at] = is_leaf(part) ? -1.0f : half_area(part.low, part.high);
            }
        }
        return count;
    }

    // The nodes of the wide tree, a part before the next.
    struct Wide {
        int* parts;     // of each node the binary nodes of its eight parts, or -1
        int* children;  // what ``tree_walk.h`` reads of them
        int* waiting;   // what a ray may leave behind on its way to a node, and there
        int nodes, rows, most_waiting;
    };

    // A binary node that becomes a wide one, and whose part it is.
    struct Waiting {
        int node, parent, lane;
    };

    // Gather all nodes; blocks of ``item``, patches below 0, are as many rows high as their kind. It gives up where more
    // may wait than a ray can hold.
    SHARED void gather_all(const Node* nodes, const int* item, int patch_rows, int triangle_rows, Wide& wide) {
        Waiting waiting[TREE_STACK];
        waiting[0] = {0, -1, 0};
        int top = 1;
        wide.nodes = wide.rows = wide.most_waiting = 0;
        while (top) {
            const Waiting one = waiting[--top];
            const int node = wide.nodes++;
            int* parts = wide.parts + LANES * node;
            int* children = wide.children + LANES * node;
            if (one.parent >= 0) wide.children[LANES * one.parent + one.lane] = node;
            const int count = gather(nodes, one.node, parts);
            wide.waiting[node] = (one.parent < 0 ? 0 : wide.waiting[one.parent]) + count;
            if (wide.waiting[node] > wide.most_waiting) wide.most_waiting = wide.waiting[node];
            if (wide.most_waiting > TREE_STACK) return;
            for (int lane = count; lane < LANES; ++lane) parts[lane] = -1, children[lane] = 0;
            for (int lane = count; lane-- > 0;) {
                const Node& part = nodes[parts[lane]];
                if (is_leaf(part)) {
                    const bool is_patch = item[as_int(part.low[3])] < 0;
                    children[lane] = ~(2 * wide.rows + (is_patch ? 1 : 0));
                    wide.rows += is_patch ? patch_rows : triangle_rows;
                } else {
                    waiting[top++] = {parts[lane], node, lane};
                }
            }
        }
    }
};
