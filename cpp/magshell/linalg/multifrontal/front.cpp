#include <algorithm>
#include <cmath>
#include <mutex>

#include "magshell/core/parallel.h"
#include "magshell/linalg/multifrontal/dense_kernels.h"
#include "magshell/linalg/multifrontal/slab_kernels.h"

namespace magshell {
namespace {

using slabs::for_groups;
using slabs::lanes;
using slabs::Lanes;
using slabs::Panel;
using slabs::width;

constexpr Index block_columns = PivotBlock::max_size;
constexpr Index block_slabs = block_columns / width;
constexpr Index depth_block =
    192;  // [columns] of L multiplied at a time: three slabs of this size stay in the first-level cache

// Computes W = L D for the rows of one slab and some columns of L.
void scale_by_pivots(const double* slab, Index first, Index depth, const Pivots& d, double* scaled) {
    for (Index p = 0; p < depth; ++p) {
        const Index k = first + p;
        Lanes value = lanes(slab + width * k) * d.diagonal[k];
        if (d.coupling[k] != 0.0) value += lanes(slab + width * (k + 1)) * d.coupling[k];
        if (k > first && d.coupling[k - 1] != 0.0) value += lanes(slab + width * (k - 1)) * d.coupling[k - 1];
        lanes(scaled + width * p) = value;
    }
}

// Scratch memory for W of one block: four slabs, depth_block columns.
struct ScaledBlock {
    alignas(64) double data[block_slabs][width * depth_block];
};

// A range of slabs or columns.
struct Range {
    Index begin, end;
};

// Computes target(I, J) -= L(I, :) D L(J, :)^T over some columns of L, for the slabs J of one block of columns
// of the target and the slabs I = rows, none of them above J. Source and Target return pointers to slabs.
template <bool Overwrite, class Source, class Target>
void update_block(const Source& source, const Target& target, Range columns, Range rows, Range depth,
                  const Pivots& d) {
    static thread_local ScaledBlock scaled;
    const Index count = depth.end - depth.begin;
    const Range slabs_across{columns.begin / width, slabs::count(columns.end)};
    for (Index j = slabs_across.begin; j < slabs_across.end; ++j) {
        scale_by_pivots(source(j), depth.begin, count, d, scaled.data[j - slabs_across.begin]);
    }
    const auto tiles = [&]<int S>(Index i, Index end) {
        const double* from[S];
        for (int s = 0; s < S; ++s) from[s] = source(i + s) + width * depth.begin;
        for (Index j = slabs_across.begin; j < end; ++j) {
            double* to[S];
            for (int s = 0; s < S; ++s) to[s] = target(i + s) + width * width * j;
            slabs::subtract_product<S, Overwrite>(to, from, scaled.data[j - slabs_across.begin], count,
                                                  std::min(width, columns.end - width * j));
        }
    };
    Index i = rows.begin;
    for (; i < std::min(rows.end, slabs_across.end); ++i)
        tiles.template operator()<1>(i, i + 1);  // the triangle at the diagonal
    for_groups(i, rows.end,
               [&]<int S>(Index group) { tiles.template operator()<S>(group, slabs_across.end); });
}

void load_block(const Panel& panel, Index first, PivotBlock& block) {
    for (Index i = 0; i < block.size; ++i) {
        const Index row = first + i;
        const double* slab = panel.top.slab(row / width) + row % width;
        for (Index j = 0; j <= i; ++j) {
            block.entries[j * block.stride + i] = block.entries[i * block.stride + j] =
                slab[width * (first + j)];
        }
    }
}

// Stores L, with the zeros above its diagonal in the same slabs.
void store_block(const Panel& panel, Index first, const PivotBlock& block) {
    for (Index i = 0; i < block.size; ++i) {
        const Index row = first + i;
        double* slab = panel.top.slab(row / width) + row % width;
        const Index end = std::min(block.size, (i / width + 1) * width);
        for (Index j = 0; j < end; ++j) slab[width * (first + j)] = block.entries[j * block.stride + i];
    }
}

// Permutes the pivots' rows in the columns of L computed so far to their new order.
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

// D^-1 of one block, so that L = W D^-1 needs multiplications only.
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

// Solves for rows below a factorized block: W = A P^T L^-T by substitution, then L = W D^-1. `slab[s]` begins
// at the block's first column.
template <int S>
void solve_rows(double* const (&slab)[S], const PivotBlock& block, const InversePivots& inverse,
                Lanes& growth) {
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
            for (Index j = 0; j < width; ++j)
                sum[s][j] = j < columns ? lanes(slab[s] + width * (first + j)) : Lanes{};
        }
        slabs::subtract_multiple<S, PivotBlock::stride>(sum, rows, block.entries + first, first);
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
            growth.raise_to_magnitude(l * w);
        }
    }
}

