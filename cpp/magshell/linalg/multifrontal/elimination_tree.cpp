#include "magshell/linalg/multifrontal/elimination_tree.h"

#include <algorithm>

namespace magshell {

UpperPattern permuted_upper(const SparsePattern& pattern, const std::vector<Index>& order) {
    const Index size = pattern.size;
    std::vector<Index> position(size);
    for (Index k = 0; k < size; ++k) position[order[k]] = k;

    UpperPattern upper;
    upper.starts.assign(size + 1, 0);
    const auto each_entry = [&](auto&& visit) {
        for (Index j = 0; j < size; ++j) {
            for (Index k = pattern.column_starts[j] + 1; k < pattern.column_starts[j + 1]; ++k) {
                const auto [first, last] = std::minmax(position[j], position[pattern.rows[k]]);
                visit(first, last);
            }
        }
    };
    each_entry([&](Index, Index column) { ++upper.starts[column + 1]; });
    for (Index j = 0; j < size; ++j) upper.starts[j + 1] += upper.starts[j];
    upper.rows.resize(upper.starts[size]);
    std::vector<Index> next(upper.starts.begin(), upper.starts.end() - 1);
    each_entry([&](Index row, Index column) { upper.rows[next[column]++] = row; });
    return upper;
}

std::vector<Index> elimination_tree(const UpperPattern& upper) {
    const Index size = static_cast<Index>(upper.starts.size()) - 1;
    std::vector<Index> parent(size, -1);
    std::vector<Index> ancestor(size, -1);  // highest node reached so far (path compression)
    for (Index j = 0; j < size; ++j) {
        for (Index k = upper.starts[j]; k < upper.starts[j + 1]; ++k) {
            for (Index i = upper.rows[k]; i != -1 && i < j;) {
                const Index above = ancestor[i];
                ancestor[i] = j;
                if (above == -1) parent[i] = j;
                i = above;
            }
        }
    }
    return parent;
}

std::vector<Index> postorder(const std::vector<Index>& parent) {
    const Index size = static_cast<Index>(parent.size());
    std::vector<Index> first_child(size, -1), next_sibling(size, -1);
    Index first_root = -1;
    for (Index j = size - 1; j >= 0; --j) {  // backwards, so that children are listed in ascending order
        Index& head = parent[j] == -1 ? first_root : first_child[parent[j]];
        next_sibling[j] = head;
        head = j;
    }
    std::vector<Index> order, path;
    order.reserve(size);
    for (Index root = first_root; root != -1; root = next_sibling[root]) {
        path.push_back(root);
        while (!path.empty()) {
            const Index node = path.back();
            const Index child = first_child[node];
            if (child == -1) {
                order.push_back(node);
                path.pop_back();
            } else {
                first_child[node] = next_sibling[child];
                path.push_back(child);
            }
        }
    }
    return order;
}

// Row i of L has an entry in column j exactly if j lies on a path of the tree from an entry of row i of A up to
// i.
std::vector<Index> column_counts(const UpperPattern& upper, const std::vector<Index>& parent,
                                 const std::vector<Index>& weights) {
    const Index size = static_cast<Index>(parent.size());
    std::vector<Index> counts = weights, seen(size, -1);
    for (Index i = 0; i < size; ++i) {
        seen[i] = i;
        for (Index k = upper.starts[i]; k < upper.starts[i + 1]; ++k) {
            for (Index j = upper.rows[k]; seen[j] != i; j = parent[j]) {
                seen[j] = i;
                counts[j] += weights[i];
            }
        }
    }
    return counts;
}

}  // namespace magshell
