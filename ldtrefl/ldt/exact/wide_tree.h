// From a binary tree to an eight-wide one (wide_tree.py): eight of the parts at a time become the children of a node.

struct WideTree : BinaryTree {
    // The parts of a wide node: its binary node is opened, and then the largest of the parts, until there are eight or
    // all are leaves. Returns how many there are.
    SHARED int open(const Node* nodes, int root, int* parts) {
        float area[LANES];  // -1 for a leaf
        int count = 1;
        parts[0] = root;
        area[0] = is_leaf(nodes[root]) ? -1.0f : 0.0f;
        while (count < LANES) {
            int largest = 0;
            for (int k = 1; k < count; ++k) largest = area[k] > area[largest] ? k : largest;
            if (area[largest] < 0.0f) break;
            const Node& opened = nodes[parts[largest]];
            const int halves[2] = {as_int(opened.low[3]), as_int(opened.high[3])};
            for (int k = 0; k < 2; ++k) {
                const Node& half = nodes[halves[k]];
                const int at = k == 0 ? largest : count++;
                parts[at] = halves[k];
                area[at] = is_leaf(half) ? -1.0f : half_area(half.low, half.high);
            }
        }
        return count;
    }

    // The nodes of the wide tree, a part before the next.
    struct Wide {
        int* parts;     // of each node the binary nodes of its eight parts, or -1
        int* children;  // of each node what the search reads of them (``Tree`` in rays.h)
        int* waiting;   // children that a ray may have to come back to, at most, when it has looked at a node
        int nodes, rows, most_waiting;
    };

    // A binary node that is to become a wide one, and whose part it is.
    struct Unopened {
        int node, parent, lane;
    };

    // Make all nodes of the wide tree and number its blocks, which are as many rows high as their kind; records below 0
    // are patches. It gives up where more children may wait than a ray can hold.
    SHARED void gather(const Node* nodes, const int* records, int patch_rows, int triangle_rows, Wide& wide) {
        Unopened unopened[TREE_STACK];
        unopened[0] = {0, -1, 0};
        int top = 1;
        wide.nodes = wide.rows = wide.most_waiting = 0;
        while (top) {
            const Unopened one = unopened[--top];
            const int node = wide.nodes++;
            int* parts = wide.parts + LANES * node;
            int* children = wide.children + LANES * node;
            if (one.parent >= 0) wide.children[LANES * one.parent + one.lane] = node;
            const int count = open(nodes, one.node, parts);
            wide.waiting[node] = (one.parent < 0 ? 0 : wide.waiting[one.parent]) + count;
            if (wide.waiting[node] > wide.most_waiting) wide.most_waiting = wide.waiting[node];
            if (wide.most_waiting > TREE_STACK) return;
            for (int lane = count; lane < LANES; ++lane) parts[lane] = -1, children[lane] = 0;
            for (int lane = count; lane-- > 0;) {
                const Node& part = nodes[parts[lane]];
                if (is_leaf(part)) {
                    const bool is_patch = records[as_int(part.low[3])] < 0;
                    children[lane] = ~(2 * wide.rows + (is_patch ? 1 : 0));
                    wide.rows += is_patch ? patch_rows : triangle_rows;
                } else {
                    unopened[top++] = {parts[lane], node, lane};
                }
            }
        }
    }
};
