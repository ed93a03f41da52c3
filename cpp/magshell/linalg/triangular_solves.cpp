#include "magshell/linalg/triangular_solves.h"

#include <algorithm>

#include "magshell/linalg/slab_kernels.h"

namespace magshell {
namespace {

using slabs::lanes;
using slabs::Lanes;
using slabs::Panel;
using slabs::width;

constexpr int row_group =
    4;  // slabs multiplied at once by one vector: enough chains of additions to hide their latency

Index most_pivots(const AssemblyPlan& plan) {
    Index most = 0;
    for (const FrontPlan& front : plan.fronts) most = std::max(most, front.shape.pivots);
    return most;
}

double sum(const Lanes& v) {
    return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

// D z = y for the 1x1 or 2x2 pivot that begins at k; T is a number or eight of them. Returns how many rows it
// has.
template <class T>
Index divide_by_pivot(const Pivots& d, Index k, T& first, T* second) {
    const double a = d.diagonal[k], b = d.coupling[k];
    if (b == 0.0) {
        first = first / a;
        return 1;
    }
    const double c = d.diagonal[k + 1];
    const double determinant = a * c - b * b;
    const T y = first, z = *second;
    first = (y * c - z * b) / determinant;
    *second = (z * a - y * b) / determinant;
    return 2;
}

// One right-hand side. `pivots` is the part of x on a front's pivots, in the order they were taken, padded to
// whole slabs.

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
                lanes(slab + width * (width * i + lane)) * solved;  // L is unit: clears the lane itself, too
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

// sums[p], added over its lanes, is what is to be subtracted from pivot p.
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

}  // namespace

void substitute_one(const FactorView& factor, double* x) {
    const AssemblyPlan& plan = factor.plan;
    const Index most = most_pivots(plan);
    slabs::Buffer sums_buffer(std::ptrdiff_t{width} * most), pivot_buffer(width * slabs::count(most));
    slabs::Buffer below_buffer(width * (slabs::count(static_cast<Index>(plan.order.size())) + 1));
    double* pivots = pivot_buffer.data();
    double* below = below_buffer.data();
    Lanes* sums = &lanes(sums_buffer.data());

    for (Index s = 0; s < plan.front_count(); ++s) {
        const FrontShape& shape = plan.fronts[s].shape;
        const Panel panel(factor.panels + plan.fronts[s].panel, shape.pivots);
        double* own = x + shape.first;
        for (Index k = 0; k < shape.pivots; ++k) pivots[k] = own[factor.pivot_order[shape.first + k]];
        std::fill(pivots + shape.pivots, pivots + width * panel.top_slabs, 0.0);
        forward_top(panel, shape.pivots, pivots);
        std::copy_n(pivots, shape.pivots, own);

        const Index slab_count = slabs::count(shape.below);
        const Index* rows = plan.rows.data() + shape.rows;
        Index slab = 0;
        for (; slab + row_group <= slab_count; slab += row_group) {
            subtract_below<row_group>(panel, slab, shape.pivots, pivots, rows, shape.below, x);
        }
        for (; slab < slab_count; ++slab)
            subtract_below<1>(panel, slab, shape.pivots, pivots, rows, shape.below, x);
    }

    for (Index s = plan.front_count() - 1; s >= 0; --s) {
        const FrontShape& shape = plan.fronts[s].shape;
        const Panel panel(factor.panels + plan.fronts[s].panel, shape.pivots);
        double* own = x + shape.first;
        std::copy_n(own, shape.pivots, pivots);
        const Pivots d{factor.pivots.diagonal + shape.first, factor.pivots.coupling + shape.first};
        for (Index k = 0; k < shape.pivots;) k += divide_by_pivot(d, k, pivots[k], pivots + k + 1);

        const Index slab_count = slabs::count(shape.below);
        const Index* rows = plan.rows.data() + shape.rows;
        for (Index k = 0; k < shape.below; ++k) below[k] = x[rows[k]];
        std::fill(below + shape.below, below + width * slab_count, 0.0);
        std::fill_n(sums, shape.pivots, Lanes{});
        Index slab = 0;
        for (; slab + row_group <= slab_count; slab += row_group) {
            gather_transposed<row_group>(panel, slab, shape.pivots, below, sums);
        }
        for (; slab < slab_count; ++slab) gather_transposed<1>(panel, slab, shape.pivots, below, sums);
        backward_top(panel, shape.pivots, sums, pivots);
        for (Index k = 0; k < shape.pivots; ++k) own[factor.pivot_order[shape.first + k]] = pivots[k];
    }
}

namespace {

// rows(8, eight right-hand sides) -= slab(8, count) pivots(count, eight right-hand sides)
void subtract_slab(const double* slab, Index count, const double* pivots, Lanes (&rows)[1][width]) {
    const double* const sources[1] = {pivots};
    slabs::subtract_multiple<1, width>(rows, sources, slab, count);
}

// pivots(count, eight) -= slab(8, count)^T rows(8, eight)
void subtract_transposed(const double* slab, Index count, const Lanes (&rows)[width], double* pivots) {
    for (Index p = 0; p < count; ++p) {
        Lanes even = lanes(pivots + width * p), odd{};
#pragma GCC unroll 4
        for (int lane = 0; lane < width; lane += 2) {
            even -= rows[lane] * slab[width * p + lane];
            odd -= rows[lane + 1] * slab[width * p + lane + 1];
        }
        lanes(pivots + width * p) = even + odd;
    }
}

}  // namespace

void substitute_eight(const FactorView& factor, double* x) {
    const AssemblyPlan& plan = factor.plan;
    slabs::Buffer pivot_buffer(std::ptrdiff_t{width} * most_pivots(plan));
    double* pivots = pivot_buffer.data();

    for (Index s = 0; s < plan.front_count(); ++s) {
        const FrontShape& shape = plan.fronts[s].shape;
        const Panel panel(factor.panels + plan.fronts[s].panel, shape.pivots);
        double* own = x + std::ptrdiff_t{width} * shape.first;
        for (Index k = 0; k < shape.pivots; ++k) {
            lanes(pivots + width * k) = lanes(own + width * factor.pivot_order[shape.first + k]);
        }
        for (Index i = 0; i < panel.top_slabs; ++i) {
            const Index end = std::min(width, shape.pivots - width * i);
            Lanes rows[1][width] = {};
            for (Index lane = 0; lane < end; ++lane)
                rows[0][lane] = lanes(pivots + width * (width * i + lane));
            subtract_slab(panel.top.slab(i), width * i, pivots, rows);
            for (Index lane = 0; lane < end; ++lane) {
                const double* column = panel.top.slab(i) + width * (width * i + lane);
                for (Index other = lane + 1; other < end; ++other)
                    rows[0][other] -= rows[0][lane] * column[other];
                lanes(pivots + width * (width * i + lane)) = rows[0][lane];
            }
        }
        std::copy_n(pivots, width * shape.pivots, own);
        const Index* rows_below = plan.rows.data() + shape.rows;
        for (Index first = 0; first < shape.below; first += width) {
            Lanes rows[1][width] = {};
            subtract_slab(panel.below.slab(first / width), shape.pivots, pivots, rows);
            const Index end = std::min(width, shape.below - first);
            for (Index lane = 0; lane < end; ++lane) {
                lanes(x + std::ptrdiff_t{width} * rows_below[first + lane]) += rows[0][lane];
            }
        }
    }

    for (Index s = plan.front_count() - 1; s >= 0; --s) {
        const FrontShape& shape = plan.fronts[s].shape;
        const Panel panel(factor.panels + plan.fronts[s].panel, shape.pivots);
        double* own = x + std::ptrdiff_t{width} * shape.first;
        std::copy_n(own, width * shape.pivots, pivots);
        const Pivots d{factor.pivots.diagonal + shape.first, factor.pivots.coupling + shape.first};
        for (Index k = 0; k < shape.pivots;)
            k += divide_by_pivot(d, k, lanes(pivots + width * k), &lanes(pivots + width * (k + 1)));

        const Index* rows_below = plan.rows.data() + shape.rows;
        for (Index first = 0; first < shape.below; first += width) {
            Lanes rows[width] = {};
            const Index end = std::min(width, shape.below - first);
            for (Index lane = 0; lane < end; ++lane) {
                rows[lane] = lanes(x + std::ptrdiff_t{width} * rows_below[first + lane]);
            }
            subtract_transposed(panel.below.slab(first / width), shape.pivots, rows, pivots);
        }
        for (Index i = panel.top_slabs - 1; i >= 0; --i) {
            const Index end = std::min(width, shape.pivots - width * i);
            Lanes rows[width] = {};
            for (Index lane = end - 1; lane >= 0; --lane) {
                const double* column = panel.top.slab(i) + width * (width * i + lane);
                Lanes value = lanes(pivots + width * (width * i + lane));
                for (Index other = lane + 1; other < end; ++other) value -= rows[other] * column[other];
                rows[lane] = lanes(pivots + width * (width * i + lane)) = value;
            }
            subtract_transposed(panel.top.slab(i), width * i, rows, pivots);
        }
        for (Index k = 0; k < shape.pivots; ++k) {
            lanes(own + width * factor.pivot_order[shape.first + k]) = lanes(pivots + width * k);
        }
    }
}

}  // namespace magshell