// Calls body(range) for parts of a range of slabs, on several threads if there are many slabs. The parts depend
// on the range only.
template <class Body>
void for_parts(Range range, Body&& body) {
    constexpr Index part = 12;  // [slabs] per task; time only, the sums do not depend on it; plain-words: ok
    const Index parts = (range.end - range.begin + part - 1) / part;
    if (parts <= 1) return body(range);
    parallel_for(parts, [&](int k) {
        const Index begin = range.begin + part * k;
        body(Range{begin, std::min(begin + part, range.end)});
    });
}

#if defined(__AVX512F__)
constexpr const char* vectors = "AVX-512";
#elif defined(__AVX2__)
constexpr const char* vectors = "AVX2";
#elif defined(__AVX__)
constexpr const char* vectors = "AVX";
#elif defined(__SSE2__)
constexpr const char* vectors = "SSE2";
#else
constexpr const char* vectors = "the compiler's choice";
#endif

}  // namespace

inline namespace MAGSHELL_FAMILY {

const DenseKernels own_kernels{vectors, eliminate_pivots, form_update, add_columns};

void eliminate_pivots(const Panel& panel, Index pivots, Index below_slabs, const FrontPivots& out,
                      PivotTally& tally) {
    const auto slab = [&](Index i) { return panel.slab(i); };
    const auto bring_up_to_date = [&](Range columns, Range rows) {
        for (Index k = 0; k < columns.begin; k += depth_block) {
            update_block<false>(slab, slab, columns, rows, {k, std::min(k + depth_block, columns.begin)},
                                out.pivots);
        }
    };
    std::mutex tally_mutex;
    PivotBlock block;
    for (Index first = 0; first < pivots; first += block_columns) {
        block.size = std::min(block_columns, pivots - first);
        const Range columns{first, first + block.size};
        const Index end_slab = slabs::count(columns.end);
        bring_up_to_date(columns, {first / width, end_slab});
        load_block(panel, first, block);
        block.factorize({out.pivots.diagonal + first, out.pivots.coupling + first}, tally);
        store_block(panel, first, block);
        for (Index k = 0; k < block.size; ++k) out.order[first + k] = first + block.order[k];

        const InversePivots inverse(out.pivots, first, block.size);
        for_parts({end_slab, panel.top_slabs + below_slabs}, [&](Range rows) {
            bring_up_to_date(columns, rows);
            Lanes growth{};
            for_groups(rows.begin, rows.end, [&]<int S>(Index i) {
                double* at[S];
                for (int s = 0; s < S; ++s) at[s] = slab(i + s) + width * first;
                solve_rows<S>(at, block, inverse, growth);
            });
            const std::lock_guard lock(tally_mutex);
            for (int lane = 0; lane < width; ++lane) tally.growth = std::max(tally.growth, growth[lane]);
        });
        if (block.permuted)
            permute_rows(panel, first, block);  // last, because the rows below still used the old order
    }
}

void form_update(const Panel& panel, Index pivots, Index below_slabs, const Pivots& d,
                 const slabs::Triangle& update) {
    const auto source = [&](Index i) { return panel.below.slab(i); };
    const auto target = [&](Index i) { return update.slab(i); };
    for_parts({0, below_slabs}, [&](Range part) {
        for (Index j = part.begin; j < part.end; j += block_slabs) {
            const Range columns{width * j, width * std::min(j + block_slabs, part.end)};
            const Range rows{j, below_slabs};
            update_block<true>(source, target, columns, rows, {0, std::min(depth_block, pivots)}, d);
            for (Index k = depth_block; k < pivots; k += depth_block) {
                update_block<false>(source, target, columns, rows, {k, std::min(k + depth_block, pivots)}, d);
            }
        }
    });
}

}  // namespace MAGSHELL_FAMILY
}  // namespace magshell
