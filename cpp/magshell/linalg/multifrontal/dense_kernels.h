// DenseKernels: the dense kernels of a factorization, where it spends its time. A wheel contains them for two
// families of processors: front.cpp, pivot_block.cpp and lane_moves.cpp are compiled for each, and one is
// chosen when the library is loaded.
#pragma once

#include "magshell/linalg/multifrontal/assembly_plan.h"
#include "magshell/linalg/multifrontal/pivot_block.h"
#include "magshell/linalg/multifrontal/slabs.h"

namespace magshell {

/// The pivots of a front, and the order in which its pivot rows were taken.
struct FrontPivots {
    Pivots pivots;
    Index* order;  // pivot k is row order[k] of the front
};

struct DenseKernels {
    const char* vectors;  // name of the instruction set

    /// Turns the assembled columns of a front into L and D. `pivots`: number of columns; `below_slabs`: number
    /// of slabs of rows below. Pivots are chosen among 32 consecutive columns; no row leaves its front, so the
    /// pattern of L stays as analysed.
    void (*eliminate_pivots)(const slabs::Panel& panel, Index pivots, Index below_slabs,
                             const FrontPivots& out, PivotTally& tally);

    /// Computes update = - L D L^T over the rows below the pivots (whole slabs of the lower triangle).
    void (*form_update)(const slabs::Panel& panel, Index pivots, Index below_slabs, const Pivots& d,
                        const slabs::Triangle& update);

    /// Adds the lanes that a transfer moves, for the columns first ... end - 1 of one slab, to columns of
    /// another.
    void (*add_columns)(const Transfer& transfer, const double* source, double* target, const Index* places,
                        Index first, Index end);
};

inline namespace MAGSHELL_FAMILY {

void eliminate_pivots(const slabs::Panel& panel, Index pivots, Index below_slabs, const FrontPivots& out,
                      PivotTally& tally);
void form_update(const slabs::Panel& panel, Index pivots, Index below_slabs, const Pivots& d,
                 const slabs::Triangle& update);
void add_columns(const Transfer& transfer, const double* source, double* target, const Index* places,
                 Index first, Index end);

extern const DenseKernels own_kernels;

}  // namespace MAGSHELL_FAMILY

/// Returns the kernels for the current processor; with MAGSHELL_VECTORS=baseline in the environment those of
/// the baseline.
const DenseKernels& dense_kernels();

}  // namespace magshell
