// The dense work of a factorization, where its time goes. A wheel has it for two families of processors: front.cpp,
// pivot_block.cpp and lane_moves.cpp are compiled for each, and the one that runs is chosen as it is loaded.
#pragma once

#include "magshell/linalg/assembly_plan.h"
#include "magshell/linalg/pivot_block.h"
#include "magshell/linalg/slabs.h"

namespace magshell {

/// The pivots of a front, and the order in which its own pivot rows were taken.
struct FrontPivots {
    Pivots pivots;
    Index* order;  // pivot k of the front is row order[k] of it
};

struct DenseKernels {
    const char* vectors;  // the instructions, in words

    /// Turns the assembled columns of a front into L and D. `pivots` columns, `below_slabs` slabs of rows below.
    /// Pivots are chosen among 32 consecutive columns; no row leaves its front, so the pattern of L stays what
    /// was analysed.
    void (*eliminate_pivots)(const slabs::Panel& panel, Index pivots, Index below_slabs,
                             const FrontPivots& out, PivotTally& tally);

    /// update = - L D L^T over the rows below the pivots (whole slabs of the lower triangle).
    void (*form_update)(const slabs::Panel& panel, Index pivots, Index below_slabs, const Pivots& d,
                        const slabs::Triangle& update);

    /// Adds the lanes that a transfer moves, of the columns first ... end - 1 of one slab, to columns of another.
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

/// Those for the processor that this runs on; with MAGSHELL_VECTORS=baseline in the environment the plainest.
const DenseKernels& dense_kernels();

}  // namespace magshell
