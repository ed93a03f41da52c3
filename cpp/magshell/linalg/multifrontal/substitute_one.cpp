#include <algorithm>

#include "magshell/core/parallel.h"
#include "magshell/linalg/multifrontal/slab_kernels.h"
#include "magshell/linalg/multifrontal/triangular_solves.h"
#include "magshell/linalg/multifrontal/work_spaces.h"

namespace magshell {
namespace {

using slabs::lanes;
using slabs::Lanes;
using slabs::Panel;
using slabs::width;

constexpr int row_group =
    // [slabs] multiplied at once by one vector: enough independent sums to hide their latency; plain-words: ok
    4;

double sum(const Lanes& v) {
    return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

// Substitution for one right-hand side. `pivots` is the part of x on a front's pivots, in the order in which
// they were taken, padded to whole slabs.

void forward_top(const Panel& panel, Index count, double* pivots) {
    for (Index i = 0; i < panel.top_slabs; ++i) {
        const double* slab = panel.top.slab(i);
        Lanes value[2] = {lanes(pivots + width * i), Lanes{}};
        for (Index p = 0; p < width * i; p += 2) {
            value[0] -= lanes(slab + width * p) * pivots[p];
            value[1] -= lanes(slab + width * (p + 1)) * pivots[p + 1];
        }
        Lanes& result = lanes(pivots + width * i);
        result = value[0] + value[1];
        const Index end = std::min(width, count - width * i);
        for (Index lane = 0; lane < end; ++lane) {
            const double solved = result[lane];
            result -=
                // L has a unit diagonal: this clears the lane itself, too
                lanes(slab + width * (width * i + lane)) * solved;
            result[lane] = solved;
        }
    }
}

template <int S>
void subtract_below(const Panel& panel, Index first_slab, Index count, const double* pivots,
                    const Index* rows, Index below, double* x) {
    const double* slab[S];
    for (int s = 0; s < S; ++s) slab[s] = panel.below.slab(first_slab + s);
    Lanes value[S] = {};
    for (Index p = 0; p < count; ++p) {
#pragma GCC unroll 4
        for (int s = 0; s < S; ++s) value[s] += lanes(slab[s] + width * p) * pivots[p];
    }
    for (int s = 0; s < S; ++s) {
        const Index first = width * (first_slab + s);
        const Index end = std::min(width, below - first);
        for (Index lane = 0; lane < end; ++lane) x[rows[first + lane]] -= value[s][lane];
    }
}

template <int S>
void gather_transposed(const Panel& panel, Index first_slab, Index count, const double* below, Lanes* sums) {
    const double* slab[S];
    Lanes value[S];
    for (int s = 0; s < S; ++s) {
        slab[s] = panel.below.slab(first_slab + s);
        value[s] = lanes(below + width * (first_slab + s));
    }
    for (Index p = 0; p < count; ++p) {
        Lanes total = sums[p];
#pragma GCC unroll 4
        for (int s = 0; s < S; ++s) total += lanes(slab[s] + width * p) * value[s];
        sums[p] = total;
    }
}

// Backward substitution within the pivots: sums[p], added over its lanes, is subtracted from pivot p.
void backward_top(const Panel& panel, Index count, Lanes* sums, double* pivots) {
    for (Index i = panel.top_slabs - 1; i >= 0; --i) {
        const double* slab = panel.top.slab(i);
        Lanes solved{};
        for (Index p = std::min(count, width * (i + 1)) - 1; p >= width * i; --p) {
            pivots[p] -= sum(sums[p] + lanes(slab + width * p) * solved);
            solved[p - width * i] = pivots[p];
        }
        for (Index p = 0; p < width * i; ++p) sums[p] += lanes(slab + width * p) * solved;
    }
}

// The contributions of fronts to both substitutions, in the memory of one thread.
class Fronts {
  public:
    Fronts(const FactorView& factor, double* memory) : factor_(factor), memory_(memory) {}

    static std::ptrdiff_t doubles(const AssemblyPlan& plan) {
        return std::ptrdiff_t{width} *
               (plan.most_pivots + slabs::count(plan.most_pivots) + slabs::count(plan.most_below));
    }

    /// Forward substitution of front s. x begins at unknown `first` of the elimination order; rows below are at
    /// the front's targets.
    void forward(Index s, double* x, Index first) {
        const FrontShape& shape = factor_.plan.fronts[s].shape;
        const Panel panel(factor_.panels + factor_.plan.fronts[s].panel, shape.pivots);
        const Index* order = factor_.pivot_order + shape.first;
        double *own = x + (shape.first - first), *pivots = this->pivots();
        for (Index k = 0; k < shape.pivots; ++k) pivots[k] = own[order[k]];
        std::fill(pivots + shape.pivots, pivots + width * panel.top_slabs, 0.0);
        forward_top(panel, shape.pivots, pivots);
        std::copy_n(pivots, shape.pivots, own);

        const Index slab_count = slabs::count(shape.below);
        const Index* rows = factor_.plan.targets.data() + shape.rows;
        Index slab = 0;
        for (; slab + row_group <= slab_count; slab += row_group)
            subtract_below<row_group>(panel, slab, shape.pivots, pivots, rows, shape.below, x);
        for (; slab < slab_count; ++slab)
            subtract_below<1>(panel, slab, shape.pivots, pivots, rows, shape.below, x);
    }

    void backward(Index s, double* x, Index first) {
        const FrontShape& shape = factor_.plan.fronts[s].shape;
        const Panel panel(factor_.panels + factor_.plan.fronts[s].panel, shape.pivots);
        const Index* order = factor_.pivot_order + shape.first;
        double *own = x + (shape.first - first), *pivots = this->pivots(), *below = this->below();
        std::copy_n(own, shape.pivots, pivots);
        const Pivots d{factor_.pivots.diagonal + shape.first, factor_.pivots.coupling + shape.first};
        for (Index k = 0; k < shape.pivots;) k += divide_by_pivot(d, k, pivots[k], pivots + k + 1);

        const Index slab_count = slabs::count(shape.below);
        const Index* rows = factor_.plan.targets.data() + shape.rows;
        for (Index k = 0; k < shape.below; ++k) below[k] = x[rows[k]];
        std::fill(below + shape.below, below + width * slab_count, 0.0);
        Lanes* const sums = this->sums();
        std::fill_n(sums, shape.pivots, Lanes{});
        Index slab = 0;
        for (; slab + row_group <= slab_count; slab += row_group)
            gather_transposed<row_group>(panel, slab, shape.pivots, below, sums);
        for (; slab < slab_count; ++slab) gather_transposed<1>(panel, slab, shape.pivots, below, sums);
        backward_top(panel, shape.pivots, sums, pivots);
        for (Index k = 0; k < shape.pivots; ++k) own[order[k]] = pivots[k];
    }

  private:
    Lanes* sums() const { return &lanes(memory_); }
    double* pivots() const { return memory_ + width * factor_.plan.most_pivots; }
    double* below() const { return pivots() + width * slabs::count(factor_.plan.most_pivots); }

    const FactorView& factor_;
    double* const memory_;
};

}  // namespace

// Each subtree works in a vector of its own; its contributions to the rows below its root are added in the
// order of the plan.
void substitute_one(const FactorView& factor, double* x) {
    const AssemblyPlan& plan = factor.plan;
    const int subtrees = static_cast<int>(plan.subtrees.size());
    slabs::Buffer local(plan.local_doubles);
    slabs::Buffer memory(std::max(1, std::min(num_threads(), subtrees)) * Fronts::doubles(plan));
    WorkSpaces spaces(memory, Fronts::doubles(plan));
    const auto for_subtrees = [&](auto&& body) {
        parallel_for(subtrees, [&](int task) {
            const Subtree& subtree = plan.subtrees[task];
            Fronts fronts(factor, spaces.of_this_thread());
            body(subtree, fronts, local.data() + subtree.local);
        });
    };
    const auto for_rows_below = [&](const Subtree& subtree, auto&& body) {
        const FrontShape& root = plan.fronts[subtree.end - 1].shape;
        double* const own = local.data() + subtree.local + subtree.unknowns;
        for (Index k = 0; k < root.below; ++k) body(own[k], x[plan.rows[root.rows + k]]);
    };

    const auto backward = [&](const Subtree& subtree, Fronts& fronts, double* own) {
        for (Index s = subtree.end - 1; s >= subtree.begin; --s) fronts.backward(s, own, subtree.first);
        std::copy_n(own, subtree.unknowns, x + subtree.first);
    };
    // A subtree that is a whole connected component is substituted in both directions at once, while its part
    // of L is in the cache.
    const auto is_whole = [&](const Subtree& subtree) {
        return plan.fronts[subtree.end - 1].shape.below == 0;
    };

    for_subtrees([&](const Subtree& subtree, Fronts& fronts, double* own) {
        std::copy_n(x + subtree.first, subtree.unknowns, own);
        for_rows_below(subtree, [](double& mine, double&) { mine = 0.0; });
        for (Index s = subtree.begin; s < subtree.end; ++s) fronts.forward(s, own, subtree.first);
        if (is_whole(subtree)) backward(subtree, fronts, own);
    });
    for (const Subtree& subtree : plan.subtrees)
        for_rows_below(subtree, [](double& mine, double& shared) { shared += mine; });
    Fronts fronts(factor, spaces.of_this_thread());
    for (const Index s : plan.top) fronts.forward(s, x, 0);
    for (auto s = plan.top.rbegin(); s != plan.top.rend(); ++s) fronts.backward(*s, x, 0);
    for_subtrees([&](const Subtree& subtree, Fronts& fronts, double* own) {
        if (is_whole(subtree)) return;
        for_rows_below(subtree, [](double& mine, double& shared) { mine = shared; });
        backward(subtree, fronts, own);
    });
}

}  // namespace magshell
