#include "magshell/linalg/multifrontal/assembly_plan.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "magshell/core/errors.h"
#include "magshell/linalg/multifrontal/slabs.h"

namespace magshell {
namespace {

using slabs::Panel;
using slabs::Rectangle;
using slabs::Triangle;
using slabs::width;

// Returns the offset of (row, column) in a panel [doubles]; rows count from the first pivot, or from the first
// row below.
std::ptrdiff_t panel_place(const FrontShape& front, Index row, bool is_pivot, Index column) {
    const Index slab = row / width, lane = row % width;
    const std::ptrdiff_t start =
        is_pivot ? Triangle::offset(slab)
                 : Triangle::doubles(front.pivots) + Rectangle::doubles(slab * width, front.pivots);
    return start + std::ptrdiff_t{width} * column + lane;
}

void place_entries(const SparsePattern& pattern, AssemblyPlan& plan) {
    struct Eliminated {
        Index position, front;
    };
    std::vector<Eliminated> eliminated(pattern.size);
    for (Index s = 0; s < plan.front_count(); ++s) {
        const FrontShape& front = plan.fronts[s].shape;
        for (Index k = front.first; k < front.first + front.pivots; ++k) eliminated[plan.order[k]] = {k, s};
    }

    // Sorts entries by front, with the position of an entry's column as its place for now, and that of its row
    // next to it. What is looked up by an unknown is scattered in memory, so it is done here, in the pattern's
    // order.
    plan.entries.resize(pattern.rows.size());
    std::vector<Index> row_of(pattern.rows.size()), next(plan.fronts.size() + 1, 0), local_row(pattern.size);
    const auto each_entry = [&](auto&& visit) {
        for (Index j = 0; j < pattern.size; ++j) {
            const Eliminated own = eliminated[j];
            for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
                const Eliminated other = eliminated[pattern.rows[k]];
                visit(std::min(own.front, other.front), k,
                      std::pair{std::min(own.position, other.position),
                                std::max(own.position, other.position)});
            }
        }
    };
    each_entry([&](Index front, Index, const auto&) { ++next[front + 1]; });
    for (std::size_t s = 0; s + 1 < next.size(); ++s) next[s + 1] += next[s];
    for (std::size_t s = 0; s < plan.fronts.size(); ++s) plan.fronts[s].first_entry = next[s];
    each_entry([&](Index front, Index k, const std::pair<Index, Index>& position) {
        const Index to = next[front]++;
        plan.entries[to] = {k, position.first};
        row_of[to] = position.second;
    });

    for (Index s = 0; s < plan.front_count(); ++s) {
        const FrontShape& front = plan.fronts[s].shape;
        for (Index k = 0; k < front.below; ++k) local_row[plan.rows[front.rows + k]] = k;
        for (Index k = plan.fronts[s].first_entry; k < plan.fronts[s + 1].first_entry; ++k) {
            RoutedEntry& entry = plan.entries[k];
            const Index column = entry.place, row = row_of[k];
            const bool is_pivot = row < front.first + front.pivots;
            const Index in_front = is_pivot ? row - front.first : local_row[row];
            entry.place = static_cast<Index>(panel_place(front, in_front, is_pivot, column - front.first));
        }
    }
}

// Adds the transfers of a front: the rows of each slab, grouped by the slab of the parent that receives them.
void add_transfers(const FrontPlan& front, AssemblyPlan& plan) {
    for (Index first = 0; first < front.shape.below; first += width) {
        const Index end = std::min(first + width, front.shape.below);
        for (Index k = first; k < end; ++k) {
            const Index place = plan.places[front.shape.rows + k];
            const bool to_pivots = k < front.rows_in_parent_pivots;
            const bool continues = k > first && plan.transfers.back().to_pivots == to_pivots &&
                                   plan.transfers.back().parent_slab == place / width;
            if (!continues) {
                Transfer transfer{first / width, place / width, 0, to_pivots, {}};
                transfer.from.fill(width);
                plan.transfers.push_back(transfer);
            }
            plan.transfers.back().from[place % width] = static_cast<std::uint8_t>(k - first);
            plan.transfers.back().end_column = k + 1;
        }
    }
}

void place_updates(AssemblyPlan& plan) {
    std::vector<Index> local_row(plan.order.size());
    plan.places.resize(plan.rows.size());
    for (Index s = 0; s < plan.front_count(); ++s) {
        const FrontShape& parent = plan.fronts[s].shape;
        for (Index k = 0; k < parent.below; ++k) local_row[plan.rows[parent.rows + k]] = k;
        for (const Index child : plan.fronts[s].children) {
            FrontPlan& front = plan.fronts[child];
            for (Index k = 0; k < front.shape.below; ++k) {
                const Index row = plan.rows[front.shape.rows + k];
                const bool is_pivot = row < parent.first + parent.pivots;
                front.rows_in_parent_pivots += is_pivot;
                plan.places[front.shape.rows + k] = is_pivot ? row - parent.first : local_row[row];
            }
        }
    }
    for (FrontPlan& front : plan.fronts) {
        front.first_transfer = static_cast<Index>(plan.transfers.size());
        if (front.shape.parent != -1) add_transfers(front, plan);
    }
}

// First-fit allocation in one contiguous piece of memory.
class Line {
  public:
    std::ptrdiff_t take(std::ptrdiff_t size) {
        std::ptrdiff_t start = 0;
        auto at = used_.begin();
        while (at != used_.end() && at->first - start < size) {
            start = at->first + at->second;
            ++at;
        }
        used_.emplace_hint(at, start, size);
        extent_ = std::max(extent_, start + size);
        return start;
    }
    void give_back(std::ptrdiff_t start) { used_.erase(start); }
    std::ptrdiff_t extent() const { return extent_; }

