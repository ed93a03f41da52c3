// LowRankTerm: the base class of terms whose Hessian couples all of their nodes, as a cavity or a sliding
// tendon does. The coupling has low rank, so it is kept as a few dense columns instead of filling the sparse
// matrix (linalg/low_rank_factor.h).
#pragma once

#include "magshell/assembly/low_rank.h"
#include "magshell/terms/term.h"

namespace magshell {

class LowRankTerm : public Term {
  public:
    /// Adds the low-rank part of the Hessian at the last evaluated state.
    virtual void add_low_rank(const LoadParameters& load_parameters, LowRank& out) const = 0;

    /// Adds the magnitude [N] of the forces that cancel at the last evaluated state, a bound of their
    /// round-off.
    virtual void add_cancelling_here(VectorXd& out) const = 0;

    /// Chooses the pressures or tensions that the assembled curvature is scaled with from now on. extrapolated:
    /// those at the end of the last linearized step; in mixed Newton steps they are unknowns of their own,
    /// condensed, which a stiff liquid needs to converge. positive_definite: leaves out the state's own pressure of
    /// laws with a target volume, because it says little while the stiff volume is still far from its target;
    /// without effect if extrapolated.
    void take_extrapolated(bool extrapolated, bool positive_definite) {
        extrapolated_ = extrapolated;
        positive_definite_ = positive_definite && !extrapolated;
    }

  protected:
    bool extrapolated_ = false, positive_definite_ = false;
};

}  // namespace magshell
