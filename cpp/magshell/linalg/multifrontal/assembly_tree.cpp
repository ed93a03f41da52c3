#include "magshell/linalg/multifrontal/assembly_tree.h"

#include <algorithm>
#include <numeric>

#include "magshell/linalg/multifrontal/elimination_tree.h"

namespace magshell {
namespace {

// Returns the estimated time of a front [ns]: a constant, arithmetic, panel entries and update entries. It
// decides which fronts are merged.
double front_time(double pivots, double below) {
    const double panel_entries = pivots * (0.5 * pivots + below);
    // [ns] per front, per operation, per entry of the panel and of the update; changes time only, results are fixed by
    // test_definite_matrices_are_solved_to_rounding
    constexpr double per_front = 600.0, per_flop = 0.020, per_panel_entry = 0.6, per_update_entry = 0.25;
    return per_front + per_flop * elimination_flops(pivots, below) + per_panel_entry * panel_entries +
           per_update_entry * below * below;
}

void reorder(std::vector<Index>& order, const std::vector<Index>& by) {
    std::vector<Index> result(order.size());
    for (std::size_t k = 0; k < by.size(); ++k) result[k] = order[by[k]];
    order = std::move(result);
}

// Relabels nodes: node k of the result is node by[k] of the argument.
std::vector<Index> relabel(const std::vector<Index>& parent, const std::vector<Index>& by) {
    std::vector<Index> label(by.size()), result(by.size());
    for (std::size_t k = 0; k < by.size(); ++k) label[by[k]] = static_cast<Index>(k);
    for (std::size_t k = 0; k < by.size(); ++k) result[k] = parent[by[k]] == -1 ? -1 : label[parent[by[k]]];
    return result;
}

// A front, and the range of elimination tree nodes that are its pivots.
struct NodeFront : FrontShape {
    Index first_node = 0, end_node = 0;
};

// Joins consecutive nodes whose structure differs only by the node itself (fundamental supernodes).
std::vector<NodeFront> fundamental_fronts(const std::vector<Index>& parent, const std::vector<Index>& counts,
                                          const std::vector<Index>& weights) {
    const Index size = static_cast<Index>(parent.size());
    std::vector<NodeFront> fronts;
    std::vector<Index> front_of(size);
    for (Index j = 0; j < size; ++j) {
        const bool joins = j > 0 && parent[j - 1] == j && counts[j - 1] == counts[j] + weights[j - 1];
        if (!joins) fronts.emplace_back().first_node = j;
        NodeFront& front = fronts.back();
        front.pivots += weights[j];
        front.below = counts[j] - weights[j];
        front.end_node = j + 1;
        front_of[j] = static_cast<Index>(fronts.size()) - 1;
    }
    for (NodeFront& front : fronts) {
        const Index above = parent[front.end_node - 1];
        front.parent = above == -1 ? -1 : front_of[above];
    }
    return fronts;
}

// Returns the front that absorbs each front: itself, or an ancestor.
//
// A child merged into its parent takes all rows of the parent: the pivots add up, and the rows below remain
// those of the parent.
std::vector<Index> merge_fronts(const std::vector<NodeFront>& fronts) {
    const Index count = static_cast<Index>(fronts.size());
    std::vector<std::vector<Index>> children(count);
    for (Index s = 0; s < count; ++s) {
        if (fronts[s].parent != -1) children[fronts[s].parent].push_back(s);
    }
    std::vector<Index> absorbed_by(count);
    std::iota(absorbed_by.begin(), absorbed_by.end(), 0);
    std::vector<Index> pivots(count);
    for (Index s = 0; s < count; ++s) {
        pivots[s] = fronts[s].pivots;
        std::vector<Index> candidates = std::move(children[s]);
        std::stable_sort(candidates.begin(), candidates.end(),
                         [&](Index a, Index b) { return fronts[a].below > fronts[b].below; });
        std::vector<Index> kept;
        for (const Index child : candidates) {
            const double apart =
                front_time(pivots[child], fronts[child].below) + front_time(pivots[s], fronts[s].below);
            if (front_time(pivots[child] + pivots[s], fronts[s].below) < apart) {
                pivots[s] += pivots[child];
                absorbed_by[child] = s;
                kept.insert(kept.end(), children[child].begin(), children[child].end());
            } else {
                kept.push_back(child);
            }
        }
        children[s] = std::move(kept);
    }
    for (Index s = count - 1; s >= 0; --s) absorbed_by[s] = absorbed_by[absorbed_by[s]];
    return absorbed_by;
}

// Returns the rows below each front, by following the entries of every node up the tree of fronts. `ends`: end
// of each node's unknowns in the order of elimination.
std::vector<Index> rows_below(const UpperPattern& upper, const std::vector<Index>& ends,
                              const std::vector<FrontShape>& fronts) {
    const Index size = static_cast<Index>(ends.size());
    std::vector<Index> front_of(size), rows, last_node(fronts.size(), -1);
    std::vector<std::ptrdiff_t> next(fronts.size());
    Index node = 0;
    for (std::size_t s = 0; s < fronts.size(); ++s) {
        while (node < size && ends[node] <= fronts[s].first + fronts[s].pivots)
            front_of[node++] = static_cast<Index>(s);
        next[s] = fronts[s].rows;
    }
    if (!fronts.empty()) rows.resize(fronts.back().rows + fronts.back().below);
    for (Index i = 0; i < size; ++i) {
        for (Index k = upper.starts[i]; k < upper.starts[i + 1]; ++k) {
            for (Index s = front_of[upper.rows[k]]; s != front_of[i] && last_node[s] != i;
                 s = fronts[s].parent) {
                last_node[s] = i;
                for (Index row = i > 0 ? ends[i - 1] : 0; row < ends[i]; ++row) rows[next[s]++] = row;
            }
        }
    }
    return rows;
}

}  // namespace

double elimination_flops(double pivots, double below) {
    const double panel = pivots * (pivots + 1) * (2 * pivots + 1) / 6 + below * pivots * pivots;
    return panel + pivots * below * (below + 1);
}

double AssemblyTree::flops() const {
    double sum = 0.0;
    for (const FrontShape& front : fronts) sum += elimination_flops(front.pivots, front.below);
    return sum;
}

std::int64_t AssemblyTree::nonzeros() const {
    std::int64_t sum = 0;
    for (const FrontShape& front : fronts) {
        sum += std::int64_t{front.pivots} * (front.pivots + 1) / 2 + std::int64_t{front.pivots} * front.below;
    }
    return sum;
}

AssemblyTree assembly_tree(const Quotient& quotient, std::vector<Index> order) {
    const auto weights_of = [&](const std::vector<Index>& nodes) {
        std::vector<Index> weights;
        weights.reserve(nodes.size());
        for (const Index node : nodes) weights.push_back(static_cast<Index>(quotient.members(node).size()));
        return weights;
    };
    std::vector<Index> parent, counts;
    {
        const UpperPattern upper = permuted_upper(quotient.pattern, order);
        parent = elimination_tree(upper);
        counts = column_counts(upper, parent, weights_of(order));
    }
    const std::vector<Index> by_subtrees = postorder(parent);
    reorder(order, by_subtrees);
    reorder(counts, by_subtrees);
    parent = relabel(parent, by_subtrees);
    const std::vector<Index> weights = weights_of(order);
    const std::vector<NodeFront> simple = fundamental_fronts(parent, counts, weights);
    const std::vector<Index> absorbed_by = merge_fronts(simple);

    // The merged fronts form a tree. Its postorder, and within a front the old order, is the new order of
    // elimination.
    std::vector<Index> merged_parent, merged_label(simple.size(), -1), survivors;
    for (std::size_t s = 0; s < simple.size(); ++s) {
        if (absorbed_by[s] != static_cast<Index>(s)) continue;
        merged_label[s] = static_cast<Index>(survivors.size());
        survivors.push_back(static_cast<Index>(s));
    }
    for (const Index s : survivors) {
        const Index above = simple[s].parent;
        merged_parent.push_back(above == -1 ? -1 : merged_label[absorbed_by[above]]);
    }
    std::vector<std::vector<Index>> absorbed(survivors.size());
    for (std::size_t s = 0; s < simple.size(); ++s) {
        absorbed[merged_label[absorbed_by[s]]].push_back(static_cast<Index>(s));
    }
    const std::vector<Index> front_order = postorder(merged_parent);
    const std::vector<Index> front_parent = relabel(merged_parent, front_order);

    AssemblyTree tree;
    std::vector<Index> by_fronts, ends;
    by_fronts.reserve(order.size());
    ends.reserve(order.size());
    Index end = 0;
    std::ptrdiff_t next_row = 0;
    for (std::size_t k = 0; k < front_order.size(); ++k) {
        const Index label = front_order[k];
        FrontShape front{.first = end,
                         .below = simple[survivors[label]].below,
                         .parent = front_parent[k],
                         .rows = next_row};
        for (const Index s : absorbed[label]) {
            for (Index node = simple[s].first_node; node < simple[s].end_node; ++node) {
                by_fronts.push_back(node);
                end += weights[node];
                ends.push_back(end);
            }
        }
        front.pivots = end - front.first;
        next_row += front.below;
        tree.fronts.push_back(front);
    }
    reorder(order, by_fronts);
    tree.rows = rows_below(permuted_upper(quotient.pattern, order), ends, tree.fronts);
    tree.order.reserve(end);
    for (const Index node : order) {
        const std::span<const Index> members = quotient.members(node);
        tree.order.insert(tree.order.end(), members.begin(), members.end());
    }
    return tree;
}

}  // namespace magshell
