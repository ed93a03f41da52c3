#include "magshell/linalg/assembly_tree.h"

#include <algorithm>
#include <numeric>

#include "magshell/linalg/elimination_tree.h"

namespace magshell {
namespace {

// The time a front takes [ns], fitted to measurements: a constant, arithmetic, panel entries and update
// entries.
double front_time(double pivots, double below) {
    const double panel_entries = pivots * (0.5 * pivots + below);
    return 600.0 + 0.020 * elimination_flops(pivots, below) + 0.6 * panel_entries + 0.25 * below * below;
}

void reorder(std::vector<Index>& order, const std::vector<Index>& by) {
    std::vector<Index> result(order.size());
    for (std::size_t k = 0; k < by.size(); ++k) result[k] = order[by[k]];
    order = std::move(result);
}

// Nodes relabelled so that node k of the result is node by[k] of the argument.
std::vector<Index> relabel(const std::vector<Index>& parent, const std::vector<Index>& by) {
    std::vector<Index> label(by.size()), result(by.size());
    for (std::size_t k = 0; k < by.size(); ++k) label[by[k]] = static_cast<Index>(k);
    for (std::size_t k = 0; k < by.size(); ++k) result[k] = parent[by[k]] == -1 ? -1 : label[parent[by[k]]];
    return result;
}

// Columns whose structure differs only by the column itself, joined.
std::vector<FrontShape> fundamental_fronts(const std::vector<Index>& parent,
                                           const std::vector<Index>& counts) {
    const Index size = static_cast<Index>(parent.size());
    std::vector<FrontShape> fronts;
    std::vector<Index> front_of(size);
    for (Index j = 0; j < size; ++j) {
        const bool joins = j > 0 && parent[j - 1] == j && counts[j - 1] == counts[j] + 1;
        if (!joins) fronts.push_back({.first = j});
        FrontShape& front = fronts.back();
        ++front.pivots;
        front.below = counts[j] - 1;
        front_of[j] = static_cast<Index>(fronts.size()) - 1;
    }
    for (FrontShape& front : fronts) {
        const Index above = parent[front.first + front.pivots - 1];
        front.parent = above == -1 ? -1 : front_of[above];
    }
    return fronts;
}

// Which front absorbs each front: itself, or an ancestor.
//
// A child merged into its parent takes all rows of the parent: pivots add up, the rows below stay the
// parent's.
std::vector<Index> merge_fronts(const std::vector<FrontShape>& fronts) {
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

// The rows below each front, by following every row's entries up the tree of fronts.
std::vector<Index> rows_below(const UpperPattern& upper, const std::vector<FrontShape>& fronts) {
    const Index size = static_cast<Index>(upper.starts.size()) - 1;
    std::vector<Index> front_of(size), rows, last_row(fronts.size(), -1);
    std::vector<std::ptrdiff_t> next(fronts.size());
    for (std::size_t s = 0; s < fronts.size(); ++s) {
        std::fill_n(front_of.begin() + fronts[s].first, fronts[s].pivots, static_cast<Index>(s));
        next[s] = fronts[s].rows;
    }
    if (!fronts.empty()) rows.resize(fronts.back().rows + fronts.back().below);
    for (Index i = 0; i < size; ++i) {
        for (Index k = upper.starts[i]; k < upper.starts[i + 1]; ++k) {
            for (Index s = front_of[upper.rows[k]]; s != front_of[i] && last_row[s] != i;
                 s = fronts[s].parent) {
                last_row[s] = i;
                rows[next[s]++] = i;
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

AssemblyTree assembly_tree(const SparsePattern& pattern, const std::vector<Index>& order) {
    AssemblyTree tree;
    tree.order = order;
    UpperPattern upper = permuted_upper(pattern, tree.order);
    std::vector<Index> parent = elimination_tree(upper);
    const std::vector<Index> columns = postorder(parent);
    reorder(tree.order, columns);
    parent = relabel(parent, columns);
    upper = permuted_upper(pattern, tree.order);

    const std::vector<FrontShape> simple = fundamental_fronts(parent, column_counts(upper, parent));
    const std::vector<Index> absorbed_by = merge_fronts(simple);

    // The merged fronts form a tree; its postorder, and within a front the old order, is the new order of
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
    std::vector<std::vector<Index>> members(survivors.size());
    for (std::size_t s = 0; s < simple.size(); ++s) {
        members[merged_label[absorbed_by[s]]].push_back(static_cast<Index>(s));
    }
    const std::vector<Index> front_order = postorder(merged_parent);
    const std::vector<Index> front_parent = relabel(merged_parent, front_order);

    std::vector<Index> columns_by_front;
    columns_by_front.reserve(pattern.size);
    std::ptrdiff_t next_row = 0;
    for (std::size_t k = 0; k < front_order.size(); ++k) {
        const Index label = front_order[k];
        FrontShape front{.first = static_cast<Index>(columns_by_front.size()),
                         .below = simple[survivors[label]].below,
                         .parent = front_parent[k],
                         .rows = next_row};
        for (const Index s : members[label]) {
            for (Index j = 0; j < simple[s].pivots; ++j) columns_by_front.push_back(simple[s].first + j);
        }
        front.pivots = static_cast<Index>(columns_by_front.size()) - front.first;
        next_row += front.below;
        tree.fronts.push_back(front);
    }
    reorder(tree.order, columns_by_front);
    tree.rows = rows_below(permuted_upper(pattern, tree.order), tree.fronts);
    return tree;
}

}  // namespace magshell
