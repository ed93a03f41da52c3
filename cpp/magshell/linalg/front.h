// The dense work on one front: eliminate its pivots and form what they leave to its ancestors.
#pragma once

#include "magshell/linalg/pivot_block.h"
#include "magshell/linalg/slabs.h"

namespace magshell {

/// The pivots of a front, and the order in which its own pivot rows were taken.
struct FrontPivots {
    Pivots pivots;
    Index* order;  // pivot k of the front is row order[k] of it
};

/// Turns the assembled columns of a front into L and D. `pivots` columns, `below_slabs` slabs of rows below.
/// Pivots are chosen among 32 consecutive columns; no row leaves its front, so the pattern of L stays what
/// was analysed.
void eliminate_pivots(const slabs::Panel& panel, Index pivots, Index below_slabs, const FrontPivots& out,
                      PivotTally& tally);

/// update = - L D L^T over the rows below the pivots (whole slabs of the lower triangle).
void form_update(const slabs::Panel& panel, Index pivots, Index below_slabs, const Pivots& d,
                 const slabs::Triangle& update);

}  // namespace magshell