  private:
    std::map<std::ptrdiff_t, std::ptrdiff_t> used_;  // start -> size
    std::ptrdiff_t extent_ = 0;
};

// Allocates work space for the updates of fronts that are processed one after another: an update lives until
// its parent has taken it. The updates of `waiting` exist from the beginning, for parents in the sequence.
// Returns the space needed [doubles].
std::ptrdiff_t place_work(AssemblyPlan& plan, const std::vector<Index>& waiting,
                          const std::vector<Index>& sequence) {
    Line line;
    const auto take = [&](Index s) {
        FrontPlan& front = plan.fronts[s];
        if (front.shape.below > 0)
            front.update = line.take(Triangle::offset(slabs::count(front.shape.below)));
    };
    std::for_each(waiting.begin(), waiting.end(), take);
    for (const Index s : sequence) {
        take(s);
        for (const Index child : plan.fronts[s].children)
            if (plan.fronts[child].shape.below > 0) line.give_back(plan.fronts[child].update);
    }
    return line.extent();
}

// Splits the tree into subtrees of limited work and the fronts above them.
void split(AssemblyPlan& plan, const std::vector<double>& subtree_flops, double total) {
    // [-] Number of parts of equal work that no subtree may exceed: enough to keep a few threads busy; fixed by
    // test_many_bodies_in_one_matrix_are_solved_on_any_number_of_threads
    constexpr double parts = 16.0;
    std::vector<bool> in_top(plan.front_count(), false);
    for (Index s = plan.front_count() - 1; s >= 0; --s) {
        const Index parent = plan.fronts[s].shape.parent;
        if (parent != -1 && !in_top[parent]) continue;
        if (subtree_flops[s] > total / parts) in_top[s] = true;
    }
    Index begin = 0;
    for (Index s = 0; s < plan.front_count(); ++s) {
        const Index parent = plan.fronts[s].shape.parent;
        if (in_top[s]) {
            plan.top.push_back(s);
            begin = s + 1;
        } else if (parent == -1 || in_top[parent]) {
            const FrontShape& root = plan.fronts[s].shape;
            const Index first = plan.fronts[begin].shape.first;
            plan.subtrees.push_back({begin, s + 1, first, root.first + root.pivots - first});
            begin = s + 1;
        }
    }
    // The largest first, so that threads end at about the same time.
    const auto flops = [&](const Subtree& subtree) { return subtree_flops[subtree.end - 1]; };
    std::stable_sort(plan.subtrees.begin(), plan.subtrees.end(),
                     [&](const Subtree& a, const Subtree& b) { return flops(a) > flops(b); });
}

void place_vectors(AssemblyPlan& plan) {
    plan.targets = plan.rows;
    std::vector<Index> place(plan.order.size());
    for (Subtree& subtree : plan.subtrees) {
        subtree.local = plan.local_doubles;
        const FrontShape& root = plan.fronts[subtree.end - 1].shape;
        plan.local_doubles += subtree.unknowns + root.below;
        std::iota(place.begin() + subtree.first, place.begin() + subtree.first + subtree.unknowns, 0);
        for (Index k = 0; k < root.below; ++k) place[plan.rows[root.rows + k]] = subtree.unknowns + k;
        for (Index s = subtree.begin; s < subtree.end; ++s) {
            const FrontShape& front = plan.fronts[s].shape;
            for (Index k = 0; k < front.below; ++k)
                plan.targets[front.rows + k] = place[plan.rows[front.rows + k]];
        }
    }
}

}  // namespace

AssemblyPlan assembly_plan(const SparsePattern& pattern, AssemblyTree tree) {
    AssemblyPlan plan;
    const Index count = static_cast<Index>(tree.fronts.size());
    plan.order = std::move(tree.order);
    plan.rows = std::move(tree.rows);
    plan.fronts.resize(count + 1);
    std::vector<double> subtree_flops(count, 0.0);
    for (Index s = 0; s < count; ++s) {
        const FrontShape& shape = tree.fronts[s];
        plan.fronts[s].shape = shape;
        plan.fronts[s].panel = plan.factor_doubles;
        plan.most_pivots = std::max(plan.most_pivots, shape.pivots);
        plan.most_below = std::max(plan.most_below, shape.below);
        const std::ptrdiff_t doubles = Panel::doubles(shape.pivots, shape.below);
        if (doubles > std::numeric_limits<Index>::max()) {
            throw InvalidInput(
                "the matrix fills in too much to be factorized: " + std::to_string(shape.pivots) +
                " dense columns of " + std::to_string(shape.pivots + shape.below) + " rows");
        }
        plan.factor_doubles += doubles;
        subtree_flops[s] += elimination_flops(shape.pivots, shape.below);
        if (shape.parent != -1) {
            plan.fronts[shape.parent].children.push_back(s);
            subtree_flops[shape.parent] += subtree_flops[s];
        }
    }
    place_entries(pattern, plan);
    place_updates(plan);
    split(plan, subtree_flops, tree.flops());
    place_vectors(plan);
    std::vector<Index> roots, inner;
    for (const Subtree& subtree : plan.subtrees) {
        roots.push_back(subtree.end - 1);
        inner.resize(subtree.end - 1 - subtree.begin);
        std::iota(inner.begin(), inner.end(), subtree.begin);
        plan.subtree_doubles = std::max(plan.subtree_doubles, place_work(plan, {}, inner));
    }
    plan.shared_doubles = place_work(plan, roots, plan.top);
    return plan;
}

}  // namespace magshell
