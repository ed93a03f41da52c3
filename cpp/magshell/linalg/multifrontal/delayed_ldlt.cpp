#include "magshell/linalg/multifrontal/delayed_ldlt.h"

#include <algorithm>
#include <numeric>

#include "magshell/core/parallel.h"

namespace magshell {
namespace {

using slabs::Panel;
using slabs::width;

// Adds the entries of the matrix to the columns of a front, after those of `delayed` columns.
void add_entries(const AssemblyPlan& plan, Index s, const double* values, double* panels, Index delayed,
                 Eigen::MatrixXd& columns) {
    const FrontPlan& front = plan.fronts[s];
    const Index pivots = front.shape.pivots;
    double* const data = panels + front.panel;
    std::fill_n(data, Panel::doubles(pivots, front.shape.below), 0.0);
    for (Index k = front.first_entry; k < plan.fronts[s + 1].first_entry; ++k)
        data[plan.entries[k].place] = values[plan.entries[k].entry];
    const Panel panel(data, pivots);
    for (Index i = 0; i < pivots; ++i) {
        for (Index j = 0; j <= i; ++j) {
            const double entry = panel.top.slab(i / width)[width * j + i % width];
            columns(delayed + i, delayed + j) = columns(delayed + j, delayed + i) = entry;
        }
    }
    for (Index i = 0; i < front.shape.below; ++i) {
        const double* slab = panel.below.slab(i / width) + i % width;
        for (Index j = 0; j < pivots; ++j) columns(delayed + pivots + i, delayed + j) = slab[width * j];
    }
}

// Adds what is left of a child to its parent. to[k]: the row of the parent for row k of the child that was not
// eliminated, ascending.
void add_child(const ThresholdFront& child, const std::vector<Index>& to, ThresholdFront& parent) {
    const Index delayed = child.summed - child.eliminated, left = static_cast<Index>(to.size());
    for (Index j = 0; j < left; ++j) {
        // [rows] before the first entry of the child's column: its rows count from its first fully summed row,
        // or from its first row below
        const Index before = j < delayed ? -child.eliminated : delayed;
        const double* from = j < delayed ? child.columns.col(child.eliminated + j).data()
                                         : child.below.col(j - delayed).data();
        const Index column = to[j];
        if (column >= parent.summed) {
            double* const target = parent.below.col(column - parent.summed).data();
            for (Index i = j; i < left; ++i) target[to[i] - parent.summed] += from[i - before];
            continue;
        }
        double* const target = parent.columns.col(column).data();
        for (Index i = j; i < left; ++i) {
            target[to[i]] += from[i - before];
            if (to[i] < parent.summed && i != j) parent.columns(column, to[i]) += from[i - before];
        }
    }
}

}  // namespace

DelayedLdlt::DelayedLdlt(const AssemblyPlan& plan, const double* values, double* panels)
    : plan_(plan), fronts_(plan.front_count()) {
    const int subtrees = static_cast<int>(plan.subtrees.size());
    std::vector<PivotTally> tallies(subtrees);
    parallel_for(subtrees, [&](int task) {
        const Subtree& subtree = plan.subtrees[task];
        for (Index s = subtree.begin; s < subtree.end; ++s) process(s, values, panels, tallies[task]);
    });
    for (const PivotTally& each : tallies) tally_.add(each);
    for (const Index s : plan.top) process(s, values, panels, tally_);
}

void DelayedLdlt::process(Index s, const double* values, double* panels, PivotTally& tally) {
    const FrontPlan& plan = plan_.fronts[s];
    const FrontShape& shape = plan.shape;
    ThresholdFront& front = fronts_[s];
    for (const Index child : plan.children) {
        const ThresholdFront& from = fronts_[child];
        front.rows.insert(front.rows.end(), from.rows.begin() + from.eliminated,
                          from.rows.begin() + from.summed);
    }
    const Index delayed = static_cast<Index>(front.rows.size());
    front.summed = delayed + shape.pivots;
    front.rows.resize(front.summed);
    std::iota(front.rows.begin() + delayed, front.rows.end(), shape.first);
    front.rows.insert(front.rows.end(), plan_.rows.begin() + shape.rows,
                      plan_.rows.begin() + shape.rows + shape.below);
    front.columns.setZero(front.summed + shape.below, front.summed);
    front.below.setZero(shape.below, shape.below);
    add_entries(plan_, s, values, panels, delayed, front.columns);

    Index next_delayed = 0;
    for (const Index child : plan.children) {
        ThresholdFront& from = fronts_[child];
        const FrontPlan& child_plan = plan_.fronts[child];
        std::vector<Index> to(from.summed - from.eliminated);
        std::iota(to.begin(), to.end(), next_delayed);
        next_delayed += static_cast<Index>(to.size());
        for (Index k = 0; k < child_plan.shape.below; ++k) {
            const Index place = plan_.places[child_plan.shape.rows + k];
            to.push_back(k < child_plan.rows_in_parent_pivots ? delayed + place : front.summed + place);
        }
        add_child(from, to, front);
        from.below.resize(0, 0);
        from.columns.conservativeResize(Eigen::NoChange, from.eliminated);
    }
    front.eliminate(tally);
}

void DelayedLdlt::solve(VectorXd& x) const {
    VectorXd part;
    for (const ThresholdFront& front : fronts_) {
        const Index count = front.eliminated, left = static_cast<Index>(front.rows.size()) - count;
        part.resize(count);
        for (Index k = 0; k < count; ++k) part[k] = x[front.rows[k]];
        front.columns.topLeftCorner(count, count).triangularView<Eigen::UnitLower>().solveInPlace(part);
        for (Index k = 0; k < count; ++k) x[front.rows[k]] = part[k];
        const VectorXd change = front.columns.block(count, 0, left, count) * part;
        for (Index k = 0; k < left; ++k) x[front.rows[count + k]] -= change[k];
    }
    VectorXd other;
    for (auto each = fronts_.rbegin(); each != fronts_.rend(); ++each) {
        const ThresholdFront& front = *each;
        const Index count = front.eliminated, left = static_cast<Index>(front.rows.size()) - count;
        part.resize(count);
        other.resize(left);
        for (Index k = 0; k < count; ++k) part[k] = x[front.rows[k]];
        for (Index k = 0; k < left; ++k) other[k] = x[front.rows[count + k]];
        const Pivots d{const_cast<double*>(front.diagonal.data()),
                       const_cast<double*>(front.coupling.data())};
        for (Index k = 0; k < count;) k += divide_by_pivot(d, k, part[k], part.data() + k + 1);
        part.noalias() -= front.columns.block(count, 0, left, count).transpose() * other;
        front.columns.topLeftCorner(count, count)
            .transpose()
            .triangularView<Eigen::UnitUpper>()
            .solveInPlace(part);
        for (Index k = 0; k < count; ++k) x[front.rows[k]] = part[k];
    }
}

std::size_t DelayedLdlt::bytes() const {
    return std::accumulate(fronts_.begin(), fronts_.end(), std::size_t{0},
                           [](std::size_t sum, const ThresholdFront& front) { return sum + front.bytes(); });
}

}  // namespace magshell
