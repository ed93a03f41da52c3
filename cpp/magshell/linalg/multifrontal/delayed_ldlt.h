// DelayedLdlt: L D L^T of the matrices that SupernodalLdlt cannot factorize with pivots inside fronts.
//
// Pivots are chosen with regard to all rows of their front; a column that has none is delayed: it joins the
// pivots of the parent front, where more of its rows are fully summed (Duff and Reid 1983). At a root every
// column has a pivot, so |l| <= 10 for any symmetric matrix, and the inertia is that of a matrix that differs
// by rounding. The fronts are those of the analysis, but their sizes and the memory depend on the values.
//
// Every sum is formed in an order that depends on the matrix only: the bits are the same for any number of
// threads.
#pragma once

#include <vector>

#include "magshell/linalg/multifrontal/assembly_plan.h"
#include "magshell/linalg/multifrontal/threshold_front.h"

namespace magshell {

class DelayedLdlt {
  public:
    /// Factorizes the matrix with these values, in the order of the pattern. panels: memory for
    /// plan.factor_doubles, overwritten.
    DelayedLdlt(const AssemblyPlan& plan, const double* values, double* panels);

    const PivotTally& tally() const { return tally_; }
    std::size_t bytes() const;

    /// Replaces x, in the elimination order of the analysis, by the solution.
    void solve(VectorXd& x) const;

  private:
    void process(Index front, const double* values, double* panels, PivotTally& tally);

    const AssemblyPlan& plan_;
    std::vector<ThresholdFront> fronts_;
    PivotTally tally_;
};

}  // namespace magshell
