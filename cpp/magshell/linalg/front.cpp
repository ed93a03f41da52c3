#include "magshell/linalg/front.h"

#include <algorithm>
#include <cmath>

#include "magshell/linalg/slab_kernels.h"

namespace magshell {
namespace {

using slabs::for_groups;
using slabs::lanes;
using slabs::Lanes;
using slabs::Panel;
using slabs::width;

constexpr Index block_columns = PivotBlock::max_size;
constexpr Index block_slabs = block_columns / width;
constexpr Index depth_block = 192;  // columns of L multiplied at a time: three slabs of it stay in the first-level cache

// W = L D, for the rows of one slab and some columns of L.
void scale_by_pivots(const double* slab, Index first, Index depth, const Pivots& d, double* scaled) {
    for (Index p = 0; p < depth; ++p) {
        const Index k = first + p;
        Lanes value = lanes(slab + width * k) * d.diagonal[k];
        if (d.coupling[k] != 0.0) value += lanes(slab + width * (k + 1)) * d.coupling[k];
        if (k > first && d.coupling[k - 1] != 0.0) value += lanes(slab + width * (k - 1)) * d.coupling[k - 1];
        lanes(scaled + width * p) = value;
    }
}

// Scratch for W of one block: four slabs, depth_block columns.
struct ScaledBlock {
    alignas(64) double data[block_slabs][width * depth_block];
};

// target(I, J) -= L(I, :) D L(J, :)^T for the slabs J of one block and I from that block on, over `depth` columns of L from
// `first_column` on. Source and Target hand out slab pointers; columns of the target count from its slabs' beginning.
template <bool Overwrite, class Source, class Target>
void update_block(const Source& source, const Target& target, Index first_slab, Index end_column, Index last_slab,
                  Index first_column, Index depth, const Pivots& d, ScaledBlock& scaled) {
    const Index end_slab = slabs::count(end_column);
    for (Index j = first_slab; j < end_slab; ++j) {
        scale_by_pivots(source(j), first_column, depth, d, scaled.data[j - first_slab]);
    }
    const auto tiles = [&]<int S>(Index i, Index end) {
        const double* rows[S];
        for (int s = 0; s < S; ++s) rows[s] = source(i + s) + width * first_column;
        for (Index j = first_slab; j < end; ++j) {
            double* to[S];
            for (int s = 0; s < S; ++s) to[s] = target(i + s) + width * width * j;
            slabs::subtract_product<S, Overwrite>(to, rows, scaled.data[j - first_slab], depth,
                                                  std::min(width, end_column - width * j));
        }
    };
    for (Index i = first_slab; i < end_slab; ++i) tiles.template operator()<1>(i, i + 1);  // the triangle on the diagonal
    for_groups(end_slab, last_slab, [&]<int S>(Index i) { tiles.template operator()<S>(i, end_slab); });
}

void load_block(const Panel& panel, Index first, PivotBlock& block) {
    for (Index i = 0; i < block.size; ++i) {
        const Index row = first + i;
        const double* slab = panel.top.slab(row / width) + row % width;
        for (Index j = 0; j <= i; ++j) {
            block.entries[j * block.stride + i] = block.entries[i * block.stride + j] = slab[width * (first + j)];
        }
    }
}

// L, with the zeros above its diagonal that share a slab with it.
void store_block(const Panel& panel, Index first, const PivotBlock& block) {
    for (Index i = 0; i < block.size; ++i) {
        const Index row = first + i;
        double* slab = panel.top.slab(row / width) + row % width;
        const Index end = std::min(block.size, (i / width + 1) * width);
        for (Index j = 0; j < end; ++j) slab[width * (first + j)] = block.entries[j * block.stride + i];
    }
}

// The pivots' rows of the columns of L already computed follow their new order.
void permute_rows(const Panel& panel, Index first, const PivotBlock& block) {
    double old[block_columns];
    for (Index p = 0; p < first; ++p) {
        const auto at = [&](Index row) -> double& {
            return panel.top.slab((first + row) / width)[width * p + (first + row) % width];
        };
        for (Index i = 0; i < block.size; ++i) old[i] = at(i);
        for (Index i = 0; i < block.size; ++i) at(i) = old[block.order[i]];
    }
}

// D^-1 of one block, so that L = W D^-1 costs multiplications only.
struct InversePivots {
    double diagonal[block_columns + 1], coupling[block_columns + 1];
    InversePivots(const Pivots& d, Index first, Index size) {
        for (Index k = 0; k < size; ++k) {
            const double a = d.diagonal[first + k], b = d.coupling[first + k];
            coupling[k] = 0.0;
            if (b == 0.0) {
                diagonal[k] = 1.0 / a;
            } else {
                const double c = d.diagonal[first + k + 1];
                const double determinant = a * c - b * b;
                diagonal[k] = c / determinant;
                diagonal[k + 1] = a / determinant;
                coupling[k] = -b / determinant;
                coupling[++k] = 0.0;
            }
        }
    }
};

// Rows below a factorized block: W = A P^T L^-T by substitution, then L = W D^-1. `slab[s]` begins at the block's first
// column.
template <int S>
void solve_rows(double* const (&slab)[S], const PivotBlock& block, const InversePivots& inverse, Lanes& growth) {
    if (block.permuted) {
        Lanes old[block_columns];
        for (int s = 0; s < S; ++s) {
            for (Index j = 0; j < block.size; ++j) old[j] = lanes(slab[s] + width * j);
            for (Index j = 0; j < block.size; ++j) lanes(slab[s] + width * j) = old[block.order[j]];
        }
    }
    const double* rows[S];
    for (int s = 0; s < S; ++s) rows[s] = slab[s];
    for (Index first = 0; first < block.size; first += width) {
        const Index columns = std::min(width, block.size - first);
        Lanes sum[S][width];
        for (int s = 0; s < S; ++s) {
#pragma GCC unroll 8
            for (Index j = 0; j < width; ++j) sum[s][j] = j < columns ? lanes(slab[s] + width * (first + j)) : Lanes{};
        }
        slabs::multiply<S, PivotBlock::stride, -1>(sum, rows, block.entries + first, first);
        const double* l = block.entries + first * block.stride + first;
#pragma GCC unroll 8
        for (Index p = 0; p < width; ++p) {
#pragma GCC unroll 8
            for (Index j = p + 1; j < width; ++j) {
                const double value = l[p * block.stride + j];
#pragma GCC unroll 3
                for (int s = 0; s < S; ++s) sum[s][j] -= sum[s][p] * value;
            }
        }
        for (int s = 0; s < S; ++s) {
            for (Index j = 0; j < columns; ++j) lanes(slab[s] + width * (first + j)) = sum[s][j];
        }
    }
    for (int s = 0; s < S; ++s) {
        for (Index k = 0; k < block.size; ++k) {
            Lanes& at = lanes(slab[s] + width * k);
            const Lanes w = at;
            Lanes l = w * inverse.diagonal[k];
            if (inverse.coupling[k] != 0.0) {
                Lanes& at_next = lanes(slab[s] + width * (k + 1));
                const Lanes w_next = at_next;
                l += w_next * inverse.coupling[k];
                at_next = w * inverse.coupling[k] + w_next * inverse.diagonal[k + 1];
                ++k;
            }
            at = l;
            const Lanes product = l * w;
            const Lanes magnitude = product < 0.0 ? -product : product;
            growth = magnitude > growth ? magnitude : growth;
        }
    }
}

}  // namespace

void eliminate_pivots(const Panel& panel, Index pivots, Index below_slabs, const FrontPivots& out, PivotTally& tally) {
    const Index last_slab = panel.top_slabs + below_slabs;
    const auto slab = [&](Index i) { return panel.slab(i); };
    static thread_local ScaledBlock scaled;
    static thread_local PivotBlock block;
    Lanes growth{};
    for (Index first = 0; first < pivots; first += block_columns) {
        block.size = std::min(block_columns, pivots - first);
        for (Index k = 0; k < first; k += depth_block) {
            update_block<false>(slab, slab, first / width, first + block.size, last_slab, k,
                                std::min(depth_block, first - k), out.pivots, scaled);
        }
        load_block(panel, first, block);
        block.factorize({out.pivots.diagonal + first, out.pivots.coupling + first}, tally);
        store_block(panel, first, block);
        if (block.permuted) permute_rows(panel, first, block);
        for (Index k = 0; k < block.size; ++k) out.order[first + k] = first + block.order[k];

        const InversePivots inverse(out.pivots, first, block.size);
        for_groups(slabs::count(first + block.size), last_slab, [&]<int S>(Index i) {
            double* rows[S];
            for (int s = 0; s < S; ++s) rows[s] = slab(i + s) + width * first;
            solve_rows<S>(rows, block, inverse, growth);
        });
    }
    for (int lane = 0; lane < width; ++lane) tally.growth = std::max(tally.growth, growth[lane]);
}

void form_update(const Panel& panel, Index pivots, Index below_slabs, const Pivots& d, const slabs::Triangle& update) {
    static thread_local ScaledBlock scaled;
    const auto source = [&](Index i) { return panel.below.slab(i); };
    const auto target = [&](Index i) { return update.slab(i); };
    for (Index k = 0; k < pivots; k += depth_block) {
        const Index depth = std::min(depth_block, pivots - k);
        for (Index j = 0; j < below_slabs; j += block_slabs) {
            const Index end = std::min(below_slabs, j + block_slabs) * width;
            if (k == 0) update_block<true>(source, target, j, end, below_slabs, k, depth, d, scaled);
            else update_block<false>(source, target, j, end, below_slabs, k, depth, d, scaled);
        }
    }
}

}  // namespace magshell
