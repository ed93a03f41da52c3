#include <algorithm>

#include "magshell/linalg/multifrontal/slab_kernels.h"
#include "magshell/linalg/multifrontal/triangular_solves.h"

namespace magshell {
namespace {

using slabs::lanes;
using slabs::Lanes;
using slabs::Panel;
using slabs::width;

// Computes rows(8, eight right-hand sides) -= slab(8, count) pivots(count, eight right-hand sides).
void subtract_slab(const double* slab, Index count, const double* pivots, Lanes (&rows)[1][width]) {
    const double* const sources[1] = {pivots};
    slabs::subtract_multiple<1, width>(rows, sources, slab, count);
}

// Computes pivots(count, eight) -= slab(8, count)^T rows(8, eight).
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
    slabs::Buffer pivot_buffer(std::ptrdiff_t{width} * plan.most_pivots);
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
