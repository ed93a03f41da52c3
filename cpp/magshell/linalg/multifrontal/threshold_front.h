// ThresholdFront: a dense front that chooses its pivots with regard to all of its rows (Duff and Reid 1983).
//
//     A = [ L1 ] D [ L1^T  L2^T ] + [ 0  0 ]
//         [ L2 ]                    [ 0  C ]
//
// The rows and columns that may be pivots ("fully summed") come first. A pivot is taken only if it bounds its
// columns of L, |l| <= 1 / threshold; fully summed columns without such a pivot stay in C, for the parent.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "magshell/core/types.h"
#include "magshell/linalg/multifrontal/pivot_block.h"

namespace magshell {

struct ThresholdFront {
    std::vector<Index>
        rows;          // in the elimination order of the analysis; after eliminate() the pivots come first
    Index summed = 0;  // number of fully summed rows; they come first
    /// In: the fully summed columns (rows, summed), both triangles of their square part. After eliminate(): L in
    /// the first columns, with its unit diagonal and zeros above, then the fully summed columns of C.
    Eigen::MatrixXd columns;
    Eigen::MatrixXd below;                   // the rest of C, lower triangle; in: the sum over the children
    Index eliminated = 0;                    // number of pivots taken
    std::vector<double> diagonal, coupling;  // D

    void eliminate(PivotTally& tally);
    std::size_t bytes() const;

  private:
    enum class PivotSize { none, one, two };

    Index size() const { return static_cast<Index>(rows.size()); }
    void exchange(Index i, Index k);
    PivotSize test(Index candidate, Index end, Index& mate) const;
    void eliminate_one(Index end, PivotTally& tally);
    void eliminate_two(Index end, PivotTally& tally);
    void eliminate_among(Index end, PivotTally& tally);
    Eigen::MatrixXd scaled_by_pivots(Index first_row, Index rows, Index first_pivot) const;
    void update_columns(Index first_pivot, Index first_column);
    void update_below();
    void finish_columns();
};

}  // namespace magshell
